#include "calibrate/laser_map.h"

#include "calibrate/hysteresis.h"
#include "calibrate/internal/one_thread_algebra.h"
#include "calibrate/internal/pictures.h"
#include "core/error.h"

#include <opencv2/core.hpp>

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <optional>

namespace nacre::calibrate {
namespace {

using acquire::ScanAngle;
using Matches = std::vector<std::optional<PointMm>>;

// So much of the lattice may be missed.
constexpr double kMayBeMissed = 0.1;

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
  const internal::OneThreadAlgebra one_thread;
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

double Spacing(const std::vector<PointMm>& points) {
  double closest = HUGE_VAL;
  for (std::size_t a = 1; a < points.size(); ++a) {
    closest = std::min(
        closest, std::hypot(points[a].x - points[0].x, points[a].y - points[0].y));
  }
  return closest;
}

// The observed point that belongs to each nominal one, none where there is none within
// a third of the spacing. Empty if too few are found, or two belong to the same.
Matches MatchLattice(const std::vector<PointMm>& nominal,
                     const std::vector<PointMm>& observed) {
  Affine affine = FromSpread(nominal, observed);
  const double spacing = Spacing(nominal);
  constexpr int kRounds = 8;
  for (int round = 0;; ++round) {
    // Wide at first, since the map is rough then.
    const double reach = (round < kRounds / 2 ? 0.7 : 0.33) * spacing;
    std::vector<PointMm> from;
    std::vector<PointMm> to;
    std::vector<int> uses(observed.size(), 0);
    Matches matches;
    for (const PointMm& point : nominal) {
      const PointMm predicted = affine(point);
      const auto distance = [&](const PointMm& p) {
        return std::hypot(p.x - predicted.x, p.y - predicted.y);
      };
      const auto nearest = std::min_element(
          observed.begin(), observed.end(), [&](const PointMm& p, const PointMm& q) {
            return distance(p) < distance(q);
          });
      if (distance(*nearest) > reach * std::hypot(affine.a, affine.b)) {
        matches.push_back(std::nullopt);
        continue;
      }
      ++uses[static_cast<std::size_t>(nearest - observed.begin())];
      matches.push_back(*nearest);
      from.push_back(point);
      to.push_back(*nearest);
    }
    const bool is_unique =
        std::all_of(uses.begin(), uses.end(), [](int n) { return n <= 1; });
    const auto missed = static_cast<double>(nominal.size() - from.size());
    const double most = kMayBeMissed * static_cast<double>(nominal.size());
    if (round == kRounds || from.size() < 10) {
      return is_unique && missed <= most ? matches : Matches();
    }
    affine = FitAffine(from, to);
  }
}

// Means over pictures of where each spot of the lattice is.
struct SpotMeans {
  std::vector<PointMm> sum;
  std::vector<int> count;

  explicit SpotMeans(std::size_t spots) : sum(spots), count(spots, 0) {}
  void Add(const Matches& matches) {
    for (std::size_t k = 0; k < matches.size(); ++k) {
      if (matches[k]) {
        sum[k] = {sum[k].x + matches[k]->x, sum[k].y + matches[k]->y};
        ++count[k];
      }
    }
  }
  std::optional<PointMm> At(std::size_t k) const {
    return count[k] > 0
               ? std::optional<PointMm>({sum[k].x / count[k], sum[k].y / count[k]})
               : std::nullopt;
  }
};

struct MeanAndSigma {
  double mean = 0;
  double sigma = 0;
};

MeanAndSigma MeanOf(const std::vector<double>& values) {
  const auto n = static_cast<double>(values.size());
  MeanAndSigma result;
  for (const double v : values) {
    result.mean += v / n;
  }
  for (const double v : values) {
    result.sigma += (v - result.mean) * (v - result.mean);
  }
  result.sigma = std::sqrt(result.sigma / (n * std::max(1.0, n - 1)));
  return result;
}

// The lattice seen from both ways round.
struct BothWays {
  const std::vector<ScanAngle>& lattice;
  MirrorSides there_sides;
  MirrorSides back_sides;
  SpotMeans there;
  SpotMeans back;

