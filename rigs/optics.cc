#include "rigs/optics.h"

#include "core/parallel.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <tuple>
#include <utility>

namespace nacre::rigs {
namespace {

struct Picture {
  int width = 0;
  int height = 0;
  std::vector<float> values;

  Picture(int w, int h)
      : width(w),
        height(h),
        values(static_cast<std::size_t>(w) * static_cast<std::size_t>(h), 0.0F) {}
  float* Row(int y) {
    return &values[static_cast<std::size_t>(y) * static_cast<std::size_t>(width)];
  }
  const float* Row(int y) const {
    return &values[static_cast<std::size_t>(y) * static_cast<std::size_t>(width)];
  }
};

// Half of a normalised kernel, from its middle on.
std::vector<float> GaussianTaps(double sigma) {
  constexpr double kFarthest = 4.5;
  const int reach = std::max(1, static_cast<int>(std::ceil(kFarthest * sigma)));
  std::vector<double> taps;
  double sum = 0;
  for (int k = 0; k <= reach; ++k) {
    taps.push_back(std::exp(-0.5 * k * k / (sigma * sigma)));
    sum += (k == 0 ? 1 : 2) * taps.back();
  }
  std::vector<float> half;
  half.reserve(taps.size());
  for (const double tap : taps) {
    half.push_back(static_cast<float>(tap / sum));
  }
  return half;
}

// out += weight · in, of the part of `in` that is shifted into view.
void AddShifted(const float* in, float weight, int count, int shift, float* out) {
  const int begin = std::max(0, -shift);
  const int end = std::min(count, count - shift);
  for (int k = begin; k < end; ++k) {
    out[k] += weight * in[k + shift];
  }
}

// Along both axes; what leaves the picture is lost.
Picture Blur(const Picture& in, double sigma, int thread_count) {
  const std::vector<float> taps = GaussianTaps(sigma);
  const int reach = static_cast<int>(std::ssize(taps)) - 1;
  Picture across(in.width, in.height);
  Picture out(in.width, in.height);
  ParallelForBlocks(in.height, 16, thread_count, [&](auto begin, auto end) {
    for (int y = static_cast<int>(begin); y < static_cast<int>(end); ++y) {
      for (int k = -reach; k <= reach; ++k) {
        const float weight = taps[static_cast<std::size_t>(std::abs(k))];
        AddShifted(in.Row(y), weight, in.width, k, across.Row(y));
      }
    }
  });
  ParallelForBlocks(in.height, 16, thread_count, [&](auto begin, auto end) {
    for (int y = static_cast<int>(begin); y < static_cast<int>(end); ++y) {
      for (int k = std::max(-reach, -y); k <= std::min(reach, in.height - 1 - y); ++k) {
        const float weight = taps[static_cast<std::size_t>(std::abs(k))];
        AddShifted(across.Row(y + k), weight, in.width, 0, out.Row(y));
      }
    }
  });
  return out;
}

// Sums over boxes of factor × factor pixels.
Picture Shrink(const Picture& in, int factor) {
  Picture out((in.width + factor - 1) / factor, (in.height + factor - 1) / factor);
  for (int y = 0; y < in.height; ++y) {
    const float* from = in.Row(y);
    float* to = out.Row(y / factor);
    for (int x = 0; x < in.width; ++x) {
      to[x / factor] += from[x];
    }
  }
  return out;
}

// Adds the density that a shrunk picture stands for, bilinear between its boxes.
void AddGrown(const Picture& in, int factor, double weight, Picture& out) {
  const double scale = weight / (static_cast<double>(factor) * factor);
  const auto place = [&](int pixel, int count) {
    const double at = (pixel + 0.5) / factor - 0.5;
    const double low = std::floor(at);
    const int a = std::clamp(static_cast<int>(low), 0, count - 1);
    const int b = std::clamp(static_cast<int>(low) + 1, 0, count - 1);
    return std::tuple(a, b, static_cast<float>(at - low));
  };
  for (int y = 0; y < out.height; ++y) {
    const auto [top, bottom, down] = place(y, in.height);
    float* to = out.Row(y);
    for (int x = 0; x < out.width; ++x) {
      const auto [left, right, across] = place(x, in.width);
      const float upper =
          in.Row(top)[left] + across * (in.Row(top)[right] - in.Row(top)[left]);
      const float lower = in.Row(bottom)[left] +
                          across * (in.Row(bottom)[right] - in.Row(bottom)[left]);
      to[x] += static_cast<float>(scale) * (upper + down * (lower - upper));
    }
  }
}

// The largest power of two that leaves a halo four boxes a standard deviation.
int ShrinkFactor(double sigma_px) {
  int factor = 1;
  while (8 * factor <= sigma_px) {
    factor *= 2;
  }
  return factor;
}

// The mean along the picture's rim.
float RimMean(const std::vector<float>& picture, int width, int height) {
  double sum = 0;
  const auto add = [&](int x, int y) {
    sum += static_cast<double>(
        picture[static_cast<std::size_t>(std::int64_t{y} * width + x)]);
  };
  for (int x = 0; x < width; ++x) {
    add(x, 0);
    add(x, height - 1);
  }
  for (int y = 1; y + 1 < height; ++y) {
    add(0, y);
    add(width - 1, y);
  }
  return static_cast<float>(sum / (2.0 * width + 2.0 * (height - 2)));
}

}  // namespace

Optics::Optics(const OpticsModel& model, int width_px, int height_px, int thread_count)
    : model_(model), width_(width_px), height_(height_px), thread_count_(thread_count) {
  if (model.vignetting > 0) {
    const double half_x = 0.5 * width_px;
    const double half_y = 0.5 * height_px;
    const double corner2 = half_x * half_x + half_y * half_y;
    for (int y = 0; y < height_px; ++y) {
      for (int x = 0; x < width_px; ++x) {
        const double dx = x + 0.5 - half_x * (1 + model.vignetting_shift);
        const double dy = y + 0.5 - half_y;
        const double loss = model.vignetting * (dx * dx + dy * dy) / corner2;
        vignetting_.push_back(static_cast<float>(std::max(0.0, 1 - loss)));
      }
    }
  }
  if (model.glare_fraction > 0) {
    double sum = 0;
    double weight = 1;
    const double widest_px = 0.25 * std::min(width_px, height_px);
    double sigma = model.glare_radius_px;
    do {
      halos_.push_back({sigma, weight});
      sum += weight;
      weight *= std::exp2(-model.glare_falloff);
      sigma *= 2;
    } while (sigma <= widest_px);
    for (Halo& halo : halos_) {
      halo.weight *= model.glare_fraction / sum;
    }
  }
}

void Optics::Apply(std::vector<float>& picture) const {
  for (std::size_t k = 0; k < vignetting_.size(); ++k) {
    picture[k] *= vignetting_[k];
  }
  if (model_.defocus_sigma_px <= 0 && halos_.empty()) {
    return;
  }
  // A card or a lit room goes on beyond the picture: blur and scatter what differs from
  // the rim.
  const float ground = RimMean(picture, width_, height_);
  Picture sharp(width_, height_);
  for (std::size_t k = 0; k < picture.size(); ++k) {
    sharp.values[k] = picture[k] - ground;
  }
  Picture result = model_.defocus_sigma_px > 0
                       ? Blur(sharp, model_.defocus_sigma_px, thread_count_)
                       : sharp;
  const auto kept = static_cast<float>(1 - model_.glare_fraction);
  for (float& value : result.values) {
    value *= kept;
  }
  for (const Halo& halo : halos_) {
    const int factor = ShrinkFactor(halo.sigma_px);
    // Boxes and the tent between them widen the halo by f² (1/12 + 1/6).
    const double sigma =
        std::sqrt(halo.sigma_px * halo.sigma_px / (factor * factor) - 0.25);
    AddGrown(Blur(factor == 1 ? sharp : Shrink(sharp, factor),
                  factor == 1 ? halo.sigma_px : sigma,
                  thread_count_),
             factor,
             halo.weight,
             result);
  }
  for (std::size_t k = 0; k < picture.size(); ++k) {
    picture[k] = result.values[k] + ground;
  }
}

double Optics::GlareDensity(double distance_px) const {
  double density = 0;
  for (const Halo& halo : halos_) {
    const double s2 = halo.sigma_px * halo.sigma_px;
    density += halo.weight / (2 * std::numbers::pi * s2) *
               std::exp(-0.5 * distance_px * distance_px / s2);
  }
  return density;
}

}  // namespace nacre::rigs
