// What every material has to be.

#include "factor/internal/material_checks.h"

#include "core/error.h"
#include "factor/internal/reciprocal_taps.h"
#include "factor/internal/tucker.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>

namespace nacre::factor {
namespace {

class Checker {
 public:
  explicit Checker(const std::string& origin) : origin_(origin) {}

  void Require(bool condition,
               const std::string& field,
               const std::string& found) const {
    if (!condition) {
      throw BadData(fmt::format("{}: material: {}: {}", origin_, field, found));
    }
  }

  template <class T>
  void Size(const std::vector<T>& values,
            std::int64_t expected,
            const char* field) const {
    Require(static_cast<std::int64_t>(values.size()) == expected,
            field,
            fmt::format("{} values where {} are expected", values.size(), expected));
  }

  template <class T>
  void Values(const std::vector<T>& values, double min, const char* field) const {
    for (std::size_t n = 0; n < values.size(); ++n) {
      const auto value = static_cast<double>(values[n]);
      if (!std::isfinite(value) || value < min) {
        Require(false, field, fmt::format("value {} is {}", n, value));
      }
    }
  }

  // Channels of `size` values are the same.
  void Repeats(const std::vector<float>& values,
               std::int64_t size,
               const char* field) const {
    for (auto n = static_cast<std::size_t>(size); n < values.size(); ++n) {
      Require(values[n] == values[n - static_cast<std::size_t>(size)],
              field,
              fmt::format("value {} differs between channels of a grey material", n));
    }
  }

 private:
  const std::string& origin_;
};

}  // namespace

namespace internal {

void ValidateFields(const Material& m, const std::string& origin) {
  const Checker check(origin);
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
  check.Require(m.taps >= 1 && m.taps <= kMostTaps, "taps", fmt::format("{}", m.taps));
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
}

}  // namespace internal

void Validate(const Material& m, const std::string& origin) {
  internal::ValidateFields(m, origin);
  const Checker check(origin);
  const auto channels = static_cast<std::int64_t>(m.channels.size());
  const std::int64_t maps = std::int64_t{m.MapSets()} * m.MapCount();
  const std::int64_t kernels =
      std::int64_t{m.KernelSets()} * m.cluster_count * m.KernelCount();
  check.Size(m.f, maps * m.MapSize(), "f");
  check.Size(m.h, kernels * m.KernelSize(), "h");
  check.Size(m.cluster, m.PointCount(), "cluster");
  check.Size(m.row_scale, channels * m.PointCount(), "row_scale");
  check.Size(m.albedo, channels * m.PointCount(), "albedo");
  constexpr double kAny = -std::numeric_limits<double>::infinity();
  check.Values(m.f, kAny, "f");
  check.Values(m.h, kAny, "h");
  check.Values(m.row_scale, 0, "row_scale");
  check.Values(m.albedo, 0, "albedo");
  if (m.is_grey) {
    check.Repeats(m.row_scale, m.PointCount(), "row_scale");
    check.Repeats(m.albedo, m.PointCount(), "albedo");
  }
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
