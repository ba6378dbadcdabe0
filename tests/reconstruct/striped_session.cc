#include "tests/reconstruct/striped_session.h"

#include "acquire/capture.h"
#include "calibrate/calibrate.h"
#include "core/atomic_file.h"
#include "rigs/simulated_rig.h"
#include "rigs/transport/transport.h"

namespace nacre::reconstruct {
namespace {

constexpr const char* kRig = R"(kind = "simulated"
[sample]
name = "stripes"
eta = 1.4
[grid]
points = [12, 10]
pitch_mm = 1.5
core = 9
[camera]
exposures_us = [40000, 4000, 400]
dark_frames = 2
target_exposure_us = 12000
flat_exposures_us = [3000, 12000]
[targets]
checkerboard_columns = 7
checkerboard_rows = 5
checkerboard_square_mm = 4.0
checkerboard_poses = 6
reference_reflectance = 0.99
reference_exposure_us = 40
reference_frames = 2
laser_lattice = 5
[scanner]
mm_per_rad = 400.0
channels = ["R", "IR"]
[schedule]
spot_spacing_cells = 10
order_seed = 4
[simulated]
phantom = "phantom.toml"
seed = 1
[simulated.camera]
width_px = 200
height_px = 200
field_mm = 40.0
electrons_per_us_per_radiance = [6.5, 6.0]
[simulated.laser]
power_mw = [10.0, 8.0]
[simulated.lamp]
electrons_per_us = 1.4
)";

constexpr const char* kPhantom = R"(channels = ["R", "IR"]
[slab]
thickness_mm = 12.0
eta = 1.4
bottom = "air"
[[medium]]
name = "clear"
sigma_a_per_mm = [0.01, 0.02]
sigma_s_per_mm = [1.4, 1.2]
g = 0.0
[[medium]]
name = "dense"
sigma_a_per_mm = [0.05, 0.03]
sigma_s_per_mm = [2.5, 2.2]
g = 0.0
[pattern]
type = "chessboard"
cell_mm = 5.0
[beam]
shape = "pencil"
[grid]
points = [12, 10]
pitch_mm = 1.5
core = 9
)";

}  // namespace

void CaptureStripes(const std::filesystem::path& folder,
                    const std::string& name,
                    std::uint64_t seed) {
  rigs::SimulatedRig rig(folder / "rig.toml", {.seed = seed});
  const acquire::Devices devices{rig.camera(), rig.illuminator(), rig.stage()};
  auto writer = acquire::SessionWriter::Create(
      folder / name,
      acquire::MakeManifest(
          rig.description(), devices.camera.Info(), devices.illuminator.Info()),
      false);
  acquire::CaptureCalibration(writer, devices);
  const acquire::ScanMap map =
      calibrate::EstimateScanMap(acquire::SessionReader(folder / name), {});
  acquire::CaptureGrid(writer, devices, map);
}

std::unique_ptr<StripedSession::Shared> StripedSession::shared;

void StripedSession::SetUpTestSuite() {
  shared = std::make_unique<Shared>();
  const std::filesystem::path folder = shared->folder.path();
  WriteFile(folder / "rig.toml", kRig);
  WriteFile(folder / "phantom.toml", kPhantom);
  CaptureStripes(folder, "session", kSeed);
  shared->calibration =
      calibrate::Calibrate(acquire::SessionReader(folder / "session"), {});
  const std::shared_ptr<const rigs::Transport> transport = rigs::MakeTransport(
      rigs::ReadPhantom(folder / "phantom.toml"), rigs::Solver::kFast);
  shared->truth = [transport](const RdHeader& header, int i, int j) {
    const PointMm x_i = header.GridPoint(i, j);
    RdSlice slice = MakeSlice(header);
    slice.rd = transport->WindowAround({x_i.x, x_i.y}).rd;
    return slice;
  };
}

}  // namespace nacre::reconstruct
