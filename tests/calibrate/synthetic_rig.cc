#include "tests/calibrate/synthetic_rig.h"

#include "core/error.h"
#include "core/random.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>

namespace nacre::testing {
namespace {

using acquire::Target;

constexpr int kSubPixels = 3;  // along each axis

cv::Matx33d Turn(double x_rad, double y_rad, double z_rad) {
  cv::Matx33d x;
  cv::Matx33d y;
  cv::Matx33d z;
  cv::Rodrigues(cv::Vec3d(x_rad, 0, 0), x);
  cv::Rodrigues(cv::Vec3d(0, y_rad, 0), y);
  cv::Rodrigues(cv::Vec3d(0, 0, z_rad), z);
  return z * y * x;
}

struct Pose {
  cv::Matx33d rotation;
  cv::Vec3d translation_mm;
};

// The camera looks at the origin from `distance_mm`; half a turn about x makes z point
// along the view and y down.
Pose CameraFromSample(const SyntheticTruth& truth) {
  return {Turn(0, 0, truth.roll_rad) * Turn(std::numbers::pi + truth.tilt_rad, 0, 0),
          {0, 0, truth.distance_mm}};
}

Pose SampleFromBoard(int pose) {
  if (pose == 0) {
    return {cv::Matx33d::eye(), {0, 0, 0}};
  }
  const double around = 2.4 * pose;  // spreads the directions of tilt
  return {Turn(0.4 * std::cos(around), 0.4 * std::sin(around), 0.1 * (pose % 3 - 1)),
          {4.0 * std::sin(1.3 * pose), 3.0 * std::cos(1.7 * pose), 3.0 * (pose % 2)}};
}

cv::Matx33d Matrix(const SyntheticTruth& truth) {
  return {truth.focal_px,
          0,
          truth.centre_x_px,
          0,
          truth.focal_px,
          truth.centre_y_px,
          0,
          0,
          1};
}

class SyntheticRig final {
 public:
  SyntheticRig(const SyntheticTruth& truth, const acquire::RigDescription& rig)
      : truth_(truth), rig_(rig) {
    std::vector<cv::Point2d> pixels;
    for (int y = 0; y < truth.height_px * kSubPixels; ++y) {
      for (int x = 0; x < truth.width_px * kSubPixels; ++x) {
        pixels.emplace_back((x + 0.5) / kSubPixels - 0.5, (y + 0.5) / kSubPixels - 0.5);
      }
    }
    cv::undistortPoints(pixels,
                        rays_,
                        Matrix(truth),
                        truth.distortion,
                        cv::noArray(),
                        cv::noArray(),
                        cv::TermCriteria(cv::TermCriteria::COUNT, 20, 0));
  }

  Target target = Target::kNothing;
  int pose = 0;
  int channel = -1;
  std::vector<acquire::ScanAngle> spots;
  double exposure_us = 0;

  const SyntheticTruth& truth() const { return truth_; }

  acquire::Frame Expose(std::uint64_t picture_number) {
    const auto scene = std::tuple(target, pose, channel);
    if (rates_.empty() || scene != rates_scene_) {
      rates_ = Rates();
      rates_scene_ = scene;
    }
    const std::vector<double>& rates = rates_;
    acquire::Frame frame{.width = truth_.width_px,
                         .height = truth_.height_px,
                         .counts = std::vector<std::uint16_t>(rates.size()),
                         .exposure_us = exposure_us};
    RandomStream random(77, picture_number);
    for (std::size_t k = 0; k < rates.size(); ++k) {
      // Shot noise at these signals is Gaussian enough. Dark current is left without.
      const double signal = rates[k] * exposure_us;
      const double read = truth_.read_noise_electrons / truth_.gain_electrons_per_count;
      const double sigma =
          std::sqrt(read * read + signal / truth_.gain_electrons_per_count);
      const double normal = std::sqrt(-2 * std::log(1 - random.Uniform())) *
                            std::cos(2 * std::numbers::pi * random.Uniform());
      const double full =
          std::min(signal, truth_.saturation_counts - truth_.offset_counts);
      const double noise = full < signal ? read * normal : sigma * normal;
      const double counts =
          truth_.offset_counts + truth_.dark_counts_per_us * exposure_us + full + noise;
      frame.counts[k] =
          static_cast<std::uint16_t>(std::clamp(std::round(counts), 0.0, 4095.0));
    }
    return frame;
  }

