#include "error_sessions.h"

#include "acquire/capture.h"
#include "calibrate/calibrate.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/hash.h"
#include "core/toml.h"
#include "rigs/internal/read_models.h"
#include "rigs/laser_twin.h"
#include "rigs/simulated_rig.h"

#include <array>
#include <fmt/format.h>
#include <regex>

namespace nacre::bench {
namespace {

struct Sample {
  const char* name;
  const char* media;
};

// Grid and channels come from the rig.
constexpr std::array<Sample, 3> kSamples = {{{"chessboard", R"([[medium]]
sigma_a_per_mm = [0.0021, 0.0041, 0.0071]
sigma_s_per_mm = [2.19, 2.62, 3.00]
[[medium]]
sigma_a_per_mm = [0.060, 0.030, 0.045]
sigma_s_per_mm = [1.00, 1.10, 1.05]
[pattern]
type = "chessboard"
cell_mm = 8.3
)"},
                                             {"marble", R"([[medium]]
sigma_a_per_mm = [0.0021, 0.0041, 0.0071]
sigma_s_per_mm = [2.19, 2.62, 3.00]
[[medium]]
sigma_a_per_mm = [0.12, 0.10, 0.09]
sigma_s_per_mm = [2.6, 2.8, 3.0]
[pattern]
type = "veins"
solid = false
seed = 9
scale_mm = 16.0
width_mm = 2.5
direction_deg = 20
voxel_mm = 0.5
)"},
                                             {"skin", R"([[medium]]
sigma_a_per_mm = [0.032, 0.17, 0.48]
sigma_s_per_mm = [0.74, 0.88, 1.01]
[[medium]]
sigma_a_per_mm = [0.034, 0.18, 0.50]
sigma_s_per_mm = [0.76, 0.90, 1.03]
[pattern]
type = "veins"
solid = false
seed = 5
scale_mm = 12.0
width_mm = 3.0
voxel_mm = 0.5
)"}}};

std::string Replace(const std::string& text,
                    const std::string& key,
                    const std::string& value) {
  const std::regex line(fmt::format("(^|\n){} = [^\n]*", key));
  if (!std::regex_search(text, line)) {
    throw BadData("the rig file has no key '" + key + "' that could be changed");
  }
  return std::regex_replace(text, line, fmt::format("$1{} = {}", key, value));
}

std::string NameOf(const ErrorSession& session) {
  std::string name = fmt::format(
      "{}-{}-{}", session.rig.stem().string(), session.phantom, session.seed);
  std::string changes;
  for (const auto& [key, value] : session.changes) {
    changes += fmt::format("{}={};", key, value);
  }
  if (!changes.empty()) {
    name += fmt::format("-{:016x}", Hash64(changes.data(), changes.size()));
  }
  return name;
}

std::string PhantomText(const ErrorSession& session,
                        const acquire::RigDescription& rig) {
  for (const Sample& sample : kSamples) {
    if (session.phantom == sample.name) {
      return fmt::format(
          "[slab]\nthickness_mm = 10.0\neta = {}\n{}[beam]\nshape = "
          "\"pencil\"\n[grid]\npoints = [{}, {}]\npitch_mm = {}\n"
          "core = {}\n",
          rig.sample.eta,
          sample.media,
          rig.grid.points_x,
          rig.grid.points_y,
          rig.grid.pitch_mm,
          rig.grid.core);
    }
  }
  throw BadData("no phantom is called '" + session.phantom + "'");
}

std::string RigText(const ErrorSession& session) {
  std::string rig =
      Replace(acquire::ReadRig(session.rig).text, "phantom", "\"phantom.toml\"");
  for (const auto& [key, value] : session.changes) {
    rig = Replace(rig, key, value);
  }
  return Replace(rig, "seed", session.seed);
}

}  // namespace

std::vector<std::string> ErrorPhantoms() {
  std::vector<std::string> names;
  for (const Sample& sample : kSamples) {
    names.emplace_back(sample.name);
  }
  return names;
}

std::filesystem::path CaptureErrorSession(const ErrorSession& session) {
  const std::filesystem::path folder = session.folder / NameOf(session);
  std::filesystem::create_directories(folder);
  WriteFile(folder / "rig.toml", RigText(session));
  WriteFile(folder / "phantom.toml",
            PhantomText(session, acquire::ReadRig(folder / "rig.toml")));
  if (std::filesystem::exists(folder / "session" / "session.json") &&
      acquire::SessionReader(folder / "session").IsComplete()) {
    return folder;
  }
  rigs::SimulatedRig twin(folder / "rig.toml");
  const acquire::Devices devices{twin.camera(), twin.illuminator(), twin.stage()};
  auto writer = acquire::SessionWriter::Create(
      folder / "session",
      acquire::MakeManifest(
          twin.description(), devices.camera.Info(), devices.illuminator.Info()),
      false);
  acquire::CaptureCalibration(writer, devices);
  acquire::CaptureGrid(
      writer,
      devices,
      calibrate::EstimateScanMap(acquire::SessionReader(folder / "session"), {}));
  return folder;
}

std::vector<std::vector<PointMm>> PointsLit(const std::filesystem::path& folder,
                                            const acquire::SessionReader& session) {
  const acquire::RigDescription rig = acquire::ReadRig(folder / "rig.toml");
  const TomlTable simulated =
      TomlTable::FromText(rig.text, (folder / "rig.toml").string()).Table("simulated");
  simulated.Text("phantom");
  const rigs::internal::RigModels models = rigs::internal::ReadModels(simulated, rig);
  auto world = std::make_shared<rigs::World>();
  rigs::LaserTwin laser(models.laser, world);
  const acquire::Schedule& schedule = session.schedule();
  std::vector<std::vector<PointMm>> points(
      static_cast<std::size_t>(rig.grid.PointCount()));
  for (std::int64_t n = schedule.grid_begin(); n < schedule.size(); ++n) {
    if (schedule[n].target != acquire::Target::kSample || schedule[n].group < 0 ||
        !session.manifest().scan_map) {
      continue;
    }
    laser.Light(schedule.Beams(n, &*session.manifest().scan_map), 0);
    const auto group = schedule.Group(schedule[n].group);
    for (const acquire::GridIndex& point : group) {
      points[static_cast<std::size_t>(std::int64_t{point.j} * rig.grid.points_x +
                                      point.i)]
          .clear();
    }
    for (const rigs::Spot& spot : world->spots) {
      const auto beam = static_cast<std::size_t>(spot.beam);
      if (beam < group.size()) {
        points[static_cast<std::size_t>(
                   std::int64_t{group[beam].j} * rig.grid.points_x + group[beam].i)]
            .push_back(spot.on_sample_mm);
      }
    }
  }
  return points;
}

}  // namespace nacre::bench
