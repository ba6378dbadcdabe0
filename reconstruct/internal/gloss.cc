#include "reconstruct/internal/gloss.h"

#include "calibrate/glare.h"
#include "calibrate/hysteresis.h"
#include "reconstruct/internal/hdr_merge.h"
#include "reconstruct/internal/nonnegative_fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <numbers>

namespace nacre::reconstruct::internal {
namespace {

constexpr double kBinPx = 1.0 / 3;
constexpr std::size_t kBins = 18;  // six pixels
constexpr int kDepths = 8;
constexpr double kDeeper = 1.45;    // each depth than the one before
constexpr std::size_t kBlocks = 8;  // of spots, for the scatter

using Profile = std::array<double, kBins>;

// Sums over pixels, by their distance from a spot: of rate π / kΦ, mm⁻².
struct Rings {
  Profile sum{};
  Profile count{};
  Profile square_mm2{};  // Σ r²

  void Add(const Rings& other) {
    for (std::size_t k = 0; k < kBins; ++k) {
      sum[k] += other.sum[k];
      count[k] += other.count[k];
      square_mm2[k] += other.square_mm2[k];
    }
  }
};

// Pictures of one camera, ready to be looked at.
class Viewer {
 public:
  Viewer(const calibrate::Calibration& calibration,
         const calibrate::CameraGeometry& camera)
      : calibration_(calibration),
        camera_(camera),
        glare_(calibration.corrections.glare, camera.width_px, camera.height_px),
        flat_(
            calibration.corrections.flat_field.Map(camera.width_px, camera.height_px)),
        bin_mm_(kBinPx * std::sqrt(camera.FootprintMm2(
                             {0.5 * camera.width_px, 0.5 * camera.height_px}))) {}

  double bin_mm() const { return bin_mm_; }

  RateFrame Look(std::span<const acquire::Frame> frames) const {
    RateFrame rates = MergeExposures(frames, calibration_);
    glare_.Remove(rates.rate);
    return rates;
  }

  Rings Around(const RateFrame& rates, PointMm spot, double scale) const {
    const calibrate::PixelPoint centre = camera_.PixelFromSample(spot);
    Rings rings;
    const int reach = static_cast<int>(kBinPx * kBins) + 2;
    const int x0 = static_cast<int>(std::lround(centre.x));
    const int y0 = static_cast<int>(std::lround(centre.y));
    if (x0 < reach || y0 < reach || x0 + reach >= camera_.width_px ||
        y0 + reach >= camera_.height_px) {
      return rings;
    }
    for (int y = y0 - reach; y <= y0 + reach; ++y) {
      for (int x = x0 - reach; x <= x0 + reach; ++x) {
        const auto at =
            static_cast<std::size_t>(y) * static_cast<std::size_t>(camera_.width_px) +
            static_cast<std::size_t>(x);
        const PointMm p =
            camera_.SampleFromPixel({static_cast<double>(x), static_cast<double>(y)});
        const double r2 = std::pow(p.x - spot.x, 2) + std::pow(p.y - spot.y, 2);
        const double bin = std::sqrt(r2) / bin_mm_;
        if (bin >= kBins) {
          continue;
        }
        if (rates.variance[at] < 0) {
          return {};
        }
        const auto k = static_cast<std::size_t>(bin);
        rings.sum[k] += scale * static_cast<double>(rates.rate[at] / flat_[at]);
        rings.count[k] += 1;
        rings.square_mm2[k] += r2;
      }
    }
    return rings;
  }

