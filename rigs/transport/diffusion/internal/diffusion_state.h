#pragma once

#include "rigs/transport/diffusion/beam_footprint.h"
#include "rigs/transport/diffusion/diffusion_transport.h"
#include "rigs/transport/diffusion/local_domain.h"
#include "rigs/transport/diffusion/near_field.h"
#include "rigs/transport/diffusion/neighbourhoods.h"
#include "rigs/transport/diffusion/radial_profile.h"

#include <cstddef>
#include <functional>
#include <memory>
#include <vector>

namespace nacre::rigs {

// What a DiffusionTransport holds, for the two files that implement it.

struct DiffusionTransport::Channel {
  diffusion::ChannelSetup setup;
  int refine = 1;  // columns across a cell of the grid, odd
  double step_mm = 1;
  std::vector<diffusion::BeamPoint> beam;
  std::vector<diffusion::RadialProfile> profiles;
  std::unique_ptr<diffusion::NearField> near_field;
  double reach_mm = 0;
};

struct DiffusionTransport::Impl {
  Phantom phantom;
  DiffusionOptions options;
  double pitch_mm = 1;  // of the grid, or of columns if there is none
  int core = 1;
  std::vector<Channel> channels;

  /// See LocalDomain::FromDepth().
  double FromDepth() const {
    return options.reciprocal_exit ? 1 : diffusion::ExitFromDepth(phantom.slab.eta);
  }
  Channel MakeChannel(std::size_t c, const ReferenceProfile& reference) const;

  // A mesh for the beams of one neighbourhood, and what it is filled with.
  struct Scene {
    diffusion::Mesh mesh;
    diffusion::PatternFractions fractions;
    int margin = 0;
    int nx = 0;
  };
  Scene MakeScene(const Channel& channel, const diffusion::Neighbourhood& place) const;
  template <class Real>
  void AddBeam(const Channel& channel,
               const Scene& scene,
               const diffusion::Neighbourhood& place,
               PointMm x_i,
               std::size_t lane,
               diffusion::LocalDomain<Real>& domain) const;
  void ReadWindow(const Channel& channel,
                  const Scene& scene,
                  const diffusion::Neighbourhood& place,
                  PointMm x_i,
                  const std::function<double(std::size_t column)>& exitance,
                  float* rd) const;
  diffusion::LocalDomain<float>::Budget BudgetAt(PointMm x_i,
                                                 std::size_t channel) const;
  std::size_t CentreColumn(const Channel& channel,
                           const Scene& scene,
                           const diffusion::Neighbourhood& place,
                           PointMm x_i) const;
  std::vector<double> LogRatio(const Channel& channel,
                               const Scene& scene,
                               const diffusion::Neighbourhood& place,
                               PointMm x_i) const;
  std::vector<Window> Solve(const diffusion::Neighbourhood& place) const;
};

}  // namespace nacre::rigs
