#include "calibrate/laser_map.h"
#include "core/error.h"

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <cmath>
#include <utility>

namespace nacre::calibrate {
namespace {

// A spot has several pixels once smoothed; less is noise.
constexpr int kMinAreaPx = 4;

struct Blob {
  PixelPoint centre;
  double radius_px = 0;  // of the disc of the same area
};

// Connected regions above `threshold`.
std::vector<Blob> FindBlobs(const cv::Mat& smooth, double threshold) {
  const cv::Mat bright = smooth > threshold;
  cv::Mat labels;
  cv::Mat statistics;
  cv::Mat centroids;
  const int label_count =
      cv::connectedComponentsWithStats(bright, labels, statistics, centroids);
  std::vector<Blob> blobs;
  for (int label = 1; label < label_count; ++label) {  // 0 is the ground
    const int area_px = statistics.at<int>(label, cv::CC_STAT_AREA);
    if (area_px >= kMinAreaPx) {
      blobs.push_back({{centroids.at<double>(label, 0), centroids.at<double>(label, 1)},
                       std::sqrt(area_px / CV_PI)});
    }
  }
  return blobs;
}

// The centre of gravity of the signal in a disc around `blob`, moved along until it
// rests. What is left of the ground, the median on the disc's rim, is taken off.
PixelPoint Centroid(const cv::Mat& signal, const Blob& blob, double radius_px) {
  PixelPoint centre = blob.centre;
  constexpr int kRounds = 5;
  for (int round = 0; round < kRounds; ++round) {
    const int left = std::max(0, static_cast<int>(std::floor(centre.x - radius_px)));
    const int top = std::max(0, static_cast<int>(std::floor(centre.y - radius_px)));
    const int right =
        std::min(signal.cols - 1, static_cast<int>(std::ceil(centre.x + radius_px)));
    const int bottom =
        std::min(signal.rows - 1, static_cast<int>(std::ceil(centre.y + radius_px)));
    std::vector<float> rim;
    for (int y = top; y <= bottom; ++y) {
      for (int x = left; x <= right; ++x) {
        const double r = std::hypot(x - centre.x, y - centre.y);
        if (r <= radius_px && r > radius_px - 1.5) {
          rim.push_back(signal.at<float>(y, x));
        }
      }
    }
    const auto middle = rim.begin() + std::ssize(rim) / 2;
    std::nth_element(rim.begin(), middle, rim.end());
    const double ground = rim.empty() ? 0 : static_cast<double>(*middle);
    double sum = 0;
    double sum_x = 0;
    double sum_y = 0;
    for (int y = top; y <= bottom; ++y) {
      for (int x = left; x <= right; ++x) {
        // The disc's edge is soft over a pixel, so that the sum moves smoothly with it.
        const double inside = std::clamp(
            radius_px + 0.5 - std::hypot(x - centre.x, y - centre.y), 0., 1.);
        const double weight =
            inside * (static_cast<double>(signal.at<float>(y, x)) - ground);
        sum += weight;
        sum_x += weight * x;
        sum_y += weight * y;
      }
    }
    if (!(sum > 0)) {
      return blob.centre;
    }
    centre = {sum_x / sum, sum_y / sum};
  }
  return centre;
}

double ClosestPair(const std::vector<Blob>& blobs) {
  double closest = HUGE_VAL;
  for (std::size_t a = 0; a < blobs.size(); ++a) {
    for (std::size_t b = 0; b < a; ++b) {
      closest = std::min(closest,
                         std::hypot(blobs[a].centre.x - blobs[b].centre.x,
                                    blobs[a].centre.y - blobs[b].centre.y));
    }
  }
  return closest;
}

}  // namespace

std::vector<PixelPoint> FindSpots(
    const std::vector<float>& signal, int width, int height, int count, int missing) {
  Expect(signal.size() ==
             static_cast<std::size_t>(width) * static_cast<std::size_t>(height),
         "width * height values");
  const cv::Mat picture(height, width, CV_32FC1, const_cast<float*>(signal.data()));
  cv::Mat smooth;
  // A spot may be sharper than a pixel: smoothing gives it a size, and tames noise.
  cv::GaussianBlur(picture, smooth, cv::Size(), 1.0);
  double brightest = 0;
  cv::minMaxLoc(smooth, nullptr, &brightest);
  // Spots of one channel differ little, so that one of these levels parts them all from
  // the ground and from each other.
  std::vector<Blob> best;
  for (const double fraction : {0.25, 0.4, 0.15, 0.55, 0.08}) {
    std::vector<Blob> blobs = FindBlobs(smooth, fraction * brightest);
    if (best.empty() ||
        std::abs(std::ssize(blobs) - count) < std::abs(std::ssize(best) - count)) {
      best = std::move(blobs);
    }
  }
  std::vector<PixelPoint> spots;
  if (best.empty() || std::abs(std::ssize(best) - count) > missing) {
    return spots;
  }
  // A blob's edge lies at 1.1 to 2.2 standard deviations of a Gaussian spot, so that
  // twice as far holds nearly all of it, and little noise besides.
  const double reach_px = 0.45 * ClosestPair(best);
  for (const Blob& blob : best) {
    spots.push_back(
        Centroid(picture, blob, std::min(reach_px, 2 * blob.radius_px + 1)));
  }
  return spots;
}

}  // namespace nacre::calibrate