 private:
  // Where the rays meet a plane z = 0 that stands in `camera_from_plane`.
  std::vector<PointMm> Meet(const Pose& camera_from_plane) const {
    const cv::Matx33d& r = camera_from_plane.rotation;
    const cv::Vec3d& t = camera_from_plane.translation_mm;
    const cv::Matx33d plane(
        r(0, 0), r(0, 1), t[0], r(1, 0), r(1, 1), t[1], r(2, 0), r(2, 1), t[2]);
    const cv::Matx33d inverse = plane.inv();
    std::vector<PointMm> points;
    points.reserve(rays_.size());
    for (const cv::Point2d& ray : rays_) {
      const cv::Vec3d p = inverse * cv::Vec3d(ray.x, ray.y, 1);
      points.push_back({p[0] / p[2], p[1] / p[2]});
    }
    return points;
  }

  template <class Shade>
  std::vector<double> Average(const std::vector<PointMm>& points, Shade shade) const {
    std::vector<double> rates(static_cast<std::size_t>(truth_.width_px) *
                              static_cast<std::size_t>(truth_.height_px));
    const int stride = truth_.width_px * kSubPixels;
    for (std::size_t k = 0; k < points.size(); ++k) {
      const int x = static_cast<int>(k) % stride / kSubPixels;
      const int y = static_cast<int>(k) / stride / kSubPixels;
      rates[static_cast<std::size_t>(y * truth_.width_px + x)] +=
          shade(points[k]) / (kSubPixels * kSubPixels);
    }
    return rates;
  }

  std::vector<double> Rates() const {
    const Pose camera = CameraFromSample(truth_);
    const auto pixel_count = static_cast<std::size_t>(truth_.width_px) *
                             static_cast<std::size_t>(truth_.height_px);
    switch (target) {
      case Target::kFlat:
        return std::vector<double>(pixel_count, truth_.flat_counts_per_us);
      case Target::kCheckerboard:
        return BoardRates(camera);
      case Target::kReference:
      case Target::kGlare:
        return SpotRates(camera);
      case Target::kNothing:
      case Target::kSample:
      case Target::kAmbient:
        break;
    }
    return std::vector<double>(pixel_count, 0.0);
  }

  std::vector<double> BoardRates(const Pose& camera) const {
    if (truth_.no_board) {
      return std::vector<double>(rays_.size() / (kSubPixels * kSubPixels), 0.05);
    }
    const Pose board = SampleFromBoard(pose);
    const acquire::TargetsDescription& targets = rig_.targets;
    const double columns = targets.checkerboard_columns + 1;
    const double rows = targets.checkerboard_rows + 1;
    return Average(
        Meet({camera.rotation * board.rotation,
              camera.rotation * board.translation_mm + camera.translation_mm}),
        [&](const PointMm& p) {
          const double u = p.x / targets.checkerboard_square_mm + 0.5 * columns;
          const double v = 0.5 * rows - p.y / targets.checkerboard_square_mm;
          const bool on_board = u >= 0 && v >= 0 && u < columns && v < rows;
          const bool black =
              on_board && (static_cast<int>(u) + static_cast<int>(v)) % 2 == 0;
          return truth_.board_counts_per_us * (black ? 0.06 : 0.85);
        });
  }

  std::vector<double> SpotRates(const Pose& camera) const {
    const double rate =
        truth_.flux_scale_counts_mm2_sr_per_us[static_cast<std::size_t>(channel)] *
        rig_.targets.reference_reflectance / std::numbers::pi;
    const double width = 2 * truth_.spot_sigma_mm * truth_.spot_sigma_mm;
    std::vector<PointMm> centres;
    for (std::size_t k = truth_.dropped_spots; k < spots.size(); ++k) {
      centres.push_back(truth_.LaserAt(spots[k]));
    }
    return Average(Meet(camera), [&](const PointMm& p) {
      double sum = 0;
      for (const PointMm& c : centres) {
        const double r2 = (p.x - c.x) * (p.x - c.x) + (p.y - c.y) * (p.y - c.y);
        sum += r2 < 25 * width ? std::exp(-r2 / width) : 0;
      }
      return rate * sum / (std::numbers::pi * width);
    });
  }

