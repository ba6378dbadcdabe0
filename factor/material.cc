#include "factor/material.h"

#include "core/error.h"
#include "factor/internal/bilinear.h"
#include "factor/internal/profiles.h"
#include "factor/internal/reciprocal.h"
#include "factor/internal/reciprocal_taps.h"
#include "factor/internal/tucker.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>

namespace nacre::factor {
namespace {

// s = Σ_j f_j h_j to R_d, in double: exp of a sum of floats keeps a float's precision.
double Undo(const Material& material, int channel, double s) {
  if (material.transform == Transform::kLinear) {
    return s;
  }
  if (material.transform == Transform::kSqrt) {
    return s * std::abs(s);
  }
  const auto c = static_cast<std::size_t>(channel);
  // A (exp(s) − B) as A B expm1(s − ln B), which stays exact towards R_d = 0.
  return material.a[c] * material.b[c] * std::expm1(s - std::log(material.b[c]));
}

class Checker {
 public:
  explicit Checker(const std::string& origin) : origin_(origin) {}

  void Require(bool condition, const std::string& field, const std::string& found) {
    if (!condition) {
      throw BadData(fmt::format("{}: material: {}: {}", origin_, field, found));
    }
  }

  template <class T>
  void Size(const std::vector<T>& values, std::int64_t expected, const char* field) {
    Require(static_cast<std::int64_t>(values.size()) == expected,
            field,
            fmt::format("{} values where {} are expected", values.size(), expected));
  }

  template <class T>
  void Values(const std::vector<T>& values, double min, const char* field) {
    for (std::size_t n = 0; n < values.size(); ++n) {
      const auto value = static_cast<double>(values[n]);
      if (!std::isfinite(value) || value < min) {
        Require(false, field, fmt::format("value {} is {}", n, value));
      }
    }
  }

