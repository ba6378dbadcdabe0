#pragma once

// What `nacre inspect` says of files that other programs write too.

#include "core/json_fwd.h"

#include <cstdint>
#include <filesystem>
#include <limits>
#include <string>

namespace nacre::cli {

/// Smallest and largest of the values that are numbers, and how many aren't.
struct ValueRange {
  double min = std::numeric_limits<double>::infinity();
  double max = -std::numeric_limits<double>::infinity();
  double sum = 0;
  std::int64_t count = 0;
  std::int64_t bad_count = 0;

  void Add(double value);
  Json ToJson() const;
};

/// Text of a provenance attribute as JSON; what isn't JSON is shown as it is.
Json ProvenanceOf(const std::string& text);

Json InspectExr(const std::filesystem::path& path);
Json InspectPng(const std::filesystem::path& path);
/// What a page of `nacre report` is of, and the page's own provenance.
Json InspectReport(const std::filesystem::path& path);
/// What `nacre export` wrote into a folder.
Json InspectExport(const std::filesystem::path& path);
/// Counts alone, from the header: a mesh is read by the renderer, not here.
Json InspectPly(const std::filesystem::path& path);
Json InspectObj(const std::filesystem::path& path);

}  // namespace nacre::cli
