#pragma once

#include "factor/material.h"
#include "render/subsurface/dipole_profile.h"

#include <array>
#include <cmath>
#include <memory>
#include <vector>

namespace nacre::render {

/// Mean of R_d over the cell of side `pitch_mm` centred on (x, y).
inline double CellMean(const DipoleProfile& profile,
                       double x_mm,
                       double y_mm,
                       double pitch_mm) {
  const double nearest = std::hypot(x_mm, y_mm);
  const int steps = nearest < 3 * pitch_mm ? 40 : 4;
  double sum = 0;
  for (int j = 0; j < steps; ++j) {
    for (int i = 0; i < steps; ++i) {
      sum += profile.Rd(std::hypot(x_mm + ((i + 0.5) / steps - 0.5) * pitch_mm,
                                   y_mm + ((j + 0.5) / steps - 0.5) * pitch_mm));
    }
  }
  return sum / (steps * steps);
}

struct MaterialShape {
  int points = 4;
  int core = 39;
  double pitch_mm = 1;
};

/// Fills in albedo from the windows.
inline void SetAlbedo(factor::Material& m) {
  std::vector<float> window(static_cast<std::size_t>(m.WindowSize()));
  m.albedo.assign(m.channels.size() * static_cast<std::size_t>(m.PointCount()), 0);
  for (int c = 0; c < static_cast<int>(m.channels.size()); ++c) {
    for (int j = 0; j < m.points_y; ++j) {
      for (int i = 0; i < m.points_x; ++i) {
        m.EvaluateWindow(c, i, j, window.data());
        double sum = 0;
        for (const float value : window) {
          sum += static_cast<double>(value);
        }
        m.albedo[static_cast<std::size_t>(c * m.PointCount() +
                                          std::int64_t{j} * m.points_x + i)] =
            static_cast<float>(sum * m.pitch_mm * m.pitch_mm);
      }
    }
  }
}

/// A material of one linear term: kernels given a channel, factors f = 1.
inline factor::Material OneTermMaterial(const MaterialShape& shape, int channel_count) {
  factor::Material m;
  m.points_x = shape.points;
  m.points_y = shape.points;
  m.core = shape.core;
  m.pitch_mm = shape.pitch_mm;
  m.eta = 1.5;
  const std::array<const char*, 3> names{"R", "G", "B"};
  for (int c = 0; c < channel_count; ++c) {
    m.channels.emplace_back(names[static_cast<std::size_t>(c % 3)]);
  }
  m.method = "svd";
  m.transform = factor::Transform::kLinear;
  m.terms = 1;
  const auto channels = static_cast<std::size_t>(channel_count);
  const auto points = static_cast<std::size_t>(m.PointCount());
  m.a.assign(channels, 1);
  m.b.assign(channels, 1);
  m.f.assign(channels * points, 1);
  m.h.assign(channels * static_cast<std::size_t>(m.WindowSize()), 0);
  m.cluster.assign(points, 0);
  m.row_scale.assign(channels * points, 1);
  m.provenance = "{}";
  return m;
}

/// The dataset that a homogeneous medium would give, scaled so that nothing is lost
/// beyond the core.
inline std::shared_ptr<const factor::Material> DipoleMaterial(
    const std::array<DipoleProfile, 3>& profiles, const MaterialShape& shape) {
  factor::Material m = OneTermMaterial(shape, 3);
  const int radius = shape.core / 2;
  const double area = shape.pitch_mm * shape.pitch_mm;
  for (std::size_t c = 0; c < 3; ++c) {
    float* kernel = &m.h[c * static_cast<std::size_t>(m.WindowSize())];
    double sum = 0;
    for (int v = 0; v < shape.core; ++v) {
      for (int u = 0; u < shape.core; ++u) {
        const double mean = CellMean(profiles[c],
                                     (u - radius) * shape.pitch_mm,
                                     (radius - v) * shape.pitch_mm,
                                     shape.pitch_mm);
        kernel[v * shape.core + u] = static_cast<float>(mean);
        sum += mean * area;
      }
    }
    for (std::int64_t n = 0; n < m.WindowSize(); ++n) {
      kernel[n] *= static_cast<float>(profiles[c].Total() / sum);
    }
  }
  SetAlbedo(m);
  return std::make_shared<const factor::Material>(std::move(m));
}

}  // namespace nacre::render