 private:
  const std::string& origin_;
};

}  // namespace

const char* Name(Transform transform) {
  switch (transform) {
    case Transform::kSqrt:
      return "sqrt";
    case Transform::kLog:
      return "log";
    case Transform::kLinear:
      break;
  }
  return "linear";
}

const char* Name(Form form) {
  switch (form) {
    case Form::kBilinear:
      return "bilinear";
    case Form::kReciprocal:
      return "reciprocal";
    case Form::kTucker:
      return "tucker";
    case Form::kProfiles:
      return "profiles";
    case Form::kSum:
      break;
  }
  return "sum";
}

int Material::KernelCount() const {
  switch (form) {
    case Form::kBilinear:
      return terms * (terms + 1) / 2;
    case Form::kReciprocal:
      return internal::ReciprocalKernelCount(terms, taps) + rest + sides;
    case Form::kTucker:
    case Form::kProfiles:
    case Form::kSum:
      break;
  }
  return terms;
}

float Material::Evaluate(int channel, int i, int j, int u, int v) const {
  if (form == Form::kReciprocal) {
    return internal::ReciprocalCell(*this, channel, {i, j}, {u, v}) *
           internal::PairScale(*this, channel, {i, j}, {u, v});
  }
  const std::int64_t point = std::int64_t{j} * points_x + i;
  const float scale =
      row_scale[static_cast<std::size_t>(channel * PointCount() + point)];
  if (form == Form::kBilinear) {
    return scale * internal::BilinearCell(*this, channel, {i, j}, {u, v});
  }
  if (form == Form::kTucker) {
    return scale * internal::TuckerCell(*this, channel, {i, j}, {u, v});
  }
  if (form == Form::kProfiles) {
    return scale * internal::ProfilesCell(*this, channel, {i, j}, {u, v});
  }
  const std::int64_t cell = std::int64_t{v} * core + u;
  const int k = cluster.empty() ? 0 : cluster[static_cast<std::size_t>(point)];
  double s = 0;
  for (int term = 0; term < terms; ++term) {
    s += static_cast<double>(FactorMap(channel, term)[point]) *
         static_cast<double>(Kernel(channel, k, term)[cell]);
  }
  return static_cast<float>(std::max(0.0, Undo(*this, channel, s))) * scale;
}

void Material::EvaluateWindow(int channel, int i, int j, float* window) const {
  EvaluateTerms(channel, i, j, terms, window);
  if (form == Form::kReciprocal) {
    for (int v = 0; v < core; ++v) {
      for (int u = 0; u < core; ++u) {
        window[v * core + u] *= internal::PairScale(*this, channel, {i, j}, {u, v});
      }
    }
    return;
  }
  const std::int64_t point = std::int64_t{j} * points_x + i;
  const float scale =
      row_scale[static_cast<std::size_t>(channel * PointCount() + point)];
  for (std::int64_t cell = 0; cell < WindowSize(); ++cell) {
    window[cell] *= scale;
  }
}

void Material::EvaluateTerms(
    int channel, int i, int j, int term_count, float* window) const {
  if (form == Form::kBilinear) {
    internal::BilinearWindow(*this, channel, {i, j}, window);
    return;
  }
  if (form == Form::kReciprocal) {
    internal::ReciprocalWindows(*this, {i, j}, channel, 1, window);
    return;
  }
  if (form == Form::kTucker) {
    internal::TuckerWindow(*this, channel, {i, j}, window);
    return;
  }
  if (form == Form::kProfiles) {
    internal::ProfilesWindow(*this, channel, {i, j}, window);
    return;
  }
  const std::int64_t point = std::int64_t{j} * points_x + i;
  const int k = cluster.empty() ? 0 : cluster[static_cast<std::size_t>(point)];
  std::vector<double> sum(static_cast<std::size_t>(WindowSize()), 0.0);
  for (int term = 0; term < term_count; ++term) {
    const auto weight = static_cast<double>(FactorMap(channel, term)[point]);
    const float* kernel = Kernel(channel, k, term);
    for (std::size_t cell = 0; cell < sum.size(); ++cell) {
      sum[cell] += weight * static_cast<double>(kernel[cell]);
    }
  }
  for (std::size_t cell = 0; cell < sum.size(); ++cell) {
    window[cell] = static_cast<float>(std::max(0.0, Undo(*this, channel, sum[cell])));
  }
}

std::int64_t Material::StorageBytes() const {
  return static_cast<std::int64_t>(sizeof(float) *
                                       (f.size() + h.size() + row_scale.size()) +
                                   (cluster_count > 1 ? cluster.size() : 0));
}

Material WithoutSides(Material m) {
  if (m.sides == 0) {
    return m;
  }
  const auto kept = static_cast<std::size_t>(m.KernelCount() - 1) *
                    static_cast<std::size_t>(m.KernelSize());
  std::vector<float> h;
  for (int c = 0; c < m.KernelSets(); ++c) {
    h.insert(h.end(), m.Kernel(c, 0, 0), m.Kernel(c, 0, 0) + kept);
  }
  m.h = std::move(h);
  const int maps = m.terms + m.rest;
  m.f.resize(static_cast<std::size_t>(maps * m.MapSize()));
  m.steps.f.resize(m.steps.empty() ? 0 : static_cast<std::size_t>(maps));
  m.sides = 0;
  return m;
}

void Validate(const Material& m, const std::string& origin) {
  Checker check(origin);
  const auto positive = [&](double value, const char* field) {
    check.Require(value > 0 && std::isfinite(value), field, fmt::format("{}", value));
  };
  positive(m.points_x, "points_x");
  positive(m.points_y, "points_y");
  positive(m.pitch_mm, "pitch_mm");
  positive(m.eta, "eta");
  check.Require(m.core > 0 && m.core % 2 == 1, "core", fmt::format("{}", m.core));
  check.Require(!m.channels.empty(), "channels", "there is none");
  check.Require(m.terms >= 1, "terms", fmt::format("{}", m.terms));
  check.Require(m.cluster_count >= 1 && m.cluster_count <= 256,
                "cluster_count",
                fmt::format("{}", m.cluster_count));
  const auto channels = static_cast<std::int64_t>(m.channels.size());
  check.Size(m.a, channels, "a");
  check.Size(m.b, channels, "b");
  for (std::size_t c = 0; c < m.channels.size(); ++c) {
    positive(m.a[c], "a");
    positive(m.b[c], "b");
  }
  check.Require(
      m.margin >= 0 && m.margin <= m.core, "margin", fmt::format("{}", m.margin));
  check.Require(
      m.taps >= 1 && m.taps <= internal::kMostTaps, "taps", fmt::format("{}", m.taps));
  if (m.form != Form::kSum) {
    check.Require(
        m.cluster_count == 1, "cluster_count", "only sums have more than one");
    check.Require(m.transform == Transform::kLinear,
                  "transform",
                  "only sums have another than the linear one");
  }
  check.Require(m.sides == 0 || (m.sides == 1 && m.form == Form::kReciprocal),
                "sides",
                fmt::format("{}", m.sides));
  check.Require(!m.is_grey || m.form != Form::kTucker, "is_grey", "set for tucker");
  check.Require(
      m.rest == 0 || (m.rest > 0 && m.rest <= 256 && m.form == Form::kReciprocal),
      "rest",
      fmt::format("{}", m.rest));
  check.Require(m.order >= 0 && m.order <= 8, "order", fmt::format("{}", m.order));
  const std::int64_t maps = std::int64_t{m.MapSets()} * m.MapCount();
  const std::int64_t kernels =
      std::int64_t{m.KernelSets()} * m.cluster_count * m.KernelCount();
  check.Size(m.f, maps * m.MapSize(), "f");
  check.Size(m.h, kernels * m.KernelSize(), "h");
  check.Size(m.steps.f, m.steps.empty() ? 0 : maps, "steps of f");
  check.Size(m.steps.h, m.steps.empty() ? 0 : m.KernelSets(), "steps of h");
  if (!m.steps.empty()) {
    std::for_each(m.steps.f.begin(), m.steps.f.end(), [&](float step) {
      positive(static_cast<double>(step), "step of f");
    });
    std::for_each(m.steps.h.begin(), m.steps.h.end(), [&](float step) {
      positive(static_cast<double>(step), "step of h");
    });
    positive(static_cast<double>(m.steps.row_scale), "step of row_scale");
  }
  check.Size(m.cluster, m.PointCount(), "cluster");
  check.Size(m.row_scale, channels * m.PointCount(), "row_scale");
  check.Size(m.albedo, channels * m.PointCount(), "albedo");
  constexpr double kAny = -std::numeric_limits<double>::infinity();
  check.Values(m.f, kAny, "f");
  check.Values(m.h, kAny, "h");
  check.Values(m.row_scale, 0, "row_scale");
  check.Values(m.albedo, 0, "albedo");
  if (m.form == Form::kTucker) {
    const float* shift = m.FactorMap(0, internal::TuckerShiftMap(m));
    for (std::int64_t n = 0; n < m.MapSize(); ++n) {
      check.Require(
          shift[n] >= 0 && shift[n] < static_cast<float>(m.WindowSize()) &&
              shift[n] == std::floor(shift[n]),
          "shift",
          fmt::format("{} of point {} is no cell of the window", shift[n], n));
    }
  }
  if (m.form == Form::kProfiles) {
    check.Values(m.f, 0, "f");
    std::for_each(m.h.begin(), m.h.end(), [&](float log_beta) {
      check.Require(std::abs(log_beta) <= 60, "ln beta", fmt::format("{}", log_beta));
    });
  }
  for (std::size_t n = 0; n < m.cluster.size(); ++n) {
    check.Require(
        m.cluster[n] < m.cluster_count,
        "cluster",
        fmt::format(
            "point {} is in cluster {} of {}", n, m.cluster[n], m.cluster_count));
  }
}

}  // namespace nacre::factor
