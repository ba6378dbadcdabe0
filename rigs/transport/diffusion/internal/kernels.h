#pragma once

#include "rigs/transport/diffusion/internal/lanes.h"

#include <array>
#include <cstddef>

namespace nacre::rigs::diffusion::internal {

/// A level of the multigrid hierarchy as the hot loops see it. Unknowns lie column
/// after column, layers together; a column's neighbours are columns.
template <class Real>
struct LevelView {
  std::size_t nx = 0;
  std::size_t ny = 0;
  std::size_t nz = 0;
  const Real* east = nullptr;  // a column each
  const Real* north = nullptr;
  const Real* vertical = nullptr;
  const Real* layer = nullptr;  // a layer each
  const Real* inverse = nullptr;
  const Real* diagonal = nullptr;  // an unknown each
  const Real* pivot = nullptr;     // 1 / the pivots of each column's elimination
};

template <class Real>
using LaneSums = std::array<double, Lanes<Real>::kCount>;

// The same functions for float and double; plain ones, of which the compiler makes
// clones for several instruction sets.
#define NACRE_DECLARE_DIFFUSION_KERNELS(Real)                                        \
  /* Columns where (x + y) % 2 == colour: solved exactly for the others as they are. \
     With `alone` the others are taken to be 0, and not read. */                     \
  void SolveColour(const LevelView<Real>& level,                                     \
                   unsigned colour,                                                  \
                   bool alone,                                                       \
                   const Lanes<Real>* b,                                             \
                   Lanes<Real>* x);                                                  \
  /* r = b - A x where x solves colour 0 alone and then colour 1: only colour 0 has  \
     a residual, what its neighbours send. Colour 1's columns aren't written. */     \
  void ResidualOfColourZero(                                                         \
      const LevelView<Real>& level, const Lanes<Real>* x, Lanes<Real>* r);           \
  /* coarse_b = transposed P r with P bilinear, for such a residual. */              \
  void Restrict(const LevelView<Real>& fine,                                         \
                const LevelView<Real>& coarse,                                       \
                const Lanes<Real>* r,                                                \
                Lanes<Real>* coarse_b);                                              \
  /* x += P coarse_x in the columns of colour 0: colour 1 is to be solved next. */   \
  void Prolong(const LevelView<Real>& fine,                                          \
               const LevelView<Real>& coarse,                                        \
               const Lanes<Real>* coarse_x,                                          \
               Lanes<Real>* x);                                                      \
  /* q = A p; returns p . q. */                                                      \
  LaneSums<Real> Apply(                                                              \
      const LevelView<Real>& level, const Lanes<Real>* p, Lanes<Real>* q);           \
  /* x += a p, r -= a q; returns r . r. */                                           \
  LaneSums<Real> Step(const LevelView<Real>& level,                                  \
                      const Lanes<Real>& a,                                          \
                      const Lanes<Real>* p,                                          \
                      const Lanes<Real>* q,                                          \
                      Lanes<Real>* x,                                                \
                      Lanes<Real>* r);                                               \
  LaneSums<Real> Dot(                                                                \
      const LevelView<Real>& level, const Lanes<Real>* a, const Lanes<Real>* b);     \
  /* p = z + beta p. */                                                              \
  void Turn(const LevelView<Real>& level,                                            \
            const Lanes<Real>& beta,                                                 \
            const Lanes<Real>* z,                                                    \
            Lanes<Real>* p);

NACRE_DECLARE_DIFFUSION_KERNELS(float)
NACRE_DECLARE_DIFFUSION_KERNELS(double)
#undef NACRE_DECLARE_DIFFUSION_KERNELS

}  // namespace nacre::rigs::diffusion::internal
