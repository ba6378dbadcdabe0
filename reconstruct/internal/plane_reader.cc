#include "reconstruct/internal/plane_reader.h"

#include <cstdint>
#include <utility>

namespace nacre::reconstruct::internal {
namespace {

// A plane's pixels, of what there is for every pixel.
std::vector<float> Subsample(const std::vector<float>& all,
                             int width_px,
                             const calibrate::MosaicPlane& plane) {
  const int height_px = static_cast<int>(std::ssize(all)) / width_px;
  std::vector<float> some;
  some.reserve(all.size() / static_cast<std::size_t>(plane.step * plane.step) + 1);
  for (int y = plane.row; y < height_px; y += plane.step) {
    for (int x = plane.column; x < width_px; x += plane.step) {
      some.push_back(all[static_cast<std::size_t>(std::int64_t{y} * width_px + x)]);
    }
  }
  return some;
}

std::vector<float> InverseFlat(const calibrate::Calibration& calibration,
                               const calibrate::MosaicPlane& plane) {
  const calibrate::SmoothField& flat = calibration.corrections.flat_field;
  if (flat.empty()) {
    return {};
  }
  std::vector<float> inverse =
      flat.Map(calibration.camera.width_px, calibration.camera.height_px);
  for (float& value : inverse) {
    value = 1 / value;
  }
  return Subsample(inverse, calibration.camera.width_px, plane);
}

// Glare by distance in a plane's own pixels.
calibrate::Glare PlaneGlare(calibrate::Glare glare,
                            const calibrate::MosaicPlane& plane) {
  const double step = plane.step;
  for (std::size_t k = 0; k < glare.radius_px.size(); ++k) {
    glare.radius_px[k] /= step;
    glare.density_per_px2[k] *= step * step;
    glare.sigma_per_px2[k] *= step * step;
  }
  return glare;
}

// The spot less what a plane's pixels are narrower than their pitch: CellWeights takes
// them to be as wide, and so blurs the picture by too much.
calibrate::SpotProfile PlaneSpot(calibrate::SpotProfile spot,
                                 const calibrate::CameraGeometry& camera,
                                 const calibrate::MosaicPlane& plane) {
  const calibrate::PixelPoint centre{0.5 * camera.width_px, 0.5 * camera.height_px};
  const PointMm at = camera.SampleFromPixel(centre);
  const PointMm right = camera.SampleFromPixel({centre.x + 1, centre.y});
  const PointMm down = camera.SampleFromPixel({centre.x, centre.y + 1});
  const PointMm a{right.x - at.x, right.y - at.y};
  const PointMm b{down.x - at.x, down.y - at.y};
  const double aperture = calibrate::PlaneAperture(plane);
  const double gap = (1 - aperture * aperture) / 12;
  spot.xx_mm2 -= gap * (a.x * a.x + b.x * b.x);
  spot.xy_mm2 -= gap * (a.x * a.y + b.x * b.y);
  spot.yy_mm2 -= gap * (a.y * a.y + b.y * b.y);
  return spot;
}

}  // namespace

PlaneReader::PlaneReader(const calibrate::Calibration& calibration,
                         const calibrate::MosaicPlane& plane,
                         const RdHeader& header,
                         const SurfaceModel& surface,
                         int thread_count)
    : calibration_(calibration),
      plane_(plane),
      camera_(calibrate::PlaneCamera(calibration.camera, plane)),
      weights_(CellLattice(header),
               camera_,
               PlaneSpot(surface.spot, camera_, plane),
               thread_count,
               {.place = surface.place,
                .factor = InverseFlat(calibration, plane),
                .with_bins = !calibration.corrections.glare.empty()}),
      shift_(CellLattice(header),
             camera_,
             header,
             {.spot = PlaneSpot(surface.spot, camera_, plane),
              .place = {},
              .on_surface = surface.on_surface,
              .beam_offsets = surface.beam_offsets},
             thread_count),
      glare_(PlaneGlare(calibration.corrections.glare, plane),
             camera_.width_px,
             camera_.height_px) {
  TakeAmbient();
}

// Ambient light is the same in all pictures: what it is in the cells.
void PlaneReader::TakeAmbient() {
  const calibrate::Corrections& corrections = calibration_.corrections;
  if (corrections.ambient.empty()) {
    return;
  }
  const auto cells = static_cast<std::size_t>(weights_.lattice().CellCount());
  RateFrame frame;
  frame.rate = Subsample(calibrate::AmbientMap(corrections.ambient,
                                               corrections.filters,
                                               calibration_.camera.width_px,
                                               calibration_.camera.height_px),
                         calibration_.camera.width_px,
                         plane_);
  frame.variance.assign(frame.rate.size(), 0.0F);
  std::vector<float> variance(cells);
  std::vector<float> rate(cells);
  std::vector<float> glare(cells, 0.0F);
  TakeGlare(frame, {rate, variance, glare});
  ambient_ = std::move(rate);
  ambient_glare_ = std::move(glare);
}

// Means over cells of a picture less its glare, and the light that was glare.
void PlaneReader::TakeGlare(const RateFrame& rates, CellValues cells) const {
  weights_.Means(rates, 0, cells.rate, cells.variance);
  if (glare_.empty()) {
    return;
  }
  BinnedPicture binned(camera_.width_px, camera_.height_px);
  binned.Fill(rates.rate, camera_.width_px);
  weights_.MeansOfBins(glare_.Scattered(std::move(binned)), cells.glare);
  const auto gain = static_cast<float>(1 / (1 - glare_.fraction()));
  for (std::size_t k = 0; k < cells.rate.size(); ++k) {
    cells.rate[k] = cells.rate[k] * gain - cells.glare[k];
    cells.variance[k] *= gain * gain;
  }
}

RateFrame PlaneReader::PixelsOf(const RateFrame& picture) const {
  const int width = calibration_.camera.width_px;
  return {.rate = Subsample(picture.rate, width, plane_),
          .variance = Subsample(picture.variance, width, plane_)};
}

void PlaneReader::Read(const RateFrame& picture,
                       std::span<const acquire::GridIndex> group,
                       CellValues cells) const {
  RateFrame own;
  if (plane_.step > 1) {
    own = PixelsOf(picture);
  }
  const RateFrame& rates = plane_.step > 1 ? own : picture;
  TakeGlare(rates, cells);
  shift_.Apply(rates, group, cells.rate);
  for (std::size_t k = 0; k < ambient_.size(); ++k) {
    cells.rate[k] -= ambient_[k];
    cells.glare[k] -= ambient_glare_[k];
  }
}

}  // namespace nacre::reconstruct::internal
