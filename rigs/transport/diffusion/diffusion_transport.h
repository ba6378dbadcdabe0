#pragma once

#include "core/progress.h"
#include "rigs/transport/diffusion/diffusion_options.h"
#include "rigs/transport/transport.h"

#include <cstddef>
#include <functional>
#include <memory>
#include <span>

namespace nacre::rigs {

/// R_d(r) of a homogeneous slab of one of the phantom's media, for a pencil: mm⁻².
using ReferenceProfile =
    std::function<double(std::size_t medium, std::size_t channel, double r_mm)>;

/// The heterogeneous diffusion equation −∇·(D∇φ) + σ_a φ = q on a mesh around each x_i,
/// finite volumes, Robin boundaries, a source all along the beam; see README.md.
///
/// What diffusion and the mesh get wrong near the beam is corrected: each value is
/// multiplied by reference / discrete of a homogeneous slab at the same offset, solved
/// once on the same mesh (of two media: their geometric mean by the segment's share of
/// each). The reference is Monte Carlo of each medium, simulated by the constructor
/// (options.reference_photons; some seconds), which makes homogeneous regions exact
/// transport; or diffusion's own exact solution, RobinSlab; or what the caller gives.
class DiffusionTransport final : public Transport {
 public:
  /// Throws BadData for what diffusion can't do (layers, media that change with depth,
  /// an oblique beam, an empty medium), and for a medium without absorption in an
  /// infinitely thick slab unless the reference is something else than Monte Carlo.
  explicit DiffusionTransport(const Phantom& phantom,
                              const DiffusionOptions& options = {},
                              const ReferenceProfile& reference = {});
  ~DiffusionTransport() override;

  const Phantom& phantom() const override;
  Window WindowAround(PointMm x_i) const override;
  /// Solves anew for every call; meant for single pictures.
  void AddExitance(PointMm x_i,
                   std::size_t channel,
                   double flux,
                   const PointColumns& points,
                   float* exitance) const override;
  double ReachMm(std::size_t channel) const override;
  /// Of pure diffusion: the reference has no part in them.
  Totals TotalsAt(PointMm x_i, std::size_t channel) const override;

  /// What truncation costs at x_i: the part of the light that leaves through the sides
  /// of the mesh instead of the slab's faces; TotalsAt counts it as absorbed.
  double TruncatedAt(PointMm x_i, std::size_t channel) const;

  /// The windows of many x_i, 16 of a neighbourhood at once. `use(k, window)` is called
  /// for every k, one call at a time, in no particular order. Points of the phantom's
  /// grid share meshes; others are solved one by one. Memory: MemoryBytes() for each
  /// thread. Results don't depend on the thread count.
  void SolveWindows(std::span<const PointMm> points,
                    const std::function<void(std::size_t k, Window&& window)>& use,
                    const ProgressFunction& progress = {}) const override;

  /// Of one neighbourhood's solver.
  std::size_t MemoryBytes() const;

 private:
  struct Channel;
  struct Impl;
  std::unique_ptr<const Impl> impl_;
};

}  // namespace nacre::rigs
