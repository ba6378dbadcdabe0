#include "factor/internal/auto_method.h"

#include <fmt/format.h>
#include <optional>
#include <vector>

namespace nacre::factor::internal {
namespace {

// The log error of an exact material is 0.
constexpr double kLeastError = 1e-9;

struct Candidate {
  const char* method;
  int sides;
};

const std::vector<Candidate>& Candidates() {
  static const std::vector<Candidate> candidates{
      {"reciprocal", 1}, {"bilinear", 0}, {"log-svd", 0}};
  return candidates;
}

// What is to be small, whether the demand is met coming first.
struct Cost {
  bool misses = false;
  double value = 0;
  bool operator<(const Cost& other) const {
    return misses != other.misses ? !misses : value < other.value;
  }
};

Cost CostOf(const FactorOptions& options, const FactorSummary& s) {
  const auto bytes = static_cast<double>(s.bytes);
  const bool is_large = options.bytes > 0 && bytes > options.bytes;
  if (options.error > 0) {
    const bool misses = is_large || s.relative_l2 > options.error;
    return {misses, misses ? s.relative_l2 : bytes};
  }
  return {is_large,
          is_large ? bytes : (s.relative_l2 + kLeastError) * (s.log_rms + kLeastError)};
}

}  // namespace

int OwnTerms(const std::string& method) {
  return method == "reciprocal" ? 4 : method == "bilinear" ? 6 : 10;
}

Factorization FactorByBest(
    const FactorOptions& options,
    bool bilinear_fits,
    const std::function<Factorization(const FactorOptions&)>& factor) {
  std::optional<Factorization> best;
  std::string tried;
  for (const Candidate& candidate : Candidates()) {
    if (options.clusters > 1 && candidate.method != std::string("log-svd")) {
      continue;  // models with shared maps have no clusters
    }
    if (candidate.method == std::string("bilinear") && !bilinear_fits) {
      tried += fmt::format("{}bilinear doesn't fit into {:.0f} MB",
                           tried.empty() ? "" : "; ",
                           options.memory_mb);
      continue;
    }
    FactorOptions its = options;
    its.method = candidate.method;
    its.sides = candidate.sides;
    Factorization found = factor(its);
    const FactorSummary& s = found.summary;
    tried += fmt::format(
        "{}{} with {} terms: {:.0f} kB, relative L2 {:.3g}, log error "
        "{:.3g}",
        tried.empty() ? "" : "; ",
        its.method,
        s.terms,
        static_cast<double>(s.bytes) / 1e3,
        s.relative_l2,
        s.log_rms);
    if (!best || CostOf(options, s) < CostOf(options, best->summary)) {
      best = std::move(found);
    }
  }
  best->summary.notes.push_back(
      fmt::format("method auto took {} ({})", best->material.method, tried));
  return std::move(*best);
}

}  // namespace nacre::factor::internal
