#include "acquire/rig.h"

#include "acquire/pixel_format.h"
#include "acquire/rig_light.h"
#include "core/atomic_file.h"
#include "core/hash.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <set>

namespace nacre::acquire {
namespace {

// Of a picture's exposure, in all sensible rigs: 1 µs to a quarter of an hour.
constexpr Range kExposureUs{1, 1e9};
constexpr int kMaxPoints = 4096;

std::vector<double> Exposures(const TomlTable& table, const std::string& key) {
  std::vector<double> exposures_us = table.Numbers(key, kExposureUs);
  if (exposures_us.empty()) {
    throw table.At(key, "needs at least one exposure");
  }
  const std::set<double> distinct(exposures_us.begin(), exposures_us.end());
  if (distinct.size() != exposures_us.size()) {
    throw table.At(key, "the same exposure is given twice");
  }
  return exposures_us;
}

SampleDescription ReadSample(const TomlTable& table) {
  SampleDescription sample;
  sample.name = table.Text("name");
  if (sample.name.empty()) {
    throw table.At("name", "is empty");
  }
  sample.eta = table.Number("eta", Range{1, 4});
  table.RejectUnknownKeys();
  return sample;
}

GridDescription ReadGrid(const TomlTable& table) {
  GridDescription grid;
  const std::vector<double> points = table.Numbers("points", Range{1, kMaxPoints});
  if (points.size() != 2 || points[0] != std::floor(points[0]) ||
      points[1] != std::floor(points[1])) {
    throw table.At("points", "expected two whole numbers, [along x, along y]");
  }
  grid.points_x = static_cast<int>(points[0]);
  grid.points_y = static_cast<int>(points[1]);
  grid.pitch_mm = table.Number("pitch_mm", Range{1e-3, 1e3});
  grid.core = table.Integer("core", Range{1, 1001});
  if (grid.core % 2 == 0) {
    throw table.At("core",
                   fmt::format("{} is even; the window has a cell in its middle, so "
                               "it must be odd",
                               grid.core));
  }
  if (table.Has("outline_mm")) {
    const std::vector<double> corners = table.Numbers("outline_mm", Range{-1e4, 1e4});
    if (corners.size() < 6 || corners.size() % 2 != 0) {
      throw table.At("outline_mm", "expected [x, y, x, y, …] of three corners or more");
    }
    for (std::size_t k = 0; k < corners.size(); k += 2) {
      grid.outline_mm.push_back({corners[k], corners[k + 1]});
    }
    bool any = false;
    for (int j = 0; j < grid.points_y; ++j) {
      for (int i = 0; i < grid.points_x; ++i) {
        any = any || grid.Includes(i, j);
      }
    }
    if (!any) {
      throw table.At("outline_mm", "no grid point lies inside");
    }
  }
  table.RejectUnknownKeys();
  return grid;
}

std::optional<AdaptiveDescription> ReadAdaptive(const std::optional<TomlTable>& table) {
  if (!table) {
    return std::nullopt;
  }
  AdaptiveDescription adaptive;
  adaptive.skip_exposures = table->Boolean("skip_exposures", adaptive.skip_exposures);
  adaptive.skip_empty = table->Boolean("skip_empty", adaptive.skip_empty);
  adaptive.noise_sigmas =
      table->Number("noise_sigmas", adaptive.noise_sigmas, Range{3, 100});
  table->RejectUnknownKeys();
  return adaptive;
}

SensorRegion ReadRegion(const TomlTable& table) {
  const std::vector<double> sides = table.Numbers("region", Range{0, 1e5});
  if (sides.size() != 4 || sides[2] < 1 || sides[3] < 1 ||
      !std::all_of(
          sides.begin(), sides.end(), [](double v) { return v == std::floor(v); })) {
    throw table.At("region", "expected whole numbers, [x, y, width, height]");
  }
  return {static_cast<int>(sides[0]),
          static_cast<int>(sides[1]),
          static_cast<int>(sides[2]),
          static_cast<int>(sides[3])};
}

AravisOptions ReadDevice(const TomlTable& table) {
  AravisOptions device;
  device.id = table.Text("id");
  if (device.id.empty()) {
    throw table.At("id", "is empty; `nacre doctor` lists the cameras that answer");
  }
  device.pixel_format = table.Text("pixel_format", device.pixel_format);
  const PixelFormat* format = FindPixelFormat(device.pixel_format);
  if (format == nullptr) {
    throw table.At(
        "pixel_format",
        fmt::format("'{}' isn't one of {}", device.pixel_format, PixelFormatNames()));
  }
  device.trigger = table.Text("trigger", device.trigger);
  if (table.Has("gain")) {
    device.gain = table.Number("gain", Range{-100, 1000});
  }
  if (table.Has("region")) {
    device.region = ReadRegion(table);
  }
  // 576 bytes pass everywhere; 16 kB is the most that a frame of Ethernet takes.
  device.packet_size_bytes =
      table.Integer("packet_size_bytes", device.packet_size_bytes, Range{576, 16384});
  device.socket_buffer_bytes = table.Integer(
      "socket_buffer_bytes", device.socket_buffer_bytes, Range{65536, 1 << 30});
  device.reconnect_s =
      table.Number("reconnect_s", device.reconnect_s, Range{0, 86'400});
  table.RejectUnknownKeys();
  return device;
}

CameraDescription ReadCamera(const TomlTable& table, bool is_hardware) {
  CameraDescription camera;
  camera.exposures_us = Exposures(table, "exposures_us");
  if (!std::is_sorted(camera.exposures_us.rbegin(), camera.exposures_us.rend())) {
    throw table.At("exposures_us", "must run from the longest to the shortest");
  }
  camera.dark_frames = table.Integer("dark_frames", Range{2, 1000});
  camera.target_exposure_us = table.Number("target_exposure_us", kExposureUs);
  camera.flat_exposures_us = Exposures(table, "flat_exposures_us");
  if (camera.flat_exposures_us.size() < 2) {
    throw table.At("flat_exposures_us",
                   "photon transfer is a line through at least two exposures");
  }
  if (is_hardware) {
    camera.device = ReadDevice(table.Table("device"));
  }
  table.RejectUnknownKeys();
  return camera;
}

void ReadPatch(const TomlTable& table, TargetsDescription& targets) {
  if (!table.Has("patch_mm")) {
    return;
  }
  const std::vector<double> patch_mm = table.Numbers("patch_mm", Range{-1e4, 1e4});
  if (patch_mm.size() != 2) {
    throw table.At("patch_mm", "expected two numbers, [x, y]");
  }
  targets.patch_mm = PointMm{patch_mm[0], patch_mm[1]};
  targets.patch_reflectance = table.Number("patch_reflectance", Range{0.01, 1});
}

TargetsDescription ReadTargets(const TomlTable& table) {
  TargetsDescription targets;
  targets.checkerboard_columns = table.Integer("checkerboard_columns", Range{3, 200});
  targets.checkerboard_rows = table.Integer("checkerboard_rows", Range{3, 200});
  if (targets.checkerboard_columns == targets.checkerboard_rows) {
    throw table.At("checkerboard_rows",
                   "must differ from checkerboard_columns: a square board looks the "
                   "same when it lies a quarter turn round");
  }
  targets.checkerboard_square_mm =
      table.Number("checkerboard_square_mm", Range{0.01, 1e3});
  targets.checkerboard_poses = table.Integer("checkerboard_poses", Range{3, 200});
  targets.reference_reflectance = table.Number("reference_reflectance", Range{0.01, 1});
  targets.reference_exposure_us = table.Number("reference_exposure_us", kExposureUs);
  targets.reference_frames = table.Integer("reference_frames", 4, Range{1, 1000});
  // A cubic in two variables has ten coefficients and needs four distinct positions
  // along each axis; the fifth makes the residual mean something.
  targets.laser_lattice = table.Integer("laser_lattice", Range{5, 99});
  targets.reverse_lattice = table.Boolean("reverse_lattice", false);
  if (table.Has("glare_exposures_us")) {
    targets.glare_exposures_us = Exposures(table, "glare_exposures_us");
  }
  targets.ambient_frames = table.Integer("ambient_frames", 0, Range{0, 1000});
  ReadPatch(table, targets);
  table.RejectUnknownKeys();
  return targets;
}

ScannerDescription ReadScanner(const TomlTable& table) {
  ScannerDescription scanner;
  scanner.mm_per_rad = table.Number("mm_per_rad", Range{1, 1e5});
  scanner.channels = table.Texts("channels", {"R", "G", "B"});
  const std::set<std::string> distinct(scanner.channels.begin(),
                                       scanner.channels.end());
  if (scanner.channels.empty() || distinct.size() != scanner.channels.size() ||
      distinct.contains("")) {
    throw table.At("channels", "expected different, non-empty names");
  }
  table.RejectUnknownKeys();
  return scanner;
}

ScheduleDescription ReadSchedule(const std::optional<TomlTable>& table, int core) {
  // At 1.0 core windows just don't overlap; 1.4 leaves light from the neighbour's spot
  // at the edge of a window two thirds of a core of further decay. Below 1.0 the
  // reconstruction parts what windows share.
  ScheduleDescription schedule;
  schedule.spot_spacing_cells = static_cast<int>(std::ceil(1.4 * core));
  if (table) {
    schedule.spot_spacing_cells = table->Integer(
        "spot_spacing_cells", schedule.spot_spacing_cells, Range{1, 8192});
    const int least = core / 2 + 1;
    if (schedule.spot_spacing_cells < least) {
      throw table->At("spot_spacing_cells",
                      fmt::format("{} is less than {}: spots would light the middle of "
                                  "each other's windows (core = {})",
                                  schedule.spot_spacing_cells,
                                  least,
                                  core));
    }
    schedule.order_seed =
        static_cast<std::uint64_t>(table->Integer("order_seed", 0, Range{0, 2e9}));
    table->RejectUnknownKeys();
  }
  return schedule;
}

}  // namespace

// Even-odd rule: whether a ray to the right crosses an odd number of sides.
bool GridDescription::Includes(int i, int j) const {
  if (outline_mm.empty()) {
    return true;
  }
  const PointMm p = Point(i, j);
  bool inside = false;
  for (std::size_t k = 0; k < outline_mm.size(); ++k) {
    const PointMm a = outline_mm[k];
    const PointMm b = outline_mm[(k + 1) % outline_mm.size()];
    if ((a.y > p.y) != (b.y > p.y) &&
        p.x < a.x + (b.x - a.x) * (p.y - a.y) / (b.y - a.y)) {
      inside = !inside;
    }
  }
  return inside;
}

RigDescription ParseRig(const std::string& text, const std::filesystem::path& path) {
  const TomlTable root = TomlTable::FromText(text, path.string());
  RigDescription rig;
  rig.path = path;
  rig.text = text;
  rig.hash = HashHex(text.data(), text.size());
  rig.kind = root.Text("kind");
  const bool is_hardware = rig.kind == "hardware";
#ifdef NACRE_HAS_ARAVIS
  const bool is_known = is_hardware || rig.kind == "simulated";
  const char* known = "simulated, hardware";
#else
  const bool is_known = rig.kind == "simulated";
  const char* known = "simulated";
#endif
  if (!is_known) {
    throw DeviceError(
        root.At("kind",
                fmt::format(
                    "this build has no driver for '{}'; it knows: {}", rig.kind, known))
            .what());
  }
  rig.sample = ReadSample(root.Table("sample"));
  rig.grid = ReadGrid(root.Table("grid"));
  rig.camera = ReadCamera(root.Table("camera"), is_hardware);
  rig.targets = ReadTargets(root.Table("targets"));
  rig.scanner = ReadScanner(root.Table("scanner"));
  rig.schedule = ReadSchedule(root.FindTable("schedule"), rig.grid.core);
  rig.adaptive = ReadAdaptive(root.FindTable("adaptive"));
  if (is_hardware) {
    ReadLight(root, rig);
  }
  root.Has("simulated");  // belongs to rigs/, which checks it
  root.RejectUnknownKeys();
  return rig;
}

RigDescription ReadRig(const std::filesystem::path& path) {
  constexpr std::uint64_t kMaxBytes = 16 << 20;
  return ParseRig(ReadFile(path, kMaxBytes), path);
}

}  // namespace nacre::acquire
