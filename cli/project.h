#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace nacre::cli {

/// One command of a project and the files that go in and out. Paths are as written,
/// meant from the project's folder.
struct ProjectStage {
  std::string name;
  std::vector<std::string> command;  ///< without "nacre"
  std::vector<std::string> reads;
  std::vector<std::string> writes;
};

/// Reads the stages of a project:
///
///   [[stage]]
///   run = "factor sample.rd.exr --method reciprocal --out sample.nacre.exr"
///   name = "factor"          # optional: else what it writes
///   reads = ["extra.ply"]    # what the command line doesn't name
///   writes = ["a.ply"]       # what isn't the value of --out, -o or --png
///
/// A stage reads each word of its command that another stage writes or that exists as
/// a file in the project's folder, also as the value in --option=word and in -D
/// name=word. The stages come back in an order in which each follows those that write
/// what it reads. Throws BadData naming file and line: nothing written, two stages that
/// write one file, a circle, quotes that don't close.
std::vector<ProjectStage> ReadProject(const std::filesystem::path& path);

/// A line of words as a shell takes it apart: quotes keep blanks, nothing else is
/// special. Throws UsageError for a quote that isn't closed.
std::vector<std::string> SplitWords(const std::string& line);

}  // namespace nacre::cli
