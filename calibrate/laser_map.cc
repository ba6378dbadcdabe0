#include "calibrate/laser_map.h"

#include "core/error.h"

#include <opencv2/core.hpp>

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

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
  for (const auto& point : points) {
    values.push_back(get(point));
  }
  return values;
}

// An affine map of the nominal positions onto observed ones, refined in a few rounds.
struct Affine {
  double a = 1, b = 0, c = 0, d = 1, x = 0, y = 0;
  PointMm operator()(PointMm p) const {
    return {a * p.x + b * p.y + x, c * p.x + d * p.y + y};
  }
};

Affine FitAffine(const std::vector<PointMm>& from, const std::vector<PointMm>& to) {
  cv::Mat_<double> design(static_cast<int>(from.size()), 3);
  cv::Mat_<double> right(design.rows, 2);
  for (int row = 0; row < design.rows; ++row) {
    const auto k = static_cast<std::size_t>(row);
    design(row, 0) = from[k].x;
    design(row, 1) = from[k].y;
    design(row, 2) = 1;
    right(row, 0) = to[k].x;
    right(row, 1) = to[k].y;
  }
  cv::Mat_<double> s;
  cv::solve(design, right, s, cv::DECOMP_SVD);
  return {s(0, 0), s(1, 0), s(0, 1), s(1, 1), s(2, 0), s(2, 1)};
}

// Mean and root mean square spread along each axis, to begin the affine map with.
Affine FromSpread(const std::vector<PointMm>& from, const std::vector<PointMm>& to) {
  const auto moments = [](const std::vector<PointMm>& points, auto get) {
    double mean = 0;
    double square = 0;
    for (const PointMm& p : points) {
      mean += get(p);
      square += get(p) * get(p);
    }
    const auto n = static_cast<double>(points.size());
    mean /= n;
    return std::pair(mean, std::sqrt(std::max(square / n - mean * mean, 1e-30)));
  };
  const auto get_x = [](const PointMm& p) { return p.x; };
  const auto get_y = [](const PointMm& p) { return p.y; };
  const auto [from_x, from_width] = moments(from, get_x);
  const auto [from_y, from_height] = moments(from, get_y);
  const auto [to_x, to_width] = moments(to, get_x);
  const auto [to_y, to_height] = moments(to, get_y);
  Affine affine;
  affine.a = to_width / from_width;
  affine.d = to_height / from_height;
  affine.x = to_x - affine.a * from_x;
  affine.y = to_y - affine.d * from_y;
  return affine;
}

// The observed point that belongs to each nominal one; empty unless one to one.
std::vector<PointMm> MatchLattice(const std::vector<PointMm>& nominal,
                                  const std::vector<PointMm>& observed) {
  Affine affine = FromSpread(nominal, observed);
  constexpr int kRounds = 5;
  for (int round = 0;; ++round) {
    std::vector<PointMm> matched;
    std::vector<int> uses(observed.size(), 0);
    for (const PointMm& point : nominal) {
      const PointMm predicted = affine(point);
      const auto distance = [&](const PointMm& p) {
        return std::hypot(p.x - predicted.x, p.y - predicted.y);
      };
      const auto nearest = std::min_element(
          observed.begin(), observed.end(), [&](const PointMm& p, const PointMm& q) {
            return distance(p) < distance(q);
          });
      ++uses[static_cast<std::size_t>(nearest - observed.begin())];
      matched.push_back(*nearest);
    }
    const bool one_to_one =
        std::all_of(uses.begin(), uses.end(), [](int n) { return n == 1; });
    if (round == kRounds) {
      return one_to_one ? matched : std::vector<PointMm>();
    }
    affine = FitAffine(nominal, matched);
  }
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

LaserMapResult EstimateLaserMap(const acquire::SessionReader& session,
                                const CameraGeometry& camera,
                                const DarkLevel& dark) {
  const acquire::Schedule& schedule = session.schedule();
  const std::vector<ScanAngle>& lattice = schedule.lattice();
  std::vector<PointMm> nominal;
  for (const ScanAngle& angle : lattice) {
    nominal.push_back({angle.x_rad * session.rig().scanner.mm_per_rad,
                       angle.y_rad * session.rig().scanner.mm_per_rad});
  }
  std::vector<ScanAngle> angles;
  std::vector<PointMm> points;
  for (std::int64_t number = 0; number < schedule.grid_begin(); ++number) {
    if (schedule[number].target != acquire::Target::kReference) {
      continue;
    }
    const acquire::Frame frame = session.ReadFrame(number);
    const double dark_counts = dark.Counts(frame.exposure_us);
    std::vector<float> signal;
    signal.reserve(frame.counts.size());
    for (const std::uint16_t count : frame.counts) {
      signal.push_back(static_cast<float>(count - dark_counts));
    }
    const std::vector<PixelPoint> spots_px =
        FindSpots(signal, frame.width, frame.height, static_cast<int>(lattice.size()));
    std::vector<PointMm> observed;
    for (const PixelPoint& spot : spots_px) {
      observed.push_back(camera.SampleFromPixel(spot));
    }
    const std::vector<PointMm> matched =
        observed.empty() ? observed : MatchLattice(nominal, observed);
    if (matched.empty()) {
      throw BadData(fmt::format(
          "{}: the {} x {} laser spots on the reference target can't be {} in channel "
          "{}; see that all are in view and bright (targets.reference_exposure_us), "
          "and "
          "that scanner.mm_per_rad is right",
          (session.folder() / session.Entry(number).file).string(),
          session.rig().targets.laser_lattice,
          session.rig().targets.laser_lattice,
          observed.empty() ? "made out" : "told apart",
          session.rig()
              .scanner.channels[static_cast<std::size_t>(schedule[number].channel)]));
    }
    angles.insert(angles.end(), lattice.begin(), lattice.end());
    points.insert(points.end(), matched.begin(), matched.end());
  }
  return FitScanMap(angles, points);
}

}  // namespace nacre::calibrate
