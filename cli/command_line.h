#pragma once

#include "core/json.h"
#include "core/options.h"
#include "core/progress.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdint>
#include <fmt/format.h>
#include <functional>
#include <iosfwd>
#include <string>

namespace nacre {
class Ranks;
}

namespace nacre::cli {

/// Options that every verb takes.
struct Common {
  bool json = false;     ///< one JSON object on stdout and nothing else there
  int verbosity = 1;     ///< 0 quiet, 1 normal, 2 and more talkative
  int thread_count = 0;  ///< 0: all cores
  std::uint64_t seed = 1;
  std::ostream* out =
      nullptr;  ///< where results go: stdout, or the verb that called this one
  const Ranks* ranks = nullptr;  ///< that share this run; null: this process alone

  /// The one process that writes files: all do if each is alone.
  bool IsRoot() const;
};

/// A verb: adds its options to its subcommand and returns what to run once the command
/// line is parsed. The references stay valid until then.
using Verb = std::function<int()> (*)(CLI::App& app, const Common& common);

/// Talk, on stderr; nothing when quiet.
void Say(const Common& common, const std::string& line);

/// Prints a result on stdout: the JSON with --json, else the text.
void Print(const Common& common, const Json& json, const std::string& text);

/// A progress bar with ETA on a terminal, plain lines elsewhere; stops the work after
/// the first Ctrl-C. One at a time.
ProgressFunction ConsoleProgress(const Common& common);

/// True once Ctrl-C (or SIGTERM) was pressed.
bool InterruptRequested();

/// Adds every visited field of `options` as --name-with-dashes, with its help, range
/// and default. `options` must outlive the parse.
template <class Options>
void AddOptions(CLI::App& app, Options& options) {
  Options::Visit(
      options, [&](const char* name, auto& value, Range range, const char* help) {
        using Value = std::remove_cvref_t<decltype(value)>;
        std::string flag = std::string("--") + name;
        std::replace(flag.begin(), flag.end(), '_', '-');
        if constexpr (std::is_same_v<Value, bool>) {
          app.add_flag(flag + ",!--no-" + flag.substr(2), value, help)
              ->default_str(value ? "true" : "false");
        } else {
          auto* option = app.add_option(flag, value, help)->capture_default_str();
          if constexpr (std::is_arithmetic_v<Value>) {
            if (std::isfinite(range.min) || std::isfinite(range.max)) {
              option->check(CLI::Range(range.min, range.max));
            }
          }
        }
      });
}

}  // namespace nacre::cli
