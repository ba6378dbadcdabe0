#include "render/texture.h"

#include "core/error.h"

#include <cmath>

namespace nacre::render {
namespace {

Color MaxOf(Color a, Color b) {
  return {std::max(a.x, b.x), std::max(a.y, b.y), std::max(a.z, b.z)};
}

class ConstantTexture : public Texture {
 public:
  explicit ConstantTexture(Color value) : value_(value) {}
  Color At(Vec2) const override { return value_; }
  Color Mean() const override { return value_; }
  Color Max() const override { return value_; }
  bool IsConstant() const override { return true; }

 private:
  Color value_;
};

class ProductTexture : public Texture {
 public:
  ProductTexture(TexturePtr a, TexturePtr b) : a_(std::move(a)), b_(std::move(b)) {}
  Color At(Vec2 uv) const override { return a_->At(uv) * b_->At(uv); }
  Color Mean() const override { return a_->Mean() * b_->Mean(); }
  Color Max() const override { return a_->Max() * b_->Max(); }
  float Aspect() const override { return a_->Aspect(); }

 private:
  TexturePtr a_;
  TexturePtr b_;
};

class ComplementTexture : public Texture {
 public:
  explicit ComplementTexture(TexturePtr a) : a_(std::move(a)) {}
  Color At(Vec2 uv) const override { return Color{1, 1, 1} - a_->At(uv); }
  Color Mean() const override { return Color{1, 1, 1} - a_->Mean(); }
  Color Max() const override { return {1, 1, 1}; }

 private:
  TexturePtr a_;
};

class CheckerboardTexture : public Texture {
 public:
  CheckerboardTexture(Color color0, Color color1, const UvMap& map)
      : color0_(color0), color1_(color1), map_(map) {}
  Color At(Vec2 uv) const override {
    const Vec2 p = map_(uv);
    // Parity in floating point: no integer that a huge uv could overflow.
    const float sum = std::floor(2 * p.x) + std::floor(2 * p.y);
    return sum - 2 * std::floor(0.5F * sum) < 0.5F ? color0_ : color1_;
  }
  Color Mean() const override { return 0.5F * (color0_ + color1_); }
  Color Max() const override { return MaxOf(color0_, color1_); }

 private:
  Color color0_;
  Color color1_;
  UvMap map_;
};

class BitmapTexture : public Texture {
 public:
  BitmapTexture(Bitmap bitmap, const BitmapOptions& options)
      : bitmap_(std::move(bitmap)), options_(options) {
    double sum[3] = {0, 0, 0};
    for (const Color& c : bitmap_.pixels) {
      sum[0] += static_cast<double>(c.x);
      sum[1] += static_cast<double>(c.y);
      sum[2] += static_cast<double>(c.z);
      max_ = MaxOf(max_, c);
    }
    const double n = static_cast<double>(bitmap_.pixels.size());
    mean_ = {static_cast<float>(sum[0] / n),
             static_cast<float>(sum[1] / n),
             static_cast<float>(sum[2] / n)};
  }

  Color At(Vec2 uv) const override {
    const Vec2 p = options_.map(uv);
    const float x = p.x * static_cast<float>(bitmap_.width);
    const float y = (1 - p.y) * static_cast<float>(bitmap_.height);
    if (options_.nearest) {
      return Pixel(std::floor(x), std::floor(y));
    }
    const float x0 = std::floor(x - 0.5F);
    const float y0 = std::floor(y - 0.5F);
    const float fx = x - 0.5F - x0;
    const float fy = y - 0.5F - y0;
    return (1 - fy) * ((1 - fx) * Pixel(x0, y0) + fx * Pixel(x0 + 1, y0)) +
           fy * ((1 - fx) * Pixel(x0, y0 + 1) + fx * Pixel(x0 + 1, y0 + 1));
  }

  Color Mean() const override { return mean_; }
  Color Max() const override { return max_; }
  float Aspect() const override {
    return static_cast<float>(bitmap_.width) / static_cast<float>(bitmap_.height);
  }

 private:
  // The index in [0, size) of coordinate i; −1: nothing there, −2: white there.
  static int Wrap(float i, int size, WrapMode mode) {
    const float n = static_cast<float>(size);
    const auto modulo = [&](float period) {
      return std::clamp(i - std::floor(i / period) * period, 0.0F, period - 1);
    };
    switch (mode) {
      case WrapMode::kRepeat:
        return static_cast<int>(modulo(n));
      case WrapMode::kMirror: {
        const float m = modulo(2 * n);
        return static_cast<int>(m < n ? m : 2 * n - 1 - m);
      }
      case WrapMode::kClamp:
        return static_cast<int>(std::clamp(i, 0.0F, n - 1));
      case WrapMode::kZero:
        return i >= 0 && i < n ? static_cast<int>(i) : -1;
      case WrapMode::kOne:
        return i >= 0 && i < n ? static_cast<int>(i) : -2;
    }
    throw LogicError("unknown wrap mode");
  }

  Color Pixel(float x, float y) const {
    const int column = Wrap(x, bitmap_.width, options_.wrap_u);
    const int row = Wrap(y, bitmap_.height, options_.wrap_v);
    if (column < 0 || row < 0) {
      const float outside = column == -2 || row == -2 ? 1.0F : 0.0F;
      return {outside, outside, outside};
    }
    return bitmap_.pixels[static_cast<std::size_t>(row) *
                              static_cast<std::size_t>(bitmap_.width) +
                          static_cast<std::size_t>(column)];
  }

  Bitmap bitmap_;
  BitmapOptions options_;
  Color mean_;
  Color max_;
};

}  // namespace

TexturePtr MakeConstant(Color value) {
  return std::make_shared<ConstantTexture>(value);
}

TexturePtr MakeProduct(TexturePtr a, TexturePtr b) {
  if (a->IsConstant() && b->IsConstant()) {
    return MakeConstant(a->Mean() * b->Mean());
  }
  return std::make_shared<ProductTexture>(std::move(a), std::move(b));
}

TexturePtr MakeComplement(TexturePtr a) {
  if (a->IsConstant()) {
    return MakeConstant(Color{1, 1, 1} - a->Mean());
  }
  return std::make_shared<ComplementTexture>(std::move(a));
}

TexturePtr MakeCheckerboard(Color color0, Color color1, const UvMap& map) {
  return std::make_shared<CheckerboardTexture>(color0, color1, map);
}

TexturePtr MakeBitmap(Bitmap bitmap, const BitmapOptions& options) {
  Expect(bitmap.width > 0 && bitmap.height > 0 &&
             bitmap.pixels.size() == static_cast<std::size_t>(bitmap.width) *
                                         static_cast<std::size_t>(bitmap.height),
         "a bitmap with all its pixels");
  return std::make_shared<BitmapTexture>(std::move(bitmap), options);
}

}  // namespace nacre::render
