#include "factor/material.h"

#include "factor/internal/bilinear.h"
#include "factor/internal/profiles.h"
#include "factor/internal/reciprocal.h"
#include "factor/internal/reciprocal_taps.h"
#include "factor/internal/tucker.h"

#include <algorithm>
#include <cmath>

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

}  // namespace nacre::factor