  explicit BothWays(const std::vector<ScanAngle>& beams)
      : lattice(beams),
        there_sides(SidesOf(beams)),
        back_sides(SidesOf({beams.rbegin(), beams.rend()})),
        there(beams.size()),
        back(beams.size()) {
    std::reverse(back_sides.x.begin(), back_sides.x.end());
    std::reverse(back_sides.y.begin(), back_sides.y.end());
  }

  // Half of what lies between the two ways, of spots whose mirrors come from different
  // sides; angles by the map's slopes along each axis, as it turns little.
  ScanHysteresis Lag(const acquire::ScanMap& map) const {
    constexpr double kStepRad = 1e-3;
    std::vector<double> x_lag;
    std::vector<double> y_lag;
    for (std::size_t k = 0; k < lattice.size(); ++k) {
      const auto a = there.At(k);
      const auto b = back.At(k);
      if (!a || !b) {
        continue;
      }
      const ScanAngle angle = lattice[k];
      const PointMm here = map.SampleFromAngle(angle);
      const PointMm right = map.SampleFromAngle({angle.x_rad + kStepRad, angle.y_rad});
      const PointMm up = map.SampleFromAngle({angle.x_rad, angle.y_rad + kStepRad});
      const double turn_x = there_sides.x[k] - back_sides.x[k];
      const double turn_y = there_sides.y[k] - back_sides.y[k];
      if (turn_x != 0) {
        x_lag.push_back(-(a->x - b->x) * kStepRad / ((right.x - here.x) * turn_x));
      }
      if (turn_y != 0) {
        y_lag.push_back(-(a->y - b->y) * kStepRad / ((up.y - here.y) * turn_y));
      }
    }
    constexpr std::size_t kFewest = 10;
    if (x_lag.size() < kFewest || y_lag.size() < kFewest) {
      return {};
    }
    const MeanAndSigma x = MeanOf(x_lag);
    const MeanAndSigma y = MeanOf(y_lag);
    return {.x_rad = x.mean, .y_rad = y.mean, .sigma_rad = std::max(x.sigma, y.sigma)};
  }

