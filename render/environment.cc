#include "render/environment.h"

#include "core/error.h"
#include "render/warp.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace nacre::render {
namespace {

// The entry of a cumulative table that u falls into, and where within it.
struct Choice {
  std::size_t index;
  float within;
  float probability;
};
Choice Choose(const float* cumulative, std::size_t count, float u) {
  const float* found = std::upper_bound(cumulative, cumulative + count - 1, u);
  const auto index = static_cast<std::size_t>(found - cumulative);
  const float before = index > 0 ? cumulative[index - 1] : 0;
  const float probability = std::max(cumulative[index] - before, 1e-30F);
  return {index, std::clamp((u - before) / probability, 0.0F, 0.999999F), probability};
}

}  // namespace

Environment::Environment(Bitmap picture, const Frame& axes, float scale)
    : width_(static_cast<std::size_t>(picture.width)),
      height_(static_cast<std::size_t>(picture.height)),
      pixels_(std::move(picture.pixels)),
      axes_(axes) {
  Expect(width_ > 0 && height_ > 0 && pixels_.size() == width_ * height_,
         "an environment with all its pixels");
  for (Color& pixel : pixels_) {
    pixel *= scale;
  }
  // A pixel's weight is that of its neighbourhood, since it is interpolated: nowhere
  // may there be light without a chance to be found.
  std::vector<double> weights(pixels_.size());
  std::vector<double> row_weights(height_);
  double total = 0;
  double area = 0;
  std::array<double, 3> mean{};
  for (std::size_t row = 0; row < height_; ++row) {
    const double sine = std::sin(std::numbers::pi * (static_cast<double>(row) + 0.5) /
                                 static_cast<double>(height_));
    for (std::size_t column = 0; column < width_; ++column) {
      double sum = 0;
      for (int n = 0; n < 9; ++n) {
        sum += static_cast<double>(MaxComponent(Pixel(
            static_cast<int>(column) + n % 3 - 1, static_cast<int>(row) + n / 3 - 1)));
      }
      weights[row * width_ + column] = sum * sine;
      row_weights[row] += sum * sine;
      area += sine;
      for (int c = 0; c < 3; ++c) {
        mean[static_cast<std::size_t>(c)] +=
            sine * static_cast<double>(pixels_[row * width_ + column][c]);
      }
    }
    total += row_weights[row];
  }
  mean_ = {static_cast<float>(mean[0] / area),
           static_cast<float>(mean[1] / area),
           static_cast<float>(mean[2] / area)};
  double rows = 0;
  for (std::size_t row = 0; row < height_; ++row) {
    rows += total > 0 ? row_weights[row] / total : 1 / static_cast<double>(height_);
    rows_.push_back(static_cast<float>(rows));
    double columns = 0;
    for (std::size_t column = 0; column < width_; ++column) {
      columns += row_weights[row] > 0
                     ? weights[row * width_ + column] / row_weights[row]
                     : 1 / static_cast<double>(width_);
      columns_.push_back(static_cast<float>(columns));
    }
    columns_.back() = 1;
  }
  rows_.back() = 1;
}

// Around it goes on; beyond the poles it ends.
const Color& Environment::Pixel(int column, int row) const {
  const int width = static_cast<int>(width_);
  const int wrapped = ((column % width) + width) % width;
  const int clamped = std::clamp(row, 0, static_cast<int>(height_) - 1);
  return pixels_[static_cast<std::size_t>(clamped) * width_ +
                 static_cast<std::size_t>(wrapped)];
}

Vec2 Environment::PlaceOf(Vec3 direction) const {
  const Vec3 d = axes_.ToLocal(direction);
  const float around = std::atan2(d.x, -d.z) / (2 * kPi);
  return {around < 0 ? around + 1 : around,
          std::acos(std::clamp(d.y, -1.0F, 1.0F)) * kInvPi};
}

Color Environment::Radiance(Vec3 direction) const {
  const Vec2 place = PlaceOf(direction);
  const float x = place.x * static_cast<float>(width_) - 0.5F;
  const float y = place.y * static_cast<float>(height_) - 0.5F;
  const int column = static_cast<int>(std::floor(x));
  const int row = static_cast<int>(std::floor(y));
  const float across = x - std::floor(x);
  const float down = y - std::floor(y);
  return (Pixel(column, row) * (1 - across) + Pixel(column + 1, row) * across) *
             (1 - down) +
         (Pixel(column, row + 1) * (1 - across) + Pixel(column + 1, row + 1) * across) *
             down;
}

// Of a place in the unit square, per unit of its area.
float Environment::PlaceDensity(std::size_t column, std::size_t row) const {
  const float row_before = row > 0 ? rows_[row - 1] : 0;
  const float* columns = &columns_[row * width_];
  const float column_before = column > 0 ? columns[column - 1] : 0;
  return std::max(rows_[row] - row_before, 1e-30F) *
         std::max(columns[column] - column_before, 1e-30F) *
         static_cast<float>(width_ * height_);
}

Environment::Sample Environment::SampleDirection(Vec2 u) const {
  const Choice row = Choose(rows_.data(), height_, u.y);
  const Choice column = Choose(&columns_[row.index * width_], width_, u.x);
  const float theta =
      kPi * (static_cast<float>(row.index) + row.within) / static_cast<float>(height_);
  const float phi = 2 * kPi * (static_cast<float>(column.index) + column.within) /
                    static_cast<float>(width_);
  const float sine = std::max(std::sin(theta), 1e-6F);
  const Vec3 local{sine * std::sin(phi), std::cos(theta), -sine * std::cos(phi)};
  return {axes_.ToWorld(local),
          PlaceDensity(column.index, row.index) / (2 * kPi * kPi * sine)};
}

float Environment::Pdf(Vec3 direction) const {
  const Vec2 place = PlaceOf(direction);
  const auto column = std::min(
      width_ - 1, static_cast<std::size_t>(place.x * static_cast<float>(width_)));
  const auto row = std::min(
      height_ - 1, static_cast<std::size_t>(place.y * static_cast<float>(height_)));
  const float sine = std::max(std::sin(kPi * place.y), 1e-6F);
  return PlaceDensity(column, row) / (2 * kPi * kPi * sine);
}

}  // namespace nacre::render
