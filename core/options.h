#pragma once

#include <limits>
#include <string>
#include <type_traits>

namespace nacre {

/// The closed range an option may take.
struct Range {
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
};

namespace internal {
void CheckRange(const char* name, double value, Range range);
}

/// Options are aggregates that list their fields once:
///
///   template <class Self, class Visitor>
///   static void Visit(Self& self, Visitor&& visit) {
///     visit("terms", self.terms, Range{1, 64}, "terms a channel");
///   }
///
/// Validation, the command line with its help, and provenance all read that list.
/// Throws a usage Error naming option, value and range.
template <class Options>
void Validate(const Options& options) {
  Options::Visit(
      options, [](const char* name, const auto& value, Range range, const char*) {
        using Value = std::remove_cvref_t<decltype(value)>;
        if constexpr (std::is_arithmetic_v<Value> && !std::is_same_v<Value, bool>) {
          internal::CheckRange(name, static_cast<double>(value), range);
        }
      });
}

}  // namespace nacre
