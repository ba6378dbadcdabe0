#include "rigs/laser_view.h"

#include "core/error.h"
#include "core/fresnel.h"
#include "core/parallel.h"
#include "rigs/laser_tiles.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace nacre::rigs {
namespace {

constexpr std::int64_t kRowsPerTask = 8;

std::vector<float> RadianceFactors(const PinholeCamera& camera,
                                   const PlaneMap& map,
                                   double eta) {
  const Vector3 eye = camera.Position();
  const double per_exitance = 1 / (std::numbers::pi * ExitNormalization(eta));
  std::vector<float> factors(map.x.size());
  for (std::size_t k = 0; k < factors.size(); ++k) {
    const double dx = eye[0] - static_cast<double>(map.x[k]);
    const double dy = eye[1] - static_cast<double>(map.y[k]);
    const double cosine = eye[2] / std::sqrt(dx * dx + dy * dy + eye[2] * eye[2]);
    factors[k] = static_cast<float>(FresnelTransmittance(cosine, eta) * per_exitance);
  }
  return factors;
}

}  // namespace

LaserView::LaserView(const PinholeCamera& camera,
                     std::shared_ptr<const Transport> sample,
                     double spot_sigma_mm,
                     int thread_count)
    : map_(MapSample(camera, thread_count)),
      sample_(std::move(sample)),
      spot_sigma_mm_(spot_sigma_mm),
      pixel_mm_(map_.PixelSize()),
      thread_count_(thread_count) {
  Expect(spot_sigma_mm > 0, "a spot of some size");
  radiance_factor_ = RadianceFactors(camera, map_, sample_->phantom().slab.eta);
  for (int row = 0; row < map_.height; ++row) {
    const auto begin = map_.y.begin() + static_cast<std::ptrdiff_t>(map_.Index(0, row));
    const auto [low, high] = std::minmax_element(begin, begin + map_.width);
    row_lowest_y_.push_back(*low);
    row_highest_y_.push_back(*high);
  }
}

// The columns of a row that may lie within the radius; x grows along a row.
LaserView::Columns LaserView::Within(int row, PointMm centre, double radius_mm) const {
  const auto r = static_cast<std::size_t>(row);
  const double dy = std::max({0.0,
                              static_cast<double>(row_lowest_y_[r]) - centre.y,
                              centre.y - static_cast<double>(row_highest_y_[r])});
  if (dy >= radius_mm) {
    return {};
  }
  const auto half = std::sqrt(radius_mm * radius_mm - dy * dy);
  const float* const begin = &map_.x[map_.Index(0, row)];
  const float* const end = begin + map_.width;
  return {
      static_cast<int>(
          std::lower_bound(begin, end, static_cast<float>(centre.x - half)) - begin),
      static_cast<int>(
          std::upper_bound(begin, end, static_cast<float>(centre.x + half)) - begin)};
}

void LaserView::OnSample(std::span<const Spot> spots,
                         double flux_mw,
                         std::size_t channel,
                         std::vector<float>& radiance) const {
  const double eta = sample_->phantom().slab.eta;
  const double reach_mm = sample_->ReachMm(channel);
  const LaserTiles tiles(map_, *sample_);
  radiance.resize(map_.x.size());
  constexpr int kRows = LaserTiles::kBandRows;
  ParallelFor((map_.height + kRows - 1) / kRows, thread_count_, [&](auto band_index) {
    const int band = static_cast<int>(band_index);
    const std::size_t begin = map_.Index(0, band * kRows);
    const std::size_t end = map_.Index(0, std::min(map_.height, (band + 1) * kRows));
    std::fill(&radiance[begin], radiance.data() + end, 0.0F);
    for (const Spot& spot : spots) {
      tiles.AddSpot({.centre = spot.centre_mm,
                     .entering_mw = flux_mw * spot.power *
                                    FresnelTransmittance(spot.cos_incidence, eta),
                     .channel = channel,
                     .reach_mm = reach_mm},
                    band,
                    radiance.data());
    }
    for (std::size_t k = begin; k < end; ++k) {
      radiance[k] *= radiance_factor_[k];
    }
  });
}

std::vector<float> LaserView::OnSample(std::span<const Spot> spots,
                                       double flux_mw,
                                       std::size_t channel) const {
  std::vector<float> radiance;
  OnSample(spots, flux_mw, channel, radiance);
  return radiance;
}

// Adds the Gaussian spot's density of flux, mm⁻². Equidistant samples integrate a
// Gaussian to rounding as soon as they resolve it.
void LaserView::AddReferenceSpot(PointMm centre,
                                 double power,
                                 int row,
                                 float* density_per_mm2) const {
  constexpr double kFarthestSigma = 6;
  const int side =
      std::clamp(static_cast<int>(std::ceil(2 * pixel_mm_ / spot_sigma_mm_)), 2, 64);
  const double peak =
      1 / (2 * std::numbers::pi * spot_sigma_mm_ * spot_sigma_mm_ * side * side);
  const Columns columns =
      Within(row, centre, kFarthestSigma * spot_sigma_mm_ + 2 * pixel_mm_);
  for (int column = columns.begin; column < columns.end; ++column) {
    double sum = 0;
    for (int k = 0; k < side * side; ++k) {
      const int across = k % side;
      const int down = k / side;
      const PointMm point =
          map_.At(column, row, (across + 0.5) / side - 0.5, (down + 0.5) / side - 0.5);
      const double dx = (point.x - centre.x) / spot_sigma_mm_;
      const double dy = (point.y - centre.y) / spot_sigma_mm_;
      sum += std::exp(-0.5 * (dx * dx + dy * dy));
    }
    density_per_mm2[column] += static_cast<float>(sum * peak * power);
  }
}

std::vector<float> LaserView::OnReference(std::span<const Spot> spots,
                                          double flux_mw,
                                          double reflectance) const {
  std::vector<float> radiance(map_.x.size(), 0.0F);
  const auto factor = static_cast<float>(flux_mw * reflectance / std::numbers::pi);
  ParallelForBlocks(
      map_.height, kRowsPerTask, thread_count_, [&](auto begin, auto end) {
        for (int row = static_cast<int>(begin); row < static_cast<int>(end); ++row) {
          const std::size_t at = map_.Index(0, row);
          for (const Spot& spot : spots) {
            AddReferenceSpot(spot.centre_mm, spot.power, row, &radiance[at]);
          }
          for (int column = 0; column < map_.width; ++column) {
            radiance[map_.Index(column, row)] *= factor;
          }
        }
      });
  return radiance;
}

}  // namespace nacre::rigs
