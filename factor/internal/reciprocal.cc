#include "factor/internal/reciprocal.h"

#include "core/simd_clones.h"
#include "factor/internal/reciprocal_taps.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
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
    return points_[static_cast<std::size_t>(std::int64_t{cell.y} * core_ + cell.x)];
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

// Of a map's value at a grid point, or at the nearest point there is.
std::size_t IndexIn(const Material& m, GridIndex point) {
  const int x = std::clamp(point.x + m.margin, 0, m.MapWidth() - 1);
  const int y = std::clamp(point.y + m.margin, 0, m.MapHeight() - 1);
  return static_cast<std::size_t>(std::int64_t{y} * m.MapWidth() + x);
}

// Whether the point that a window is around is the first of its pair with a cell.
bool IsFirst(const Material& m, std::int64_t cell) {
  return cell <= (m.WindowSize() - 1) / 2;
}

// What kernels multiply, at the cells around a grid point.
class Features {
 public:
  Features(const Material& m, GridIndex point)
      : m_(m),
        taps_(WindowTaps::Of(m)),
        point_(point),
        here_(Maps(point)),
        values_(static_cast<std::size_t>(ReciprocalKernelCount(m.terms, m.taps) +
                                         m.rest)) {}

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
      const std::size_t at = IndexIn(m_, {point_.x + tap.dx, point_.y + tap.dy});
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
    const GridIndex first =
        IsFirst(m_, std::int64_t{cell.y} * m_.core + cell.x)
            ? point_
            : GridIndex{point_.x + cell.x - radius, point_.y + cell.y - radius};
    for (int k = 0; k < m_.rest; ++k) {
      values_[pair++] =
          static_cast<double>(m_.FactorMap(0, m_.terms + k)[IndexIn(m_, first)]);
    }
    return values_;
  }

  // What R_d is multiplied by for light that enters at the point itself.
  double Side(int channel, GridIndex cell) const {
    if (m_.sides == 0) {
      return 1;
    }
    const int radius = (m_.core - 1) / 2;
    const float* q = m_.FactorMap(0, m_.MapCount() - 1);
    const std::size_t there =
        IndexIn(m_, {point_.x + cell.x - radius, point_.y + cell.y - radius});
    const std::int64_t index = std::int64_t{cell.y} * m_.core + cell.x;
    const auto g = static_cast<double>(
        m_.Kernel(channel,
                  0,
                  m_.KernelCount() - 1)[std::min(index, m_.WindowSize() - 1 - index)]);
    return std::exp(std::clamp(g * (static_cast<double>(q[IndexIn(m_, point_)]) -
                                    static_cast<double>(q[there])),
                               -kMostSide,
                               kMostSide));
  }

 private:
  std::vector<double> Maps(GridIndex point) const {
    const std::size_t at = IndexIn(m_, point);
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

NACRE_AVX2_CLONES void AddWeighted(const float* kernel,
                                   const double* feature,
                                   std::size_t n,
                                   double* s) {
  for (std::size_t i = 0; i < n; ++i) {
    s[i] += static_cast<double>(kernel[i]) * feature[i];
  }
}

// The same for all cells of a window at once: each number comes of the same sums in the
// same order.
class WindowFeatures {
 public:
  WindowFeatures(const Material& m, GridIndex point)
      : m_(m),
        size_(static_cast<std::size_t>(m.WindowSize())),
        values_(size_ * static_cast<std::size_t>(
                            ReciprocalKernelCount(m.terms, m.taps) + m.rest),
                0.0) {
    const int radius = (m.core - 1) / 2;
    const std::size_t here = IndexIn(m, {point.x, point.y});
    std::fill_n(values_.begin(), size_, 1.0);
    std::vector<std::size_t> there(size_);
    const WindowTaps& taps = WindowTaps::Of(m);
    for (std::size_t n = 0; n < size_; ++n) {
      const auto cell = static_cast<int>(n);
      const GridIndex index{cell % m.core, cell / m.core};
      there[n] = IndexIn(m, {point.x + index.x - radius, point.y + index.y - radius});
      for (const TapPoint& tap : taps.At(index)) {
        const std::size_t at = IndexIn(m, {point.x + tap.dx, point.y + tap.dy});
        double* value = &values_[n + size_ * static_cast<std::size_t>(
                                                 TapKernel(m.terms, tap.tap, 0))];
        for (int j = 0; j < m.terms; ++j) {
          value[static_cast<std::size_t>(j) * size_] +=
              static_cast<double>(tap.weight) *
              static_cast<double>(m.FactorMap(0, j)[at]);
        }
      }
    }
    double* pair =
        &values_[size_ * static_cast<std::size_t>(PairKernel(m.terms, m.taps, 0, 0))];
    for (int j = 0; j < m.terms; ++j) {
      const float* f = m.FactorMap(0, j);
      const auto f_here = static_cast<double>(f[here]);
      double* ends = &values_[size_ * static_cast<std::size_t>(1 + j)];
      for (std::size_t n = 0; n < size_; ++n) {
        ends[n] = f_here + static_cast<double>(f[there[n]]);
      }
      for (int k = j; k < m.terms; ++k) {
        const float* g = m.FactorMap(0, k);
        const auto g_here = static_cast<double>(g[here]);
        for (std::size_t n = 0; n < size_; ++n) {
          *pair++ = f_here * static_cast<double>(g[there[n]]) +
                    g_here * static_cast<double>(f[there[n]]);
        }
      }
    }
    for (int k = 0; k < m.rest; ++k) {
      const float* u = m.FactorMap(0, m.terms + k);
      for (std::size_t n = 0; n < size_; ++n) {
        const bool is_first = IsFirst(m, static_cast<std::int64_t>(n));
        *pair++ = static_cast<double>(u[is_first ? here : there[n]]);
      }
    }
  }

  void Sum(int channel, double* s) const {
    std::fill_n(s, size_, 0.0);
    const std::size_t half = (size_ + 1) / 2;
    const int count = ReciprocalKernelCount(m_.terms, m_.taps) + m_.rest;
    std::vector<float> mirrored(half - 1);
    for (int k = 0; k < count; ++k) {
      const float* kernel = m_.Kernel(channel, 0, k);
      const double* values = &values_[static_cast<std::size_t>(k) * size_];
      std::reverse_copy(kernel, kernel + half - 1, mirrored.begin());
      AddWeighted(kernel, values, half, s);
      AddWeighted(mirrored.data(), values + half, half - 1, s + half);
    }
  }

 private:
  const Material& m_;
  std::size_t size_;
  std::vector<double> values_;  // [kernel][cell]
};

double Value(const Material& m,
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
  return m.a[static_cast<std::size_t>(channel)] * std::exp(std::min(s, kMostLog));
}

}  // namespace

