#pragma once

#include "rigs/plane_map.h"
#include "rigs/transport/transport.h"
#include "rigs/world.h"

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

namespace nacre::rigs {

/// What a camera sees of laser spots: mean radiance over each pixel's footprint on the
/// sample plane, mW mm⁻² sr⁻¹ for a flux in mW, row by row from the top.
class LaserView {
 public:
  /// `sample` must be for a Gaussian beam of that spot size.
  LaserView(const PinholeCamera& camera,
            std::shared_ptr<const Transport> sample,
            double spot_sigma_mm,
            int thread_count = 0);

  /// On the sample: flux Φ arriving at angle θ_i enters as Φ F_t(η, θ_i), leaves with
  /// exitance M, and is seen as L = M F_t(η, θ_o) / (π c(η)).
  std::vector<float> OnSample(std::span<const Spot> spots,
                              double flux_mw,
                              std::size_t channel) const;

  /// The same into a picture that is there already, whatever it holds.
  void OnSample(std::span<const Spot> spots,
                double flux_mw,
                std::size_t channel,
                std::vector<float>& radiance) const;

  /// On a diffuse reflector of reflectance ρ: L = ρ E / π.
  std::vector<float> OnReference(std::span<const Spot> spots,
                                 double flux_mw,
                                 double reflectance) const;

  const PlaneMap& map() const { return map_; }

 private:
  struct Columns {
    int begin = 0;
    int end = 0;  // one past the last; none if not above begin
  };
  Columns Within(int row, PointMm centre, double radius_mm) const;
  void AddReferenceSpot(PointMm centre,
                        double power,
                        int row,
                        float* density_per_mm2) const;

  PlaneMap map_;
  std::shared_ptr<const Transport> sample_;
  double spot_sigma_mm_;
  double pixel_mm_;
  int thread_count_;
  std::vector<float> row_lowest_y_;
  std::vector<float> row_highest_y_;
  std::vector<float> radiance_factor_;  // of unit exitance, towards the camera, sr⁻¹
};

}  // namespace nacre::rigs
