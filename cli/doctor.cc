// nacre doctor: what this machine and this build can do, and what to do about the rest.

#ifdef NACRE_HAS_ARAVIS
#include "cli/camera_check.h"
#endif
#include "cli/command_line.h"
#ifdef NACRE_HAS_HELIOS
#include "cli/laser_check.h"
#endif
#include "cli/machine_check.h"
#include "cli/network_check.h"
#include "cli/resources.h"
#include "cli/verbs.h"
#include "core/error.h"
#include "core/json.h"
#include "core/version.h"

#include <filesystem>
#include <memory>
#include <sstream>
#include <string>

namespace nacre::cli {
namespace {

using State = Finding::State;

// A module that was left out takes its verbs with it; these are what people miss.
struct Module {
  const char* verb;
  const char* what;
  const char* advice;
};
constexpr Module kModules[] = {
    {"capture", "capture", "build with NACRE_WITH_ACQUIRE and NACRE_WITH_RIGS"},
    {"calibrate", "calibration", "build with NACRE_WITH_CALIBRATE (needs OpenCV)"},
    {"reconstruct", "reconstruction", "build with NACRE_WITH_RECONSTRUCT"},
    {"simulate", "simulated rigs", "build with NACRE_WITH_RIGS"},
    {"factor", "factorization", "build with NACRE_WITH_FACTOR (needs Eigen)"},
    {"render", "rendering", "build with NACRE_WITH_RENDER (needs Embree)"},
};

std::vector<Finding> CheckBuild() {
  std::vector<Finding> findings{{"build", "nacre", Version(), State::kGood, ""}};
  for (const Module& module : kModules) {
    const bool present =
        std::any_of(Verbs().begin(), Verbs().end(), [&](const VerbEntry& verb) {
          return std::string(verb.name) == module.verb;
        });
    findings.push_back({"build",
                        module.what,
                        present ? "built in" : "left out",
                        present ? State::kGood : State::kNote,
                        present ? "" : module.advice});
  }
  std::istringstream libraries(LibraryVersions());
  for (std::string line; std::getline(libraries, line);) {
    const auto space = line.rfind(' ');
    findings.push_back(
        {"library", line.substr(0, space), line.substr(space + 1), State::kGood, ""});
  }
  return findings;
}

Finding CheckResources() {
  const std::string name = "rigs/chessboard4x4.toml";
  try {
    return {"build",
            "rigs and scenes",
            FindResource(name).parent_path().string(),
            State::kGood,
            ""};
  } catch (const Error& e) {
    return {"build", "rigs and scenes", "not found", State::kProblem, e.what()};
  }
}

std::vector<Finding> CheckDrivers() {
  // Drivers for devices come as modules of their own; this build's are these.
  std::vector<Finding> findings;
#ifdef NACRE_HAS_RIGS
  findings.push_back({"drivers", "simulated rigs", "built in", State::kGood, ""});
#else
  findings.push_back({"drivers",
                      "simulated rigs",
                      "left out",
                      State::kNote,
                      "build with NACRE_WITH_RIGS"});
#endif
#ifdef NACRE_HAS_ARAVIS
  findings.push_back(
      {"drivers", "cameras", "GigE Vision, USB3 Vision", State::kGood, ""});
#else
  findings.push_back({"drivers",
                      "cameras",
                      "left out",
                      State::kNote,
                      "build with NACRE_WITH_ARAVIS (needs Aravis)"});
#endif
#ifdef NACRE_HAS_HELIOS
  findings.push_back({"drivers", "lasers", "Helios DAC", State::kGood, ""});
#else
  findings.push_back({"drivers",
                      "lasers",
                      "left out",
                      State::kNote,
                      "build with NACRE_WITH_HELIOS (needs libusb)"});
#endif
#ifdef NACRE_HAS_PROJECTOR
  findings.push_back(
      {"drivers", "projectors", "any display, by SDL 2", State::kGood, ""});
#else
  findings.push_back({"drivers",
                      "projectors",
                      "left out",
                      State::kNote,
                      "build with NACRE_WITH_PROJECTOR (needs SDL 2)"});
#endif
  return findings;
}

std::string Text(const std::vector<Finding>& findings) {
  std::string text;
  std::string area;
  for (const Finding& finding : findings) {
    if (finding.area != area) {
      area = finding.area;
      text += (text.empty() ? "" : "\n") + area + '\n';
    }
    const char* mark = finding.state == State::kGood   ? "ok"
                       : finding.state == State::kNote ? "--"
                                                       : "!!";
    text += fmt::format("  {}  {:<20} {}\n", mark, finding.name, finding.value);
    if (!finding.advice.empty()) {
      text += fmt::format("      {:<20} {}\n", "", finding.advice);
    }
  }
  text.pop_back();
  return text;
}

int Run(const std::string& camera, const Common& common) {
  std::vector<Finding> findings = CheckBuild();
  const auto add = [&](const std::vector<Finding>& more) {
    findings.insert(findings.end(), more.begin(), more.end());
  };
  add({CheckResources()});
  add(CheckDrivers());
#ifdef NACRE_HAS_ARAVIS
  add(camera.empty() ? CheckCameras() : TryCamera(camera));
#else
  if (!camera.empty()) {
    throw UsageError(
        "--camera: this build has no driver for cameras; build with "
        "NACRE_WITH_ARAVIS");
  }
#endif
#ifdef NACRE_HAS_HELIOS
  add(CheckLasers());
#endif
  add(CheckMachine("/", std::filesystem::current_path()));
  add(CheckDiskSpeed(std::filesystem::current_path()));
  add(CheckLoopback());
  std::stable_sort(
      findings.begin(), findings.end(), [](const Finding& a, const Finding& b) {
        const auto rank = [](const Finding& f) {
          constexpr const char* kOrder[] = {
              "build", "library", "drivers", "camera", "laser"};
          const auto at = std::find(std::begin(kOrder), std::end(kOrder), f.area);
          if (at != std::end(kOrder)) {
            return at - std::begin(kOrder);
          }
          return std::ssize(kOrder) + (f.area == "disk"      ? 2
                                       : f.area == "network" ? 3
                                       : f.area == "usb"     ? 4
                                       : f.area == "memory"  ? 1
                                                             : 0);
        };
        return rank(a) < rank(b);
      });
  Json list = Json::array();
  int problems = 0;
  for (const Finding& finding : findings) {
    problems += finding.state == State::kProblem ? 1 : 0;
    list.push_back({{"area", finding.area},
                    {"name", finding.name},
                    {"value", finding.value},
                    {"state", Name(finding.state)},
                    {"advice", finding.advice}});
  }
  Print(common, {{"problems", problems}, {"findings", list}}, Text(findings));
  return 0;
}

}  // namespace

std::function<int()> MakeDoctorVerb(CLI::App& app, const Common& common) {
  app.footer("ok: fine; --: works, or isn't needed by all; !!: won't work as it is");
  auto camera = std::make_shared<std::string>();
  app.add_option("--camera",
                 *camera,
                 "take a picture with this camera, an id, an address or a rig.toml of "
                 "kind \"hardware\"");
  return [camera, &common] { return Run(*camera, common); };
}

}  // namespace nacre::cli
