#include "calibrate/internal/one_thread_algebra.h"
#include "calibrate/laser_map.h"
#include "core/error.h"

#include <opencv2/core.hpp>

#include <algorithm>
#include <cmath>

namespace nacre::calibrate {
namespace {

using acquire::ScanAngle;

// Least squares of the cubic's coefficients for one output.
acquire::Cubic FitCubic(const std::vector<PointMm>& inputs,
                        const std::vector<double>& outputs) {
  constexpr int kTerms = static_cast<int>(acquire::Cubic{}.size());
  cv::Mat_<double> design(static_cast<int>(inputs.size()), kTerms);
  cv::Mat_<double> right(static_cast<int>(inputs.size()), 1);
  for (int row = 0; row < design.rows; ++row) {
    const auto k = static_cast<std::size_t>(row);
    const acquire::Cubic monomials = acquire::CubicMonomials(inputs[k].x, inputs[k].y);
    std::copy(monomials.begin(), monomials.end(), design[row]);
    right(row, 0) = outputs[k];
  }
  const internal::OneThreadAlgebra one_thread;
  cv::Mat_<double> solution;
  if (!cv::solve(design, right, solution, cv::DECOMP_SVD)) {
    throw BadData("the laser's spots don't determine a cubic map");
  }
  acquire::Cubic coefficients{};
  std::copy_n(solution.begin(), coefficients.size(), coefficients.begin());
  return coefficients;
}

template <class Points, class Get>
std::vector<double> Collect(const Points& points, Get get) {
  std::vector<double> values;
  values.reserve(points.size());
  for (const auto& point : points) {
    values.push_back(get(point));
  }
  return values;
}

}  // namespace

LaserMapResult FitScanMap(const std::vector<ScanAngle>& angles,
                          const std::vector<PointMm>& points) {
  Expect(angles.size() == points.size() && angles.size() >= 10, "pairs for ten terms");
  LaserMapResult result;
  acquire::ScanMap& map = result.map;
  map.half_width_mm = 0;
  map.half_width_rad = 0;
  for (std::size_t k = 0; k < angles.size(); ++k) {
    map.half_width_rad = std::max(
        {map.half_width_rad, std::abs(angles[k].x_rad), std::abs(angles[k].y_rad)});
    map.half_width_mm =
        std::max({map.half_width_mm, std::abs(points[k].x), std::abs(points[k].y)});
  }
  std::vector<PointMm> unit_points;
  std::vector<PointMm> unit_angles;
  for (std::size_t k = 0; k < angles.size(); ++k) {
    unit_points.push_back(
        {points[k].x / map.half_width_mm, points[k].y / map.half_width_mm});
    unit_angles.push_back(
        {angles[k].x_rad / map.half_width_rad, angles[k].y_rad / map.half_width_rad});
  }
  const auto x_rad = [](const ScanAngle& a) { return a.x_rad; };
  const auto y_rad = [](const ScanAngle& a) { return a.y_rad; };
  const auto x_mm = [](const PointMm& p) { return p.x; };
  const auto y_mm = [](const PointMm& p) { return p.y; };
  map.x_rad = FitCubic(unit_points, Collect(angles, x_rad));
  map.y_rad = FitCubic(unit_points, Collect(angles, y_rad));
  map.x_mm = FitCubic(unit_angles, Collect(points, x_mm));
  map.y_mm = FitCubic(unit_angles, Collect(points, y_mm));
  double square_sum = 0;
  for (std::size_t k = 0; k < angles.size(); ++k) {
    const PointMm mapped = map.SampleFromAngle(angles[k]);
    const double error = std::hypot(mapped.x - points[k].x, mapped.y - points[k].y);
    square_sum += error * error;
    result.max_mm = std::max(result.max_mm, error);
  }
  result.rms_mm = std::sqrt(square_sum / static_cast<double>(angles.size()));
  return result;
}

double HeldOutRmsMm(const std::vector<ScanAngle>& angles,
                    const std::vector<PointMm>& points) {
  constexpr std::size_t kFolds = 5;
  double square_sum = 0;
  for (std::size_t fold = 0; fold < kFolds; ++fold) {
    std::vector<ScanAngle> kept_angles;
    std::vector<PointMm> kept_points;
    for (std::size_t k = 0; k < angles.size(); ++k) {
      if (k % kFolds != fold) {
        kept_angles.push_back(angles[k]);
        kept_points.push_back(points[k]);
      }
    }
    const acquire::ScanMap map = FitScanMap(kept_angles, kept_points).map;
    for (std::size_t k = fold; k < angles.size(); k += kFolds) {
      const PointMm mapped = map.SampleFromAngle(angles[k]);
      const double dx = mapped.x - points[k].x;
      const double dy = mapped.y - points[k].y;
      square_sum += dx * dx + dy * dy;
    }
  }
  return std::sqrt(square_sum / static_cast<double>(angles.size()));
}

}  // namespace nacre::calibrate
