#pragma once

#include "core/progress.h"
#include "reconstruct/import/import.h"

#include <filesystem>
#include <map>
#include <string>
#include <utility>

namespace nacre::reconstruct {

struct ImageImportOptions {
  std::string pattern = "*_{i}_{j}.*";
  int core = 0;
  int first = 0;

  template <class Self, class Visitor>
  static void Visit(Self& self, Visitor&& visit) {
    visit("pattern",
          self.pattern,
          Range{},
          "names of the pictures: {i} is the column from the left, {j} the row from "
          "the top, * and ? as in a shell");
    visit("core",
          self.core,
          Range{0, 4095},
          "0: each picture is one window; else each is the whole frame, a cell a pixel "
          "and centred on the grid, and core x core windows are cut out of it");
    visit("first", self.first, Range{0, 1}, "the number of the first column and row");
  }
};

/// Files of `folder` by the (row, column) that `pattern` finds in their names. Throws
/// UsageError if the pattern hasn't {i} and {j} once each, BadData if no name or two
/// names fit a point, or if the grid has holes.
std::map<std::pair<int, int>, std::filesystem::path> FindImages(
    const std::filesystem::path& folder, const ImageImportOptions& options);

/// A folder of pictures (.exr, .pfm, .png of 8 or 16 bits, linear), one a grid point,
/// to `*.rd.exr`. All pictures have the same size and channels. Throws BadData naming
/// file and pixel for a NaN, an infinity or a negative value.
ImportSummary ImportImages(const std::filesystem::path& folder,
                           const std::filesystem::path& to,
                           const ImportOptions& options,
                           const ImageImportOptions& image_options,
                           const ProgressFunction& progress = {});

}  // namespace nacre::reconstruct
