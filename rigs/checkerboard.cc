#include "rigs/checkerboard.h"

#include "core/parallel.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace nacre::rigs {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

// The rotation by `angle` about the unit vector `axis` [Rodrigues].
std::array<Vector3, 3> RotationAbout(const Vector3& axis, double angle) {
  const double c = std::cos(angle);
  const double s = std::sin(angle);
  const auto [x, y, z] = axis;
  const double t = 1 - c;
  return {{{t * x * x + c, t * x * y - s * z, t * x * z + s * y},
           {t * x * y + s * z, t * y * y + c, t * y * z - s * x},
           {t * x * z - s * y, t * y * z + s * x, t * z * z + c}}};
}

// Of a pixel that sees an edge.
template <class ReflectanceAt>
double MeanOverPixel(ReflectanceAt&& reflectance_at) {
  constexpr int kSamples = 8;  // a side
  double sum = 0;
  for (int b = 0; b < kSamples; ++b) {
    for (int a = 0; a < kSamples; ++a) {
      sum += reflectance_at((a + 0.5) / kSamples - 0.5, (b + 0.5) / kSamples - 0.5);
    }
  }
  return sum / (kSamples * kSamples);
}

}  // namespace

double CheckerboardModel::ReflectanceAt(PointMm point) const {
  const double half_width = 0.5 * (columns + 1) * square_mm;
  const double half_height = 0.5 * (rows + 1) * square_mm;
  const double beyond =
      std::max(std::abs(point.x) - half_width, std::abs(point.y) - half_height);
  if (beyond > square_mm) {
    return table_reflectance;
  }
  if (beyond > 0) {
    return white_reflectance;
  }
  const auto column = static_cast<int>((point.x + half_width) / square_mm);
  const auto row = static_cast<int>((half_height - point.y) / square_mm);
  return (column + row) % 2 == 0 ? black_reflectance : white_reflectance;
}

Placement BoardPlacement(int pose) {
  if (pose == 0) {
    return {};
  }
  // The golden angle spreads directions evenly, however many poses there are.
  constexpr double kGoldenAngle = 2.399963229728653;
  constexpr double kShiftMm = 5;
  constexpr double kMostLiftMm = 6;
  const double direction = kGoldenAngle * pose;
  const double part = pose * (std::numbers::phi - 1) -
                      std::floor(pose * (std::numbers::phi - 1));  // in [0, 1)
  const double tilt = (20 + 10 * part) * kDegree;
  const double turn = 12 * kDegree * std::sin(1.7 * pose);
  Placement tilted;
  tilted.rotation = RotationAbout({std::cos(direction), std::sin(direction), 0}, tilt);
  tilted.translation_mm = {kShiftMm * std::cos(3 * direction),
                           kShiftMm * std::sin(3 * direction),
                           kMostLiftMm * part};
  Placement turned;
  turned.rotation = RotationAbout({0, 0, 1}, turn);
  return tilted * turned;
}

std::vector<float> ViewCheckerboard(const CheckerboardModel& board,
                                    const PlaneMap& rays,
                                    const Placement& camera_from_board,
                                    int thread_count) {
  const PlaneMap map = MapPlane(rays, camera_from_board);
  std::vector<float> image(map.x.size());
  ParallelFor(map.height, thread_count, [&](std::int64_t row_index) {
    const int row = static_cast<int>(row_index);
    const auto reflectance = [&](int column, double du, double dv) {
      return board.ReflectanceAt(map.At(column, row, du, dv));
    };
    for (int column = 0; column < map.width; ++column) {
      const double centre = reflectance(column, 0, 0);
      const bool is_plain = centre == reflectance(column, -0.5, -0.5) &&
                            centre == reflectance(column, 0.5, -0.5) &&
                            centre == reflectance(column, -0.5, 0.5) &&
                            centre == reflectance(column, 0.5, 0.5);
      const double mean = is_plain ? centre : MeanOverPixel([&](double du, double dv) {
        return reflectance(column, du, dv);
      });
      image[map.Index(column, row)] = static_cast<float>(mean);
    }
  });
  return image;
}

}  // namespace nacre::rigs
