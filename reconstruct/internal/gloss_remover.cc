#include "reconstruct/internal/gloss.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

namespace nacre::reconstruct::internal {

double Gloss::Density(double r2_mm2) const {
  const auto after = std::upper_bound(square_mm2.begin(), square_mm2.end(), r2_mm2);
  if (after == square_mm2.end() || square_mm2.size() < 2) {
    return 0;
  }
  const auto next =
      static_cast<std::size_t>(std::max<std::ptrdiff_t>(1, after - square_mm2.begin()));
  const double part =
      (r2_mm2 - square_mm2[next - 1]) / (square_mm2[next] - square_mm2[next - 1]);
  return std::exp(std::lerp(log_density[next - 1], log_density[next], part));
}

GlossRemover::GlossRemover(const Gloss& gloss,
                           const calibrate::Calibration& calibration,
                           const calibrate::SamplePlane& plane,
                           const RdHeader& header,
                           const GroupReader& reader)
    : gloss_(gloss),
      calibration_(calibration),
      plane_(plane),
      header_(header),
      reader_(reader) {}

std::array<double, GlossRemover::kSide * GlossRemover::kSide> GlossRemover::Response(
    int i, int j) const {
  const calibrate::CameraGeometry& camera = reader_.camera();
  const CellWeights& weights = reader_.weights();
  const auto width = static_cast<std::size_t>(camera.width_px);
  // A picture with nothing but the spot; kept, so that only it needs to be cleared.
  thread_local RateFrame frame;
  frame.rate.resize(width * static_cast<std::size_t>(camera.height_px), 0.0F);
  frame.variance.resize(frame.rate.size(), 0.0F);
  const PointMm spot =
      calibrate::OnSurface(calibration_, plane_, header_.GridPoint(i, j));
  const calibrate::PixelPoint centre = camera.PixelFromSample(spot);
  constexpr int kReachPx = 7;
  const int x0 = static_cast<int>(std::lround(centre.x));
  const int y0 = static_cast<int>(std::lround(centre.y));
  const auto for_each = [&](auto&& visit) {
    for (int y = std::max(0, y0 - kReachPx);
         y <= std::min(camera.height_px - 1, y0 + kReachPx);
         ++y) {
      for (int x = std::max(0, x0 - kReachPx);
           x <= std::min(camera.width_px - 1, x0 + kReachPx);
           ++x) {
        visit(x, y, static_cast<std::size_t>(y) * width + static_cast<std::size_t>(x));
      }
    }
  };
  for_each([&](int x, int y, std::size_t at) {
    const PointMm p =
        camera.SampleFromPixel({static_cast<double>(x), static_cast<double>(y)});
    const double dx = p.x - spot.x;
    const double dy = p.y - spot.y;
    frame.rate[at] = static_cast<float>(gloss_.Density(dx * dx + dy * dy));
  });
  std::array<double, kSide * kSide> response{};
  double sum = 0;
  for (int v = -kReach; v <= kReach; ++v) {
    for (int u = -kReach; u <= kReach; ++u) {
      const int column = i + header_.Radius() + u;
      const int row = j + header_.Radius() + v;
      const CellLattice& lattice = weights.lattice();
      if (column < 0 || row < 0 || column >= lattice.columns || row >= lattice.rows) {
        continue;
      }
      double& mean = response[static_cast<std::size_t>(
          std::int64_t{v + kReach} * kSide + u + kReach)];
      mean = weights.Mean(frame, lattice.Index(column, row)).mean;
      sum += mean * header_.CellAreaMm2();
    }
  }
  for_each([&](int, int, std::size_t at) { frame.rate[at] = 0; });
  for (double& mean : response) {
    mean = sum > 0 ? mean / sum : 0;
  }
  return response;
}

void GlossRemover::Remove(std::int64_t s, RdSlice& slice) const {
  if (gloss_.reflectance.empty()) {
    return;
  }
  const int i = static_cast<int>(s % header_.points_x);
  const int j = static_cast<int>(s / header_.points_x);
  const PointMm x_i = header_.GridPoint(i, j);
  // Where none was found what it may be concerns the lit cell alone.
  std::array<double, kSide * kSide> response{};
  response[response.size() / 2] = 1 / header_.CellAreaMm2();
  const bool is_found = gloss_.IsFound();
  if (is_found) {
    response = Response(i, j);
  }
  const int radius = header_.Radius();
  for (std::size_t c = 0; c < gloss_.reflectance.size(); ++c) {
    const double rd_per_light =
        calibration_.RdPerRate(static_cast<int>(c), x_i, x_i, header_.eta) *
        calibration_.channels[c].flux_scale_counts_mm2_sr_per_us / std::numbers::pi;
    for (int v = -kReach; v <= kReach; ++v) {
      for (int u = -kReach; u <= kReach; ++u) {
        if (std::max(std::abs(u), std::abs(v)) > radius) {
          continue;
        }
        const auto at = static_cast<std::size_t>(
            static_cast<std::int64_t>(c) * header_.WindowSize() +
            (radius + v) * header_.core + radius + u);
        if (slice.valid[at] == 0) {
          continue;
        }
        const double share =
            rd_per_light * response[static_cast<std::size_t>(
                               std::int64_t{v + kReach} * kSide + u + kReach)];
        slice.rd[at] -=
            is_found ? static_cast<float>(gloss_.reflectance[c] * share) : 0.0F;
        slice.sigma[at] =
            std::hypot(slice.sigma[at], static_cast<float>(gloss_.sigma[c] * share));
      }
    }
  }
}

}  // namespace nacre::reconstruct::internal
