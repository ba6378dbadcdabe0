#include "rigs/transport/diffusion/radial_profile.h"

#include "core/error.h"
#include "core/parallel.h"
#include "rigs/internal/gauss_legendre.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace nacre::rigs::diffusion {
namespace {

constexpr int kNodes = 320;

}  // namespace

RadialProfile::RadialProfile(const std::function<double(double r_mm)>& value,
                             double first_mm,
                             double last_mm,
                             int thread_count)
    : first_log_(std::log(first_mm)),
      log_step_((std::log(last_mm) - first_log_) / (kNodes - 1)),
      logs_(kNodes) {
  Expect(last_mm > first_mm && first_mm > 0, "a range of distances");
  ParallelFor(kNodes, thread_count, [&](std::int64_t k) {
    const auto node = static_cast<std::size_t>(k);
    const double v = value(NodeMm(node));
    if (!(v > 0) || !std::isfinite(v)) {
      throw Error("the diffusion solver: its reference profile isn't positive at r = " +
                  std::to_string(NodeMm(node)) + " mm");
    }
    logs_[node] = std::log(v);
  });
}

double RadialProfile::NodeMm(std::size_t node) const {
  return std::exp(first_log_ + log_step_ * static_cast<double>(node));
}

// Catmull–Rom between nodes.
double RadialProfile::Value(double r_mm) const {
  const double u = (std::log(std::max(r_mm, 1e-12)) - first_log_) / log_step_;
  if (u <= 0) {
    return std::exp(logs_[0] + u * (logs_[1] - logs_[0]));
  }
  const std::size_t last = logs_.size() - 1;
  if (u >= static_cast<double>(last)) {
    const double near = NodeMm(last - 1);
    const double far = NodeMm(last);
    const double rate = (logs_[last] - logs_[last - 1]) / (far - near);
    return std::exp(logs_[last] + rate * (r_mm - far));
  }
  const auto k = static_cast<std::size_t>(u);
  const double t = u - static_cast<double>(k);
  const double p1 = logs_[k];
  const double p2 = logs_[k + 1];
  const double p0 = k > 0 ? logs_[k - 1] : 2 * p1 - p2;
  const double p3 = k + 2 <= last ? logs_[k + 2] : 2 * p2 - p1;
  return std::exp(
      p1 + 0.5 * t *
               (p2 - p0 +
                t * (2 * p0 - 5 * p1 + 4 * p2 - p3 + t * (3 * (p1 - p2) + p3 - p0))));
}

double RadialProfile::CellMean(double x_mm, double y_mm, double width_mm) const {
  const double half = 0.5 * width_mm;
  const double nearest = std::max(std::abs(x_mm), std::abs(y_mm));
  if (nearest < 1e-9 * width_mm) {
    // Eight triangles, in polar coordinates; r = v³ R calms the singularity.
    const rigs::internal::GaussRule rule = rigs::internal::GaussLegendre(24);
    double sum = 0;
    for (std::size_t a = 0; a < rule.node.size(); ++a) {
      const double angle = std::numbers::pi / 8 * (1 + rule.node[a]);
      const double edge = half / std::cos(angle);
      for (std::size_t b = 0; b < rule.node.size(); ++b) {
        const double v = 0.5 * (1 + rule.node[b]);
        const double r = edge * v * v * v;
        const double dr = edge * 3 * v * v * 0.5 * rule.weight[b];
        sum += std::numbers::pi / 8 * rule.weight[a] * Value(r) * r * dr;
      }
    }
    return 8 * sum / (width_mm * width_mm);
  }
  const int order = nearest < 2.5 * width_mm ? 16 : 5;
  const rigs::internal::GaussRule rule = rigs::internal::GaussLegendre(order);
  double sum = 0;
  for (std::size_t b = 0; b < rule.node.size(); ++b) {
    for (std::size_t a = 0; a < rule.node.size(); ++a) {
      sum += rule.weight[a] * rule.weight[b] *
             Value(std::hypot(x_mm + half * rule.node[a], y_mm + half * rule.node[b]));
    }
  }
  return 0.25 * sum;
}

double RadialProfile::Reach(double loss) const {
  double beyond = 0;
  for (std::size_t k = logs_.size() - 1; k > 0; --k) {
    const double low = NodeMm(k - 1);
    const double high = NodeMm(k);
    beyond += std::numbers::pi * (high - low) *
              (low * std::exp(logs_[k - 1]) + high * std::exp(logs_[k]));
    if (beyond > loss) {
      return high;
    }
  }
  return NodeMm(0);
}

}  // namespace nacre::rigs::diffusion
