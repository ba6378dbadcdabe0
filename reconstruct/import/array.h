#pragma once

#include "core/progress.h"
#include "reconstruct/import/import.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace nacre::reconstruct {

/// What an array doesn't say about itself.
struct ArrayImportOptions {
  std::string axes = {};  ///< "" : "yxvuc", or "yxvu" of an array of four axes
  bool bottom_first = false;
  std::string channels = {};  ///< "" : R,G,B for three, else 0, 1, 2, …
  std::string variable =
      {};  ///< of a .mat file; "" : the only array of four or five axes

  template <class Self, class Visitor>
  static void Visit(Self& self, Visitor&& visit) {
    visit("axes",
          self.axes,
          Range{},
          "the array's axes in order: y and x of the grid, v (down) and u of the "
          "window, c of the channels; yxvuc if not given, yxvu without channels");
    visit("bottom_first",
          self.bottom_first,
          Range{},
          "the first y and v are the lowest, not the highest");
    visit("channels", self.channels, Range{}, "names, as in 450nm,532nm,638nm");
    visit("variable", self.variable, Range{}, "the array's name in a .mat file");
  }
};

enum class NumberType { kUint8, kUint16, kFloat32, kFloat64 };

/// An array in memory or in a mapped file: where its first number is, and per axis how
/// many numbers and how many bytes from one to the next.
struct ArrayView {
  const unsigned char* data = nullptr;
  NumberType type = NumberType::kFloat32;
  bool big_endian = false;
  const char* format = "npy";  ///< of the file, as `nacre import --from` calls it
  std::vector<std::int64_t> extent;
  std::vector<std::int64_t> stride_bytes;
};

/// A whole array of R_d to `*.rd.exr`, a slice at a time. `from` names it in messages
/// and is hashed for provenance. Throws UsageError for axes that don't fit, BadData for
/// a window that isn't square and odd, NaN, infinities and negative values.
ImportSummary ImportArray(const ArrayView& array,
                          const std::filesystem::path& from,
                          const std::filesystem::path& to,
                          const ImportOptions& options,
                          const ArrayImportOptions& array_options,
                          const ProgressFunction& progress = {});

}  // namespace nacre::reconstruct
