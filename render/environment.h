#pragma once

#include "render/texture.h"
#include "render/vec.h"

#include <vector>

namespace nacre::render {

/// Light from infinitely far, by direction: a picture of longitude and polar angle. As
/// in Mitsuba, its top row is +y of its own frame, its left border −z, a quarter of the
/// way from there +x. Sampled by its brightness.
class Environment {
 public:
  /// `axes`: where x, y, z of the picture's frame point; `scale` multiplies.
  Environment(Bitmap picture, const Frame& axes, float scale);

  Color Radiance(Vec3 direction) const;

  struct Sample {
    Vec3 direction;
    float pdf;  ///< a steradian
  };
  Sample SampleDirection(Vec2 u) const;
  /// A steradian, of SampleDirection.
  float Pdf(Vec3 direction) const;

  /// Averaged over all directions.
  Color Mean() const { return mean_; }

 private:
  Vec2 PlaceOf(Vec3 direction) const;
  float PlaceDensity(std::size_t column, std::size_t row) const;
  const Color& Pixel(int column, int row) const;

  std::size_t width_;
  std::size_t height_;
  std::vector<Color> pixels_;
  Frame axes_;
  std::vector<float> rows_;     ///< cumulative, up to and with a row
  std::vector<float> columns_;  ///< cumulative in each row
  Color mean_;
};

}  // namespace nacre::render
