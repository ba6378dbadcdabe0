#pragma once

#include "render/vec.h"

#include <memory>
#include <string>
#include <vector>

namespace nacre::render {

/// A colour over the surface.
class Texture {
 public:
  virtual ~Texture() = default;
  virtual Color At(Vec2 uv) const = 0;
  /// Of all values, a channel; to choose between lobes and to check ranges.
  virtual Color Mean() const = 0;
  virtual Color Max() const = 0;
  /// Width / height of the picture, if it is one.
  virtual float Aspect() const { return 1; }
  virtual bool IsConstant() const { return false; }
};
using TexturePtr = std::shared_ptr<const Texture>;

/// uv' = u · along_u + v · along_v + offset, before the lookup.
struct UvMap {
  Vec2 along_u{1, 0};
  Vec2 along_v{0, 1};
  Vec2 offset{0, 0};
  Vec2 operator()(Vec2 uv) const {
    return {uv.x * along_u.x + uv.y * along_v.x + offset.x,
            uv.x * along_u.y + uv.y * along_v.y + offset.y};
  }
};

enum class WrapMode { kRepeat, kMirror, kClamp, kZero, kOne };

/// Linear RGB pixels, row 0 at the top.
struct Bitmap {
  int width = 0;
  int height = 0;
  std::vector<Color> pixels;
};

TexturePtr MakeConstant(Color value);

/// a · b, a channel.
TexturePtr MakeProduct(TexturePtr a, TexturePtr b);
/// 1 − a.
TexturePtr MakeComplement(TexturePtr a);

/// Two checks along each axis of the unit square, as in Mitsuba: `color0` where
/// ⌊2u⌋ + ⌊2v⌋ is even.
TexturePtr MakeCheckerboard(Color color0, Color color1, const UvMap& map);

struct BitmapOptions {
  UvMap map{};
  WrapMode wrap_u = WrapMode::kRepeat;
  WrapMode wrap_v = WrapMode::kRepeat;
  bool nearest = false;  ///< else bilinear
};

/// The top row of the picture is at v = 1, its left column at u = 0.
TexturePtr MakeBitmap(Bitmap bitmap, const BitmapOptions& options);

}  // namespace nacre::render
