#include "calibrate/geometry.h"

#include "acquire/mosaic.h"
#include "calibrate/filter_estimate.h"
#include "calibrate/internal/one_thread_algebra.h"
#include "calibrate/internal/pictures.h"
#include "calibrate/mosaic.h"
#include "core/error.h"

#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <fmt/format.h>
#include <numeric>
#include <vector>

namespace nacre::calibrate {
namespace {

using Corners = std::vector<cv::Point2f>;

// The white balance that makes one grey picture of a mosaic, as the board is white,
// grey and black.
struct Grey {
  std::string mosaic;
  double dark_counts = 0;
  std::array<double, 3> white{1, 1, 1};
};

Grey GreyOf(const acquire::SessionReader& session) {
  Grey grey;
  if (acquire::IsMosaic(session.manifest().camera.mosaic)) {
    grey.mosaic = session.manifest().camera.mosaic;
    grey.white = EstimateWhite(session);
    grey.dark_counts = internal::MeanCounts(session.ReadFrame(
        internal::PicturesOf(session, acquire::Target::kNothing).front()));
  }
  return grey;
}

cv::Mat FloatPicture(const acquire::Frame& frame, const Grey& grey) {
  std::vector<float> values(frame.counts.begin(), frame.counts.end());
  if (!grey.mosaic.empty()) {
    for (float& value : values) {
      value -= static_cast<float>(grey.dark_counts);
    }
    Balance(grey.mosaic, grey.white, frame.width, values);
  }
  return cv::Mat(frame.height, frame.width, CV_32FC1, values.data()).clone();
}

// Eight bits from nearly the darkest to nearly the brightest, for the detector.
cv::Mat BytePicture(const cv::Mat& values) {
  std::vector<float> sorted(values.begin<float>(), values.end<float>());
  const auto rank = static_cast<std::ptrdiff_t>(sorted.size() / 200);
  std::nth_element(sorted.begin(), sorted.begin() + rank, sorted.end());
  const auto low = static_cast<double>(sorted[static_cast<std::size_t>(rank)]);
  std::nth_element(sorted.begin(), sorted.end() - 1 - rank, sorted.end());
  const auto high = static_cast<double>(*(sorted.end() - 1 - rank));
  const double scale = 255 / std::max(high - low, 1.0);
  cv::Mat picture;
  values.convertTo(picture, CV_8U, scale, -low * scale);
  return picture;
}

// Row by row from the sample's top, left to right, whatever corner the detector began
// with.
Corners Ordered(Corners corners, cv::Size board, const std::string& where) {
  const auto at = [&](int column, int row) -> cv::Point2f {
    return corners[static_cast<std::size_t>(std::int64_t{row} * board.width + column)];
  };
  const cv::Point2f right = at(board.width - 1, 0) - at(0, 0) +
                            at(board.width - 1, board.height - 1) -
                            at(0, board.height - 1);
  if (std::abs(right.x) <= std::abs(right.y)) {
    throw BadData(where +
                  ": the board's longer rows run across the picture; turn the camera "
                  "upright, sample +x to the right");
  }
  if (right.x < 0) {
    std::reverse(corners.begin(), corners.end());  // half a turn
  }
  const cv::Point2f down = at(0, board.height - 1) - at(0, 0);
  if (down.y < 0) {
    throw BadData(where + ": the picture is a mirror image; flip it in the camera");
  }
  return corners;
}

// As it is; then smoothed, since a sharp lens on coarse pixels makes stairs of edges;
// then at twice the size, for small squares; each time harder.
bool FindBoard(const cv::Mat& picture, cv::Size board, Corners& corners) {
  if (cv::findChessboardCornersSB(
          picture, board, corners, cv::CALIB_CB_NORMALIZE_IMAGE)) {
    return true;
  }
  constexpr int kHard = cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_EXHAUSTIVE;
  constexpr double kSmoothPx = 0.7;
  cv::Mat smooth;
  cv::GaussianBlur(picture, smooth, cv::Size(), kSmoothPx);
  if (cv::findChessboardCornersSB(smooth, board, corners, kHard)) {
    return true;
  }
  cv::Mat large;
  cv::resize(smooth, large, cv::Size(), 2, 2, cv::INTER_CUBIC);
  if (!cv::findChessboardCornersSB(large, board, corners, kHard)) {
    return false;
  }
  for (cv::Point2f& corner : corners) {  // pixels' centres are whole numbers
    corner = (corner + cv::Point2f(0.5F, 0.5F)) * 0.5F - cv::Point2f(0.5F, 0.5F);
  }
  return true;
}

Corners FindCorners(const acquire::SessionReader& session,
                    const Grey& grey,
                    std::int64_t number) {
  const acquire::TargetsDescription& targets = session.rig().targets;
  const cv::Size board(targets.checkerboard_columns, targets.checkerboard_rows);
  const std::string where = (session.folder() / session.Entry(number).file).string();
  const cv::Mat picture = FloatPicture(session.ReadFrame(number), grey);
  Corners corners;
  const bool found = FindBoard(BytePicture(picture), board, corners);
  if (!found) {
    throw BadData(fmt::format(
        "{}: no checkerboard of {} x {} inner corners can be made out in pose {}; see "
        "that all of it is in view, in focus, and neither dark nor overexposed",
        where,
        board.width,
        board.height,
        session.schedule()[number].pose));
  }
  // A window of less than half a square sees one corner only.
  float closest = std::numeric_limits<float>::max();
  for (std::size_t k = 1; k < corners.size(); ++k) {
    closest =
        std::min(closest, static_cast<float>(cv::norm(corners[k] - corners[k - 1])));
  }
  const int half_window = std::clamp(static_cast<int>(0.4F * closest), 2, 11);
  constexpr int kMaxIterations = 100;
  constexpr double kTolerancePx = 1e-4;
  cv::cornerSubPix(picture,
                   corners,
                   cv::Size(half_window, half_window),
                   cv::Size(-1, -1),
                   cv::TermCriteria(cv::TermCriteria::COUNT | cv::TermCriteria::EPS,
                                    kMaxIterations,
                                    kTolerancePx));
  return Ordered(std::move(corners), board, where);
}

std::vector<cv::Point3f> BoardPoints(const acquire::TargetsDescription& targets) {
  std::vector<cv::Point3f> points_mm;
  for (int row = 0; row < targets.checkerboard_rows; ++row) {
    for (int column = 0; column < targets.checkerboard_columns; ++column) {
      points_mm.emplace_back(
          static_cast<float>((column - 0.5 * (targets.checkerboard_columns - 1)) *
                             targets.checkerboard_square_mm),
          static_cast<float>((0.5 * (targets.checkerboard_rows - 1) - row) *
                             targets.checkerboard_square_mm),
          0.0F);
    }
  }
  return points_mm;
}

CameraGeometry ToGeometry(const acquire::CameraInfo& info,
                          const cv::Matx33d& matrix,
                          const cv::Mat& distortion,
                          const std::pair<cv::Vec3d, cv::Vec3d>& pose) {
  cv::Matx33d rotation;
  cv::Rodrigues(pose.first, rotation);
  CameraGeometry camera;
  camera.width_px = info.width;
  camera.height_px = info.height;
  camera.fx_px = matrix(0, 0);
  camera.fy_px = matrix(1, 1);
  camera.cx_px = matrix(0, 2);
  camera.cy_px = matrix(1, 2);
  camera.k1 = distortion.at<double>(0);
  camera.k2 = distortion.at<double>(1);
  camera.p1 = distortion.at<double>(2);
  camera.p2 = distortion.at<double>(3);
  camera.k3 = distortion.at<double>(4);
  std::copy_n(rotation.val, 9, camera.camera_from_sample_rotation.begin());
  std::copy_n(pose.second.val, 3, camera.camera_from_sample_translation_mm.begin());
  return camera;
}

}  // namespace

GeometryResult EstimateGeometry(const acquire::SessionReader& session,
                                const ProgressFunction& progress) {
  const acquire::RigDescription& rig = session.rig();
  const Grey grey = GreyOf(session);
  std::vector<Corners> corners_px;
  for (std::int64_t number = 0; number < session.schedule().grid_begin(); ++number) {
    if (session.schedule()[number].target == acquire::Target::kCheckerboard) {
      corners_px.push_back(FindCorners(session, grey, number));
      Report(progress,
             {.stage = "geometry",
              .done = std::ssize(corners_px),
              .total = rig.targets.checkerboard_poses,
              .note = "checkerboard"});
    }
  }
  const std::vector<std::vector<cv::Point3f>> points_mm(corners_px.size(),
                                                        BoardPoints(rig.targets));
  const acquire::CameraInfo& info = session.manifest().camera;
  cv::Matx33d matrix = cv::Matx33d::eye();
  cv::Mat distortion;
  std::vector<cv::Vec3d> rotations;
  std::vector<cv::Vec3d> translations_mm;
  constexpr int kMaxIterations = 200;
  // k3 is left at 0: a few boards of moderate angle can't tell it from k2.
  cv::Mat intrinsics_sigma;
  cv::Mat extrinsics_sigma;
  cv::Mat view_errors;
  const internal::OneThreadAlgebra one_thread;
  const double rms_px = cv::calibrateCamera(
      points_mm,
      corners_px,
      cv::Size(info.width, info.height),
      matrix,
      distortion,
      rotations,
      translations_mm,
      intrinsics_sigma,
      extrinsics_sigma,
      view_errors,
      cv::CALIB_FIX_K3,
      cv::TermCriteria(cv::TermCriteria::COUNT | cv::TermCriteria::EPS,
                       kMaxIterations,
                       std::numeric_limits<double>::epsilon()));
  GeometryResult result;
  result.camera =
      ToGeometry(info, matrix, distortion, {rotations[0], translations_mm[0]});
  result.reprojection_rms_px = rms_px;
  const auto intrinsic = [&](int k) { return intrinsics_sigma.at<double>(k); };
  result.focal_sigma_px = std::max(intrinsic(0), intrinsic(1));
  result.centre_sigma_px = std::max(intrinsic(2), intrinsic(3));
  constexpr int kHeight = 5;  // three angles and x, y come before z, pose 0 first
  result.height_sigma_mm = extrinsics_sigma.at<double>(kHeight);
  for (std::size_t pose = 0; pose < corners_px.size(); ++pose) {
    std::vector<cv::Point2f> projected;
    cv::projectPoints(points_mm[pose],
                      rotations[pose],
                      translations_mm[pose],
                      matrix,
                      distortion,
                      projected);
    for (std::size_t k = 0; k < projected.size(); ++k) {
      const cv::Point2f off = corners_px[pose][k] - projected[k];
      result.residuals.push_back(
          {{static_cast<double>(corners_px[pose][k].x),
            static_cast<double>(corners_px[pose][k].y)},
           {static_cast<double>(off.x), static_cast<double>(off.y)}});
    }
  }
  return result;
}

}  // namespace nacre::calibrate