  SyntheticTruth truth_;
  acquire::RigDescription rig_;
  std::vector<cv::Point2d> rays_;
  std::vector<double> rates_;  // of the scene below
  std::tuple<Target, int, int> rates_scene_;
};

class SyntheticCamera final : public acquire::Camera {
 public:
  explicit SyntheticCamera(SyntheticRig& rig) : rig_(rig) {}
  acquire::CameraInfo Info() const override {
    return {.model = "synthetic",
            .serial = "0",
            .width = rig_.truth().width_px,
            .height = rig_.truth().height_px,
            .bit_depth = 12,
            .min_exposure_us = 1,
            .max_exposure_us = 1e6};
  }
  double SetExposureUs(double exposure_us) override {
    return rig_.exposure_us = exposure_us;
  }
  std::optional<acquire::Frame> Capture(std::uint64_t picture_number,
                                        std::chrono::milliseconds) override {
    return rig_.Expose(picture_number);
  }

 private:
  SyntheticRig& rig_;
};

class SyntheticLaser final : public acquire::Illuminator {
 public:
  SyntheticLaser(SyntheticRig& rig, std::vector<std::string> channels)
      : rig_(rig), channels_(std::move(channels)) {}
  acquire::IlluminatorInfo Info() const override {
    return {.model = "synthetic",
            .serial = "0",
            .channels = channels_,
            .max_angle_rad = 0.5};
  }
  void Light(std::span<const acquire::ScanAngle> spots, int channel) override {
    rig_.spots.assign(spots.begin(), spots.end());
    rig_.channel = channel;
  }
  void Blank() noexcept override { rig_.spots.clear(); }

 private:
  SyntheticRig& rig_;
  std::vector<std::string> channels_;
};

class SyntheticStage final : public acquire::SampleStage {
 public:
  explicit SyntheticStage(SyntheticRig& rig) : rig_(rig) {}
  void Place(Target target, int pose) override {
    rig_.target = target;
    rig_.pose = pose;
  }

 private:
  SyntheticRig& rig_;
};

}  // namespace

PointMm SyntheticTruth::LaserAt(acquire::ScanAngle angle) const {
  // The two-mirror scanner's pincushion, then a small turn, scale and shift.
  const double x = 305 * std::tan(angle.x_rad) / std::cos(angle.y_rad);
  const double y = 295 * std::tan(angle.y_rad);
  constexpr double kTurnRad = 0.03;
  return {x * std::cos(kTurnRad) - y * std::sin(kTurnRad) + 1.5,
          x * std::sin(kTurnRad) + y * std::cos(kTurnRad) - 0.7};
}

std::string SyntheticRigToml(
    const std::vector<std::pair<std::string, std::string>>& edits) {
  std::string text = R"(kind = "simulated"

[sample]
name = "synthetic"
eta = 1.4

[grid]
points = [30, 20]
pitch_mm = 3.0
core = 5

[camera]
exposures_us = [20000, 1000]
dark_frames = 3
target_exposure_us = 15000
flat_exposures_us = [2000, 6000, 12000]

[targets]
checkerboard_columns = 9
checkerboard_rows = 6
checkerboard_square_mm = 11.0
checkerboard_poses = 8
reference_reflectance = 0.95
reference_exposure_us = 10
reference_frames = 2
laser_lattice = 7

[scanner]
mm_per_rad = 300
channels = ["R", "G"]
)";
  for (const auto& [from, to] : edits) {
    const std::size_t at = text.find(from);
    if (at == std::string::npos) {
      throw LogicError("the rig has no such text: " + from);
    }
    text.replace(at, from.size(), to);
  }
  return text;
}

void CaptureSynthetic(const SyntheticTruth& truth,
                      const std::string& rig_toml,
                      const std::filesystem::path& folder) {
  const acquire::RigDescription rig = acquire::ParseRig(rig_toml, "rig.toml");
  SyntheticRig world(truth, rig);
  SyntheticCamera camera(world);
  SyntheticLaser laser(world, rig.scanner.channels);
  SyntheticStage stage(world);
  auto session = acquire::SessionWriter::Create(
      folder, acquire::MakeManifest(rig, camera.Info(), laser.Info()), false);
  CaptureCalibration(session, {camera, laser, stage});
}

cv::Point2d TruePixel(const SyntheticTruth& truth, PointMm point) {
  const Pose pose = CameraFromSample(truth);
  cv::Vec3d rotation;
  cv::Rodrigues(pose.rotation, rotation);
  std::vector<cv::Point2d> pixels;
  cv::projectPoints(std::vector<cv::Point3d>{{point.x, point.y, 0}},
                    rotation,
                    pose.translation_mm,
                    Matrix(truth),
                    truth.distortion,
                    pixels);
  return pixels[0];
}

cv::Vec3d TrueCameraCentre(const SyntheticTruth& truth) {
  const Pose pose = CameraFromSample(truth);
  return -(pose.rotation.t() * pose.translation_mm);
}

}  // namespace nacre::testing