 private:
  const calibrate::Calibration& calibration_;
  const calibrate::CameraGeometry& camera_;
  calibrate::GlareFilter glare_;
  std::vector<float> flat_;
  double bin_mm_;
};

double Scale(const calibrate::Calibration& calibration, int channel) {
  return std::numbers::pi / calibration.channels[static_cast<std::size_t>(channel)]
                                .flux_scale_counts_mm2_sr_per_us;
}

// The laser's spot as it looks on a diffuse target of reflectance 1.
Rings OnReference(const acquire::SessionReader& session,
                  const calibrate::Calibration& calibration,
                  int channel) {
  constexpr int kPictures = 6;
  const Viewer viewer(calibration, calibration.camera);
  const acquire::Schedule& schedule = session.schedule();
  Rings rings;
  int pictures = 0;
  for (std::int64_t n = 0; n < schedule.grid_begin() && pictures < kPictures; ++n) {
    if (schedule[n].target != acquire::Target::kReference ||
        schedule[n].channel != channel) {
      continue;
    }
    ++pictures;
    const std::array frames = {session.ReadFrame(n)};
    const RateFrame rates = viewer.Look(frames);
    for (const PointMm& spot :
         calibrate::BeamPositions(calibration, schedule.Beams(n, nullptr))) {
      rings.Add(viewer.Around(
          rates,
          spot,
          Scale(calibration, channel) / session.rig().targets.reference_reflectance));
    }
  }
  return rings;
}

// The same around the spots of groups on the sample, in blocks.
std::array<Rings, kBlocks> OnSample(const acquire::SessionReader& session,
                                    const calibrate::Calibration& calibration,
                                    const Viewer& viewer,
                                    const calibrate::SamplePlane& plane,
                                    const std::vector<std::int64_t>& pictures) {
  const acquire::Schedule& schedule = session.schedule();
  const acquire::ScanMap& map =
      session.manifest().scan_map ? *session.manifest().scan_map : calibration.scan_map;
  std::array<Rings, kBlocks> blocks;
  std::size_t next = 0;
  for (std::size_t k = 0; k < pictures.size();) {
    const acquire::ScheduledPicture& first = schedule[pictures[k]];
    std::vector<acquire::Frame> frames;
    const std::int64_t number = pictures[k];
    for (; k < pictures.size() && schedule[pictures[k]].group == first.group; ++k) {
      frames.push_back(session.ReadFrame(pictures[k]));
    }
    const RateFrame rates = viewer.Look(frames);
    const std::vector<PointMm> beams =
        calibrate::BeamPositions(calibration, schedule.Beams(number, &map));
    const std::size_t count =
        std::min(beams.size(), schedule.Group(first.group).size());
    for (std::size_t beam = 0; beam < count; ++beam, ++next) {
      const PointMm spot = calibrate::OnSurface(calibration, plane, beams[beam]);
      blocks[next % kBlocks].Add(
          viewer.Around(rates, spot, Scale(calibration, first.channel)));
    }
  }
  return blocks;
}

// K of light from a depth, blurred by a round Gaussian: equidistant nodes, which for a
// Gaussian are as good as any.
double Blurred(double depth_mm, double r_mm, double sigma_mm) {
  constexpr int kFarthest = 7;
  constexpr double kStep = 0.55;  // in sigmas
  double sum = 0;
  double weights = 0;
  for (int a = -kFarthest; a <= kFarthest; ++a) {
    for (int b = -kFarthest; b <= kFarthest; ++b) {
      const double weight = std::exp(-0.5 * kStep * kStep * (a * a + b * b));
      const double x = r_mm + sigma_mm * kStep * a;
      const double y = sigma_mm * kStep * b;
      const double d2 = depth_mm * depth_mm + x * x + y * y;
      weights += weight;
      sum += weight * depth_mm / (2 * std::numbers::pi * d2 * std::sqrt(d2));
    }
  }
  return sum / weights;
}

// Relative errors alike. The first column is the reference's profile; returns its
// coefficient.
double Fit(const Rings& sample,
           const Rings& reference,
           double sigma_mm,
           double least_depth_mm) {
  Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(kBins, 1 + kDepths);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(kBins);
  for (std::size_t k = 0; k < kBins; ++k) {
    if (sample.count[k] == 0 || reference.count[k] == 0 || !(sample.sum[k] > 0)) {
      continue;
    }
    const auto row = static_cast<Eigen::Index>(k);
    const double value = sample.sum[k] / sample.count[k];
    const double weight = std::sqrt(sample.count[k]) / value;
    const double r = std::sqrt(sample.square_mm2[k] / sample.count[k]);
    columns(row, 0) = weight * reference.sum[k] / reference.count[k];
    double depth = least_depth_mm;
    for (int m = 1; m <= kDepths; ++m, depth *= kDeeper) {
      columns(row, m) = weight * Blurred(depth, r, sigma_mm);
    }
    right(row) = weight * value;
  }
  return FitNonnegative(columns, right)(0);
}

std::vector<std::int64_t> PicturesOf(const acquire::SessionReader& session,
                                     const std::vector<int>& groups,
                                     int channel) {
  const acquire::Schedule& schedule = session.schedule();
  std::vector<std::int64_t> pictures;
  for (std::int64_t n = schedule.grid_begin();
       n < std::min(schedule.size(), session.picture_count());
       ++n) {
    if (schedule[n].target == acquire::Target::kSample &&
        schedule[n].channel == channel && session.WasTaken(n) &&
        std::find(groups.begin(), groups.end(), schedule[n].group) != groups.end()) {
      pictures.push_back(n);
    }
  }
  return pictures;
}

}  // namespace

namespace {

constexpr double kSignificant = 3;

}  // namespace

bool Gloss::IsFound() const {
  bool is_found = false;
  for (std::size_t c = 0; c < reflectance.size(); ++c) {
    is_found = is_found || reflectance[c] > kSignificant * sigma[c];
  }
  return is_found;
}

std::string Gloss::Warning(const std::vector<std::string>& channels) const {
  std::string text;
  for (std::size_t c = 0; c < reflectance.size(); ++c) {
    if (reflectance[c] > kSignificant * sigma[c]) {
      text += fmt::format("{}{:.2f} +- {:.2f} % in {}",
                          text.empty() ? "" : ", ",
                          100 * reflectance[c],
                          100 * sigma[c],
                          channels[c]);
    }
  }
  return text.empty() ? ""
                      : "gloss: the surface itself throws back " + text +
                            " at the lit point; taken out of the lit cell";
}

Gloss MeasureGloss(const acquire::SessionReader& session,
                   const calibrate::Calibration& calibration,
                   const calibrate::CameraGeometry& camera,
                   const calibrate::SamplePlane& plane,
                   const std::vector<int>& groups) {
  Gloss gloss;
  const Viewer viewer(calibration, camera);
  Rings spots;
  for (int c = 0; c < session.rig().ChannelCount(); ++c) {
    const Rings reference = OnReference(session, calibration, c);
    const std::array<Rings, kBlocks> blocks =
        OnSample(session, calibration, viewer, plane, PicturesOf(session, groups, c));
    // The spot's width with a pixel's own, from its own profile.
    double square = 0;
    double sum = 0;
    double inner = 0;
    for (std::size_t k = 0; k < kBins; ++k) {
      const double outer = std::pow(static_cast<double>(k + 1), 2);
      const double value =
          reference.count[k] > 0 ? reference.sum[k] / reference.count[k] : 0;
      sum += (outer - inner) * value;
      square += (outer - inner) * value * 0.5 * (outer + inner);
      inner = outer;
    }
    const double sigma_mm =
        sum > 0 ? viewer.bin_mm() * std::sqrt(0.5 * square / sum) : viewer.bin_mm();
    spots.Add(reference);
    Rings all;
    for (const Rings& block : blocks) {
      all.Add(block);
    }
    const auto fit = [&](const Rings& rings, double depths) {
      return Fit(rings, reference, sigma_mm, depths * sigma_mm);
    };
    constexpr double kLeastDepth = 1.2;  // in widths of the spot
    const double best = fit(all, kLeastDepth);
    double scatter2 = 0;
    for (std::size_t b = 0; b < kBlocks; ++b) {  // jackknife
      Rings others;
      for (std::size_t o = 0; o < kBlocks; ++o) {
        others.Add(o == b ? Rings{} : blocks[o]);
      }
      scatter2 += std::pow(fit(others, kLeastDepth) - best, 2) *
                  static_cast<double>(kBlocks - 1) / static_cast<double>(kBlocks);
    }
    // Of depths that could as well have been taken.
    const double other = fit(all, 1.1 * kLeastDepth) - fit(all, kLeastDepth / 1.1);
    gloss.reflectance.push_back(best);
    gloss.sigma.push_back(std::sqrt(scatter2 + 0.25 * other * other));
  }
  for (std::size_t k = 0; k < kBins && spots.sum[k] > 0; ++k) {
    gloss.square_mm2.push_back(spots.square_mm2[k] / spots.count[k]);
    gloss.log_density.push_back(std::log(spots.sum[k] / spots.count[k]));
  }
  return gloss;
}

}  // namespace nacre::reconstruct::internal
