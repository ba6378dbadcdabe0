#include "factor/internal/reciprocal.h"

#include "factor/internal/reciprocal_taps.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace nacre::factor::internal {
namespace {

// The points that taps take, of all offsets of a window; those of the last window size
// and number of taps that a thread asked for are kept.
class WindowTaps {
 public:
  static const WindowTaps& Of(const Material& m) {
    thread_local WindowTaps kept;
    if (kept.core_ != m.core || kept.taps_ != m.taps) {
      kept = WindowTaps(m.core, m.taps);
    }
    return kept;
  }

  const std::vector<TapPoint>& At(GridIndex cell) const {
    return points_[static_cast<std::size_t>(cell.y * core_ + cell.x)];
  }

 private:
  WindowTaps() = default;
  WindowTaps(int core, int taps) : core_(core), taps_(taps) {
    const int radius = (core - 1) / 2;
    for (int v = -radius; v <= radius; ++v) {
      for (int u = -radius; u <= radius; ++u) {
        points_.push_back(TapPoints(u, v, taps));
      }
    }
  }

  int core_ = 0;
  int taps_ = 0;
  std::vector<std::vector<TapPoint>> points_;
};

// What kernels multiply, at the cells around a grid point.
class Features {
 public:
  Features(const Material& m, GridIndex point)
      : m_(m),
        taps_(WindowTaps::Of(m)),
        point_(point),
        here_(Maps(point)),
        values_(static_cast<std::size_t>(m.KernelCount())) {}

  const std::vector<double>& At(GridIndex cell) {
    const int radius = (m_.core - 1) / 2;
    const std::vector<double> there =
        Maps({point_.x + cell.x - radius, point_.y + cell.y - radius});
    std::fill(values_.begin(), values_.end(), 0.0);
    values_[0] = 1;
    for (int j = 0; j < m_.terms; ++j) {
      const auto n = static_cast<std::size_t>(j);
      values_[1 + n] = here_[n] + there[n];
    }
    for (const TapPoint& tap : taps_.At(cell)) {
      const std::size_t at = IndexOf({point_.x + tap.dx, point_.y + tap.dy});
      const auto first = static_cast<std::size_t>(TapKernel(m_.terms, tap.tap, 0));
      for (int j = 0; j < m_.terms; ++j) {
        values_[first + static_cast<std::size_t>(j)] +=
            static_cast<double>(tap.weight) *
            static_cast<double>(m_.FactorMap(0, j)[at]);
      }
    }
    auto pair = static_cast<std::size_t>(PairKernel(m_.terms, m_.taps, 0, 0));
    for (std::size_t j = 0; j < here_.size(); ++j) {
      for (std::size_t k = j; k < here_.size(); ++k) {
        values_[pair++] = here_[j] * there[k] + here_[k] * there[j];
      }
    }
    return values_;
  }

 private:
  std::size_t IndexOf(GridIndex point) const {
    const int x = std::clamp(point.x + m_.margin, 0, m_.MapWidth() - 1);
    const int y = std::clamp(point.y + m_.margin, 0, m_.MapHeight() - 1);
    return static_cast<std::size_t>(std::int64_t{y} * m_.MapWidth() + x);
  }

  std::vector<double> Maps(GridIndex point) const {
    const std::size_t at = IndexOf(point);
    std::vector<double> values(static_cast<std::size_t>(m_.terms));
    for (int j = 0; j < m_.terms; ++j) {
      values[static_cast<std::size_t>(j)] = static_cast<double>(m_.FactorMap(0, j)[at]);
    }
    return values;
  }

  const Material& m_;
  const WindowTaps& taps_;
  GridIndex point_;
  std::vector<double> here_;
  std::vector<double> values_;
};

float Value(const Material& m,
            int channel,
            GridIndex cell,
            const std::vector<double>& features) {
  const std::int64_t index = std::int64_t{cell.y} * m.core + cell.x;
  const float* kernel =
      m.Kernel(channel, 0, 0) + std::min(index, m.WindowSize() - 1 - index);
  double s = 0;
  for (const double feature : features) {
    s += static_cast<double>(*kernel) * feature;
    kernel += m.KernelSize();
  }
  return static_cast<float>(m.a[static_cast<std::size_t>(channel)] *
                            std::exp(std::min(s, kMostLog)));
}

}  // namespace

float ReciprocalCell(const Material& m, int channel, GridIndex point, GridIndex cell) {
  return Value(m, channel, cell, Features(m, point).At(cell));
}

void ReciprocalWindows(const Material& m,
                       GridIndex point,
                       int first_channel,
                       int channels,
                       float* windows) {
  Features features(m, point);
  for (int v = 0; v < m.core; ++v) {
    for (int u = 0; u < m.core; ++u) {
      const std::vector<double>& values = features.At({u, v});
      for (int c = 0; c < channels; ++c) {
        windows[c * m.WindowSize() + v * m.core + u] =
            Value(m, first_channel + c, {u, v}, values);
      }
    }
  }
}

float PairScale(const Material& m, int channel, GridIndex point, GridIndex cell) {
  const int radius = (m.core - 1) / 2;
  const float* scale = &m.row_scale[static_cast<std::size_t>(channel * m.PointCount())];
  const auto at = [&](int x, int y) { return scale[std::int64_t{y} * m.points_x + x]; };
  const int x = point.x + cell.x - radius;
  const int y = point.y + cell.y - radius;
  const bool on_grid = x >= 0 && y >= 0 && x < m.points_x && y < m.points_y;
  return at(point.x, point.y) * (on_grid ? at(x, y) : 1.0F);
}

}  // namespace nacre::factor::internal
