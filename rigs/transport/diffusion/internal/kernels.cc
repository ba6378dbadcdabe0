#include "rigs/transport/diffusion/internal/kernels.h"

#include "core/simd_clones.h"

#include <algorithm>

// Each body is written once for any Real and compiled, by the macro at the end, for
// float and double and for several instruction sets.

namespace nacre::rigs::diffusion::internal {
namespace {

// What a column's four neighbours are multiplied by, and where they are. A neighbour
// beyond the edge is the column itself, times 0.
template <class Real>
struct Neighbours {
  Real weight[4];
  std::size_t column[4];
};

template <class Real>
[[gnu::always_inline]] inline Neighbours<Real> Around(const LevelView<Real>& level,
                                                      std::size_t i,
                                                      std::size_t j) {
  const std::size_t c = j * level.nx + i;
  const bool west = i > 0;
  const bool east = i + 1 < level.nx;
  const bool south = j > 0;
  const bool north = j + 1 < level.ny;
  return {{west ? level.east[c - 1] : Real{0},
           east ? level.east[c] : Real{0},
           south ? level.north[c - level.nx] : Real{0},
           north ? level.north[c] : Real{0}},
          {west ? c - 1 : c,
           east ? c + 1 : c,
           south ? c - level.nx : c,
           north ? c + level.nx : c}};
}

// Elimination of a tridiagonal matrix with the pivots known, downwards and back up.
template <class Real>
[[gnu::always_inline]] inline void SolveColourBody(const LevelView<Real>& level,
                                                   unsigned colour,
                                                   bool alone,
                                                   const Lanes<Real>* b,
                                                   Lanes<Real>* x) {
  using Vector = typename Lanes<Real>::Vector;
  const std::size_t nz = level.nz;
  for (std::size_t j = 0; j < level.ny; ++j) {
    for (std::size_t i = (j + colour) % 2; i < level.nx; i += 2) {
      const std::size_t c = j * level.nx + i;
      const Neighbours<Real> n = Around(level, i, j);
      const Lanes<Real>* x0 = x + n.column[0] * nz;
      const Lanes<Real>* x1 = x + n.column[1] * nz;
      const Lanes<Real>* x2 = x + n.column[2] * nz;
      const Lanes<Real>* x3 = x + n.column[3] * nz;
      const Lanes<Real>* bc = b + c * nz;
      Lanes<Real>* xc = x + c * nz;
      const Real* pivot = level.pivot + c * nz;
      const Real vertical = level.vertical[c];
      Vector above = {};
      Real coupling = 0;
      for (std::size_t k = 0; k < nz; ++k) {
        Vector t = bc[k].v + coupling * above;
        if (!alone) {
          const Vector sent = n.weight[0] * x0[k].v + n.weight[1] * x1[k].v +
                              (n.weight[2] * x2[k].v + n.weight[3] * x3[k].v);
          t += level.layer[k] * sent;
        }
        above = pivot[k] * t;
        xc[k].v = above;
        coupling = vertical * level.inverse[k];
      }
      Vector below = xc[nz - 1].v;
      for (std::size_t k = nz - 1; k-- > 0;) {
        below = xc[k].v + (pivot[k] * vertical * level.inverse[k]) * below;
        xc[k].v = below;
      }
    }
  }
}

template <class Real>
[[gnu::always_inline]] inline void ResidualOfColourZeroBody(
    const LevelView<Real>& level, const Lanes<Real>* x, Lanes<Real>* r) {
  const std::size_t nz = level.nz;
  for (std::size_t j = 0; j < level.ny; ++j) {
    for (std::size_t i = j % 2; i < level.nx; i += 2) {
      const Neighbours<Real> n = Around(level, i, j);
      const Lanes<Real>* x0 = x + n.column[0] * nz;
      const Lanes<Real>* x1 = x + n.column[1] * nz;
      const Lanes<Real>* x2 = x + n.column[2] * nz;
      const Lanes<Real>* x3 = x + n.column[3] * nz;
      Lanes<Real>* rc = r + (j * level.nx + i) * nz;
      for (std::size_t k = 0; k < nz; ++k) {
        rc[k].v = level.layer[k] * (n.weight[0] * x0[k].v + n.weight[1] * x1[k].v +
                                    (n.weight[2] * x2[k].v + n.weight[3] * x3[k].v));
      }
    }
  }
}

// The fine columns that coarse column I of an axis takes from, and how much: 1/4, 3/4,
// 3/4, 1/4, where what would go beyond the edge stays.
struct Stencil1d {
  std::size_t first;
  std::size_t count;
  double weight[4];
};

inline Stencil1d FineOf(std::size_t coarse, std::size_t coarse_n, std::size_t fine_n) {
  Stencil1d s{};
  const auto put = [&](std::size_t fine, double weight) {
    if (s.count == 0) {
      s.first = fine;
    }
    s.weight[s.count++] = weight;
  };
  if (coarse > 0) {
    put(2 * coarse - 1, 0.25);
  }
  put(2 * coarse, coarse > 0 ? 0.75 : 1.0);
  if (2 * coarse + 1 < fine_n) {
    put(2 * coarse + 1, coarse + 1 < coarse_n ? 0.75 : 1.0);
  }
  if (2 * coarse + 2 < fine_n) {
    put(2 * coarse + 2, 0.25);
  }
  return s;
}

template <class Real>
[[gnu::always_inline]] inline void AddColumn(Real weight,
                                             const Lanes<Real>* in,
                                             std::size_t nz,
                                             Lanes<Real>* out) {
  for (std::size_t k = 0; k < nz; ++k) {
    out[k].v += weight * in[k].v;
  }
}

template <class Real>
[[gnu::always_inline]] inline void RestrictBody(const LevelView<Real>& fine,
                                                const LevelView<Real>& coarse,
                                                const Lanes<Real>* r,
                                                Lanes<Real>* coarse_b) {
  const std::size_t nz = fine.nz;
  for (std::size_t j = 0; j < coarse.ny; ++j) {
    const Stencil1d sy = FineOf(j, coarse.ny, fine.ny);
    for (std::size_t i = 0; i < coarse.nx; ++i) {
      const Stencil1d sx = FineOf(i, coarse.nx, fine.nx);
      Lanes<Real>* out = coarse_b + (j * coarse.nx + i) * nz;
      for (std::size_t k = 0; k < nz; ++k) {
        out[k].v = typename Lanes<Real>::Vector{};
      }
      for (std::size_t b = 0; b < sy.count; ++b) {
        // There is no residual where the sum of both is odd.
        for (std::size_t a = (sy.first + b + sx.first) % 2; a < sx.count; a += 2) {
          const Real weight = static_cast<Real>(sy.weight[b] * sx.weight[a]);
          AddColumn(
              weight, r + ((sy.first + b) * fine.nx + sx.first + a) * nz, nz, out);
        }
      }
    }
  }
}

template <class Real>
[[gnu::always_inline]] inline void ProlongBody(const LevelView<Real>& fine,
                                               const LevelView<Real>& coarse,
                                               const Lanes<Real>* coarse_x,
                                               Lanes<Real>* x) {
  const std::size_t nz = fine.nz;
  const auto other = [](std::size_t f, std::size_t coarse_n) {
    const std::size_t own = f / 2;
    if (f % 2 == 1) {
      return std::min(own + 1, coarse_n - 1);
    }
    return own == 0 ? own : own - 1;
  };
  for (std::size_t j = 0; j < fine.ny; ++j) {
    const std::size_t near_j = (j / 2) * coarse.nx;
    const std::size_t far_j = other(j, coarse.ny) * coarse.nx;
    // Colour 1 is solved next, from colour 0 alone: only that needs the correction.
    for (std::size_t i = j % 2; i < fine.nx; i += 2) {
      const std::size_t far_i = other(i, coarse.nx);
      const Lanes<Real>* nn = coarse_x + (near_j + i / 2) * nz;
      const Lanes<Real>* nf = coarse_x + (near_j + far_i) * nz;
      const Lanes<Real>* fn = coarse_x + (far_j + i / 2) * nz;
      const Lanes<Real>* ff = coarse_x + (far_j + far_i) * nz;
      Lanes<Real>* out = x + (j * fine.nx + i) * nz;
      for (std::size_t k = 0; k < nz; ++k) {
        out[k].v += Real{0.5625} * nn[k].v + Real{0.0625} * ff[k].v +
                    Real{0.1875} * (nf[k].v + fn[k].v);
      }
    }
  }
}

template <class Real>
[[gnu::always_inline]] inline void Collect(const typename Lanes<Real>::Vector& part,
                                           LaneSums<Real>& sums) {
  for (std::size_t l = 0; l < Lanes<Real>::kCount; ++l) {
    sums[l] += static_cast<double>(part[l]);
  }
}

template <class Real>
[[gnu::always_inline]] inline LaneSums<Real> ApplyBody(const LevelView<Real>& level,
                                                       const Lanes<Real>* p,
                                                       Lanes<Real>* q) {
  LaneSums<Real> sums{};
  using Vector = typename Lanes<Real>::Vector;
  const std::size_t nz = level.nz;
  for (std::size_t j = 0; j < level.ny; ++j) {
    for (std::size_t i = 0; i < level.nx; ++i) {
      const std::size_t c = j * level.nx + i;
      const Neighbours<Real> n = Around(level, i, j);
      const Lanes<Real>* p0 = p + n.column[0] * nz;
      const Lanes<Real>* p1 = p + n.column[1] * nz;
      const Lanes<Real>* p2 = p + n.column[2] * nz;
      const Lanes<Real>* p3 = p + n.column[3] * nz;
      const Lanes<Real>* pc = p + c * nz;
      Lanes<Real>* qc = q + c * nz;
      const Real* diagonal = level.diagonal + c * nz;
      const Real vertical = level.vertical[c];
      Vector part = {};
      Real coupling = 0;
      for (std::size_t k = 0; k < nz; ++k) {
        const std::size_t up = k == 0 ? 0 : k - 1;
        const std::size_t down = k + 1 < nz ? k + 1 : k;
        const Real next = vertical * level.inverse[k];
        Vector t = diagonal[k] * pc[k].v - coupling * pc[up].v - next * pc[down].v;
        t -= level.layer[k] * (n.weight[0] * p0[k].v + n.weight[1] * p1[k].v +
                               (n.weight[2] * p2[k].v + n.weight[3] * p3[k].v));
        qc[k].v = t;
        part += t * pc[k].v;
        coupling = next;
      }
      Collect<Real>(part, sums);
    }
  }
  return sums;
}

template <class Real>
[[gnu::always_inline]] inline LaneSums<Real> StepBody(const LevelView<Real>& level,
                                                      const Lanes<Real>& a,
                                                      const Lanes<Real>* p,
                                                      const Lanes<Real>* q,
                                                      Lanes<Real>* x,
                                                      Lanes<Real>* r) {
  LaneSums<Real> sums{};
  for (std::size_t c = 0; c < level.nx * level.ny; ++c) {
    typename Lanes<Real>::Vector part = {};
    for (std::size_t k = c * level.nz; k < (c + 1) * level.nz; ++k) {
      x[k].v += a.v * p[k].v;
      const typename Lanes<Real>::Vector left = r[k].v - a.v * q[k].v;
      r[k].v = left;
      part += left * left;
    }
    Collect<Real>(part, sums);
  }
  return sums;
}

template <class Real>
[[gnu::always_inline]] inline LaneSums<Real> DotBody(const LevelView<Real>& level,
                                                     const Lanes<Real>* a,
                                                     const Lanes<Real>* b) {
  LaneSums<Real> sums{};
  for (std::size_t c = 0; c < level.nx * level.ny; ++c) {
    typename Lanes<Real>::Vector part = {};
    for (std::size_t k = c * level.nz; k < (c + 1) * level.nz; ++k) {
      part += a[k].v * b[k].v;
    }
    Collect<Real>(part, sums);
  }
  return sums;
}

template <class Real>
[[gnu::always_inline]] inline void TurnBody(const LevelView<Real>& level,
                                            const Lanes<Real>& beta,
                                            const Lanes<Real>* z,
                                            Lanes<Real>* p) {
  const std::size_t count = level.nx * level.ny * level.nz;
  for (std::size_t k = 0; k < count; ++k) {
    p[k].v = z[k].v + beta.v * p[k].v;
  }
}

}  // namespace

#define NACRE_KERNEL(Return, Name, Parameters, Arguments) \
  NACRE_SIMD_CLONES Return Name##Clones Parameters {      \
    return Name##Body Arguments;                          \
  }                                                       \
  Return Name Parameters {                                \
    return Name##Clones Arguments;                        \
  }

