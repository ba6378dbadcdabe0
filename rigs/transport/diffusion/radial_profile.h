#pragma once

#include <functional>
#include <vector>

namespace nacre::rigs::diffusion {

/// A positive function of distance, tabulated: cubic in log r and log value, to about
/// 1e-6 for what falls no faster than a diffusion profile. Below the first node it goes
/// on as a power, beyond the last as an exponential.
class RadialProfile {
 public:
  RadialProfile(const std::function<double(double r_mm)>& value,
                double first_mm,
                double last_mm,
                int thread_count);

  double Value(double r_mm) const;

  /// Mean over a square cell with centre (x, y), by quadrature; the profile may have an
  /// integrable singularity at the origin, if that is a cell's centre.
  double CellMean(double x_mm, double y_mm, double width_mm) const;

  /// The distance beyond which ∫ value 2πr dr < loss.
  double Reach(double loss) const;

 private:
  double NodeMm(std::size_t node) const;
  double first_log_ = 0;
  double log_step_ = 1;
  std::vector<double> logs_;
};

}  // namespace nacre::rigs::diffusion
