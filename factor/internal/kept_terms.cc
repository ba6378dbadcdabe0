#include "factor/internal/kept_terms.h"

#include <algorithm>

namespace nacre::factor::internal {
namespace {

// Of sets of `terms` stretches of `size` values each.
template <class T>
void KeepStretches(const std::vector<int>& kept,
                   int terms,
                   std::int64_t size,
                   std::vector<T>& values) {
  std::vector<T> left;
  for (std::int64_t set = 0; set < std::ssize(values); set += terms * size) {
    for (const int term : kept) {
      const auto first = values.begin() + set + term * size;
      left.insert(left.end(), first, first + size);
    }
  }
  values = std::move(left);
}

bool HasValues(const float* values, std::int64_t size) {
  return std::any_of(values, values + size, [](float value) { return value != 0; });
}

bool IsIdle(const Material& m, int term) {
  for (int c = 0; c < std::max(m.MapSets(), m.KernelSets()); ++c) {
    bool has_kernel = false;
    for (int k = 0; k < m.cluster_count; ++k) {
      has_kernel = has_kernel || HasValues(m.Kernel(c, k, term), m.KernelSize());
    }
    if (has_kernel && HasValues(m.FactorMap(c, term), m.MapSize())) {
      return false;
    }
  }
  return true;
}

}  // namespace

void KeepTerms(const std::vector<int>& kept, Material& m) {
  KeepStretches(kept, m.terms, m.MapSize(), m.f);
  KeepStretches(kept, m.terms, m.KernelSize(), m.h);
  KeepStretches(kept, m.terms, 1, m.steps.f);
  m.terms = static_cast<int>(kept.size());
}

int DropIdleTerms(Material& m) {
  if (m.form != Form::kSum) {
    return 0;  // others' maps are made to vary
  }
  std::vector<int> kept{0};
  for (int term = 1; term < m.terms; ++term) {
    if (!IsIdle(m, term)) {
      kept.push_back(term);
    }
  }
  const int idle = m.terms - static_cast<int>(kept.size());
  if (idle > 0) {
    KeepTerms(kept, m);
  }
  return idle;
}

}  // namespace nacre::factor::internal