  // Where mirrors without that lag would point: midway, but for spots that both ways
  // come to from one side.
  SpotMeans Middle(const ScanHysteresis& lag, const acquire::ScanMap& map) const {
    Matches middles(lattice.size());
    for (std::size_t k = 0; k < lattice.size(); ++k) {
      const auto a = there.At(k);
      const auto b = back.At(k);
      if (!a || !b) {
        continue;
      }
      const double x_rad = 0.5 * lag.x_rad * (there_sides.x[k] + back_sides.x[k]);
      const double y_rad = 0.5 * lag.y_rad * (there_sides.y[k] + back_sides.y[k]);
      const PointMm here = map.SampleFromAngle(lattice[k]);
      const PointMm free =
          map.SampleFromAngle({lattice[k].x_rad + x_rad, lattice[k].y_rad + y_rad});
      middles[k] = {0.5 * (a->x + b->x) + free.x - here.x,
                    0.5 * (a->y + b->y) + free.y - here.y};
    }
    SpotMeans middle(lattice.size());
    middle.Add(middles);
    return middle;
  }
};

Matches FindLattice(const acquire::SessionReader& session,
                    const CameraGeometry& camera,
                    const RatePictures& pictures,
                    std::int64_t number,
                    const std::vector<PointMm>& nominal) {
  const acquire::Frame frame = session.ReadFrame(number);
  const int count = static_cast<int>(nominal.size());
  const std::vector<PixelPoint> spots_px =
      FindSpots(pictures.Rates(frame, session.schedule()[number].channel),
                frame.width,
                frame.height,
                count,
                static_cast<int>(kMayBeMissed * count));
  std::vector<PointMm> observed;
  observed.reserve(spots_px.size());
  for (const PixelPoint& spot : spots_px) {
    observed.push_back(camera.SampleFromPixel(spot));
  }
  Matches matches = observed.empty() ? Matches() : MatchLattice(nominal, observed);
  if (matches.empty()) {
    throw BadData(fmt::format(
        "{}: the {} x {} laser spots on the reference target can't be {} in channel "
        "{}; see that all are in view and bright (targets.reference_exposure_us), and "
        "that scanner.mm_per_rad is right{}",
        (session.folder() / session.Entry(number).file).string(),
        session.rig().targets.laser_lattice,
        session.rig().targets.laser_lattice,
        observed.empty() ? "made out" : "told apart",
        session.rig().scanner.channels[static_cast<std::size_t>(
            session.schedule()[number].channel)],
        session.manifest().camera.mosaic.empty()
            ? ""
            : "; between the pixels of one colour a sharp spot is lost: it must be two "
              "pixels wide, by itself or by a little defocus"));
  }
  return matches;
}

// Fits, leaves out what lies far off, fits again.
LaserMapResult FitRobustly(const std::vector<ScanAngle>& lattice,
                           const SpotMeans& means) {
  std::vector<ScanAngle> angles;
  std::vector<PointMm> points;
  for (std::size_t k = 0; k < lattice.size(); ++k) {
    if (const auto point = means.At(k)) {
      angles.push_back(lattice[k]);
      points.push_back(*point);
    }
  }
  LaserMapResult result = FitScanMap(angles, points);
  constexpr double kFarOff = 6;
  for (std::size_t k = angles.size(); k-- > 0;) {
    const PointMm mapped = result.map.SampleFromAngle(angles[k]);
    if (std::hypot(mapped.x - points[k].x, mapped.y - points[k].y) >
        kFarOff * result.rms_mm) {
      angles.erase(angles.begin() + static_cast<std::ptrdiff_t>(k));
      points.erase(points.begin() + static_cast<std::ptrdiff_t>(k));
    }
  }
  result = FitScanMap(angles, points);
  result.held_out_rms_mm = HeldOutRmsMm(angles, points);
  result.missed = static_cast<int>(lattice.size() - angles.size());
  for (std::size_t k = 0; k < angles.size(); ++k) {
    const PointMm mapped = result.map.SampleFromAngle(angles[k]);
    result.residuals.push_back(
        {points[k], {points[k].x - mapped.x, points[k].y - mapped.y}});
  }
  return result;
}

}  // namespace

LaserMapResult EstimateLaserMap(const acquire::SessionReader& session,
                                const CameraGeometry& camera,
                                const RatePictures& pictures) {
  const std::vector<ScanAngle>& lattice = session.schedule().lattice();
  std::vector<PointMm> nominal;
  nominal.reserve(lattice.size());
  for (const ScanAngle& angle : lattice) {
    nominal.push_back({angle.x_rad * session.rig().scanner.mm_per_rad,
                       angle.y_rad * session.rig().scanner.mm_per_rad});
  }
  const bool reversed = session.rig().targets.reverse_lattice &&
                        session.rig().targets.reference_frames >= 2;
  BothWays ways(lattice);
  for (const std::int64_t number :
       internal::PicturesOf(session, acquire::Target::kReference)) {
    const Matches matches = FindLattice(session, camera, pictures, number, nominal);
    const bool is_back = reversed && session.schedule()[number].repeat % 2 == 1;
    (is_back ? ways.back : ways.there).Add(matches);
  }
  LaserMapResult result = FitRobustly(lattice, ways.there);
  if (reversed) {
    const ScanHysteresis lag = ways.Lag(result.map);
    result = FitRobustly(lattice, ways.Middle(lag, result.map));
    result.hysteresis = lag;
  }
  return result;
}

}  // namespace nacre::calibrate
