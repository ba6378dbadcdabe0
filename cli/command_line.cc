#include "cli/command_line.h"

#include "core/ranks.h"

#include <chrono>
#include <csignal>
#include <cstdio>
#include <iostream>
#include <memory>
#include <unistd.h>

namespace nacre::cli {
namespace {

// A signal handler's.
// NOLINTNEXTLINE(cppcoreguidelines-avoid-non-const-global-variables)
volatile std::sig_atomic_t interrupt_count = 0;

extern "C" void OnInterrupt(int signal) {
  interrupt_count = interrupt_count + 1;
  if (interrupt_count > 1) {  // the second one ends it at once
    std::signal(signal, SIG_DFL);
    std::raise(signal);
  }
}

std::string Clock(double seconds) {
  const auto whole = static_cast<std::int64_t>(seconds + 0.5);
  return whole < 3600
             ? fmt::format("{}:{:02}", whole / 60, whole % 60)
             : fmt::format("{}:{:02}:{:02}", whole / 3600, whole / 60 % 60, whole % 60);
}

class Console {
 public:
  explicit Console(int verbosity)
      : verbosity_(verbosity), terminal_(::isatty(2) == 1) {}

  bool operator()(const Progress& state) {
    if (InterruptRequested()) {
      return false;
    }
    if (verbosity_ == 0 || state.total <= 0) {
      return true;
    }
    const auto now = std::chrono::steady_clock::now();
    if (state.stage != stage_) {
      stage_ = state.stage;
      start_ = now;
      last_ = now;
      printed_ = false;
    }
    const double elapsed = std::chrono::duration<double>(now - start_).count();
    const double since = std::chrono::duration<double>(now - last_).count();
    const bool end = state.done >= state.total;
    // Short work says nothing; long work speaks at a pace that suits the listener.
    if (elapsed < 0.5 || (!end && since < (terminal_ ? 0.1 : 5.0)) ||
        (end && !printed_)) {
      return true;
    }
    last_ = now;
    printed_ = true;
    const double fraction =
        static_cast<double>(state.done) / static_cast<double>(state.total);
    const double eta = fraction > 0 ? elapsed * (1 - fraction) / fraction : 0;
    const std::string line = fmt::format("{:<12} {:3.0f} %  {}/{}  {}, {} left  {}",
                                         state.stage,
                                         100 * fraction,
                                         state.done,
                                         state.total,
                                         Clock(elapsed),
                                         Clock(eta),
                                         state.note);
    if (terminal_) {
      constexpr int kWidth = 24;
      const int filled = static_cast<int>(fraction * kWidth);
      std::cerr << "\r\033[K[" << std::string(static_cast<std::size_t>(filled), '#')
                << std::string(static_cast<std::size_t>(kWidth - filled), '.') << "] "
                << line << (end ? "\n" : "") << std::flush;
    } else {
      std::cerr << line << '\n';
    }
    return true;
  }

 private:
  int verbosity_;
  bool terminal_;
  bool printed_ = false;
  std::string stage_;
  std::chrono::steady_clock::time_point start_;
  std::chrono::steady_clock::time_point last_;
};

}  // namespace

bool Common::IsRoot() const {
  return ranks == nullptr || ranks->IsRoot();
}

void Say(const Common& common, const std::string& line) {
  if (common.verbosity > 0) {
    std::cerr << line << '\n';
  }
}

void Print(const Common& common, const Json& json, const std::string& text) {
  *common.out << (common.json ? json.dump() : text) << '\n' << std::flush;
}

ProgressFunction ConsoleProgress(const Common& common) {
  std::signal(SIGINT, OnInterrupt);
  std::signal(SIGTERM, OnInterrupt);
  auto console = std::make_shared<Console>(common.verbosity);
  return [console](const Progress& state) { return (*console)(state); };
}

bool InterruptRequested() {
  return interrupt_count > 0;
}

}  // namespace nacre::cli