#define NACRE_DIFFUSION_KERNELS(Real)                                                \
  NACRE_KERNEL(void,                                                                 \
               SolveColour,                                                          \
               (const LevelView<Real>& level,                                        \
                unsigned colour,                                                     \
                bool alone,                                                          \
                const Lanes<Real>* b,                                                \
                Lanes<Real>* x),                                                     \
               (level, colour, alone, b, x))                                         \
  NACRE_KERNEL(void,                                                                 \
               ResidualOfColourZero,                                                 \
               (const LevelView<Real>& level, const Lanes<Real>* x, Lanes<Real>* r), \
               (level, x, r))                                                        \
  NACRE_KERNEL(void,                                                                 \
               Restrict,                                                             \
               (const LevelView<Real>& fine,                                         \
                const LevelView<Real>& coarse,                                       \
                const Lanes<Real>* r,                                                \
                Lanes<Real>* coarse_b),                                              \
               (fine, coarse, r, coarse_b))                                          \
  NACRE_KERNEL(void,                                                                 \
               Prolong,                                                              \
               (const LevelView<Real>& fine,                                         \
                const LevelView<Real>& coarse,                                       \
                const Lanes<Real>* coarse_x,                                         \
                Lanes<Real>* x),                                                     \
               (fine, coarse, coarse_x, x))                                          \
  NACRE_KERNEL(LaneSums<Real>,                                                       \
               Apply,                                                                \
               (const LevelView<Real>& level, const Lanes<Real>* p, Lanes<Real>* q), \
               (level, p, q))                                                        \
  NACRE_KERNEL(LaneSums<Real>,                                                       \
               Step,                                                                 \
               (const LevelView<Real>& level,                                        \
                const Lanes<Real>& a,                                                \
                const Lanes<Real>* p,                                                \
                const Lanes<Real>* q,                                                \
                Lanes<Real>* x,                                                      \
                Lanes<Real>* r),                                                     \
               (level, a, p, q, x, r))                                               \
  NACRE_KERNEL(                                                                      \
      LaneSums<Real>,                                                                \
      Dot,                                                                           \
      (const LevelView<Real>& level, const Lanes<Real>* a, const Lanes<Real>* b),    \
      (level, a, b))                                                                 \
  NACRE_KERNEL(void,                                                                 \
               Turn,                                                                 \
               (const LevelView<Real>& level,                                        \
                const Lanes<Real>& beta,                                             \
                const Lanes<Real>* z,                                                \
                Lanes<Real>* p),                                                     \
               (level, beta, z, p))

NACRE_DIFFUSION_KERNELS(float)
NACRE_DIFFUSION_KERNELS(double)
#undef NACRE_DIFFUSION_KERNELS
#undef NACRE_KERNEL

}  // namespace nacre::rigs::diffusion::internal