float ReciprocalCell(const Material& m, int channel, GridIndex point, GridIndex cell) {
  Features features(m, point);
  return static_cast<float>(Value(m, channel, cell, features.At(cell)) *
                            features.Side(channel, cell));
}

void ReciprocalWindows(const Material& m,
                       GridIndex point,
                       int first_channel,
                       int channels,
                       float* windows) {
  const WindowFeatures features(m, point);
  const auto size = static_cast<std::size_t>(m.WindowSize());
  std::vector<double> s(size);
  Features one(m, point);
  for (int c = first_channel; c < first_channel + channels; ++c) {
    features.Sum(c, s.data());
    const double scale = m.a[static_cast<std::size_t>(c)];
    for (std::size_t n = 0; n < size; ++n) {
      const auto cell = static_cast<int>(n);
      *windows++ = static_cast<float>(scale * std::exp(std::min(s[n], kMostLog)) *
                                      one.Side(c, {cell % m.core, cell / m.core}));
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

void ScaledReciprocalWindows(const Material& m, GridIndex point, float* windows) {
  const auto channels = static_cast<int>(m.channels.size());
  ReciprocalWindows(m, point, 0, channels, windows);
  for (int c = 0; c < channels; ++c) {
    for (int v = 0; v < m.core; ++v) {
      for (int u = 0; u < m.core; ++u) {
        *windows++ *= PairScale(m, c, point, {u, v});
      }
    }
  }
}

}  // namespace nacre::factor::internal
