// How many frames a second a capture takes, against a bare loop of Aravis that receives
// them and drops them; and what the capture costs beside the transport.
//
//   throughput [FRAMES [BLOCKS [FOLDER]]]
//
// A GigE Vision camera of Aravis' own serves 1024 x 1024 Mono16 over loopback in
// packets of 9000 bytes, from a process of its own. Blocks of both take turns, so that
// whatever else the machine does meets both.

#include "acquire/aravis_camera.h"
#include "acquire/capture.h"
#include "core/error.h"

#include <arv.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fmt/format.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>
#include <vector>

namespace nacre::bench {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kSide = 1024;
constexpr int kPacketBytes = 9000;
constexpr int kSocketBytes = 4'000'000;
constexpr const char* kAddress = "127.0.0.1";

double CpuSeconds() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

// The memory of its buffers as it is: what counts is that it travels.
void FillNothing(ArvBuffer*, void*, std::uint32_t, std::uint32_t, ArvPixelFormat) {}

// In a process of its own: its work is the camera's, not ours.
pid_t StartCamera() {
  const pid_t child = ::fork();
  if (child != 0) {
    return child;
  }
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  ArvGvFakeCamera* server = arv_gv_fake_camera_new(kAddress, "NacreBench");
  ArvFakeCamera* camera = arv_gv_fake_camera_get_fake_camera(server);
  arv_fake_camera_set_trigger_frequency(camera, 5000);
  arv_fake_camera_set_fill_pattern(camera, FillNothing, nullptr);
  for (;;) {
    ::pause();
  }
}

struct Block {
  double seconds = 0;
  double cpu_seconds = 0;
  std::int64_t frames = 0;
  std::int64_t lost = 0;
  double Rate() const { return static_cast<double>(frames) / seconds; }
};

class Stopwatch {
 public:
  void Read(Block& block) const {
    block.seconds += std::chrono::duration<double>(Clock::now() - start_).count();
    block.cpu_seconds += CpuSeconds() - cpu_start_;
  }

 private:
  Clock::time_point start_ = Clock::now();
  double cpu_start_ = CpuSeconds();
};

// Trigger, wait, give the buffer back.
Block ReceiveBare(int frames) {
  ArvCamera* camera = arv_camera_new(kAddress, nullptr);
  if (camera == nullptr) {
    throw DeviceError("no camera");
  }
  arv_camera_set_pixel_format_from_string(camera, "Mono16", nullptr);
  arv_camera_set_region(camera, 0, 0, kSide, kSide, nullptr);
  arv_camera_set_acquisition_mode(camera, ARV_ACQUISITION_MODE_CONTINUOUS, nullptr);
  arv_camera_set_trigger(camera, "Software", nullptr);
  arv_camera_set_exposure_time(camera, 1000, nullptr);
  arv_camera_gv_set_stream_options(camera, ARV_GV_STREAM_OPTION_PACKET_SOCKET_DISABLED);
  arv_camera_gv_set_packet_size_adjustment(camera, ARV_GV_PACKET_SIZE_ADJUSTMENT_NEVER);
  arv_camera_gv_set_packet_size(camera, kPacketBytes, nullptr);
  ArvStream* stream = arv_camera_create_stream(camera, nullptr, nullptr, nullptr);
  g_object_set(stream,
               "socket-buffer",
               ARV_GV_STREAM_SOCKET_BUFFER_FIXED,
               "socket-buffer-size",
               kSocketBytes,
               nullptr);
  const guint payload = arv_camera_get_payload(camera, nullptr);
  for (int k = 0; k < 8; ++k) {
    arv_stream_push_buffer(stream, arv_buffer_new(payload, nullptr));
  }
  arv_camera_start_acquisition(camera, nullptr);
  Block block;
  const auto take = [&] {
    arv_camera_software_trigger(camera, nullptr);
    ArvBuffer* buffer = arv_stream_timeout_pop_buffer(stream, 2'000'000);
    const bool good =
        buffer != nullptr && arv_buffer_get_status(buffer) == ARV_BUFFER_STATUS_SUCCESS;
    if (buffer != nullptr) {
      arv_stream_push_buffer(stream, buffer);
    }
    return good;
  };
  take();  // the first one may be lost to the socket's growth
  const Stopwatch watch;
  for (int k = 0; k < frames; ++k) {
    ++(take() ? block.frames : block.lost);
  }
  watch.Read(block);
  arv_camera_stop_acquisition(camera, nullptr);
  g_object_unref(stream);
  g_object_unref(camera);
  return block;
}

class NoLaser final : public acquire::Illuminator {
 public:
  acquire::IlluminatorInfo Info() const override {
    return {.model = "none", .serial = "0", .channels = {"R"}, .max_angle_rad = 1};
  }
  void Light(std::span<const acquire::ScanAngle>, int) override {}
  void Blank() noexcept override {}
};

class NoStage final : public acquire::SampleStage {
 public:
  void Place(acquire::Target, int) override {}
};

// A schedule of about that many pictures before the sample's.
acquire::RigDescription Rig(int frames) {
  return acquire::ParseRig(fmt::format(R"(kind = "hardware"
[sample]
name = "none"
eta = 1.5
[grid]
points = [4, 4]
pitch_mm = 1
core = 3
[camera]
exposures_us = [1000]
dark_frames = {}
target_exposure_us = 1000
flat_exposures_us = [1000, 1001]
[camera.device]
id = "{}"
pixel_format = "Mono16"
[targets]
checkerboard_columns = 8
checkerboard_rows = 5
checkerboard_square_mm = 1
checkerboard_poses = 3
reference_reflectance = 0.99
reference_exposure_us = 1000
laser_lattice = 5
[scanner]
mm_per_rad = 300
channels = ["R"]
)",
                                       std::clamp((frames - 11) / 2, 2, 1000),
                                       kAddress),
                           "bench.toml");
}

// The same frames through the whole capture: unpacked, checked, hashed, written.
Block CaptureAll(int frames, const std::filesystem::path& folder) {
  acquire::AravisCamera camera(
      {.id = kAddress,
       .pixel_format = "Mono16",
       .region = acquire::SensorRegion{.x = 0, .y = 0, .width = kSide, .height = kSide},
       .packet_size_bytes = kPacketBytes,
       .socket_buffer_bytes = kSocketBytes});
  NoLaser laser;
  NoStage stage;
  camera.SetExposureUs(1000);
  (void)camera.Capture(0, std::chrono::milliseconds(2000));
  const acquire::CameraStatistics before = camera.Statistics();
  Block block;
  {
    auto session = acquire::SessionWriter::Create(
        folder, acquire::MakeManifest(Rig(frames), camera.Info(), laser.Info()), false);
    const Stopwatch watch;
    const acquire::CaptureSummary summary =
        acquire::CaptureCalibration(session, {camera, laser, stage});
    watch.Read(block);
    block.frames = summary.pictures_taken;
    const acquire::CameraStatistics after = camera.Statistics();
    block.lost = summary.frames_lost + after.late - before.late;
  }
  std::filesystem::remove_all(folder);
  return block;
}

void Add(Block& sum, const Block& block) {
  sum.seconds += block.seconds;
  sum.cpu_seconds += block.cpu_seconds;
  sum.frames += block.frames;
  sum.lost += block.lost;
}

int Run(int frames, int blocks, const std::filesystem::path& folder) {
  const pid_t camera = StartCamera();
  std::this_thread::sleep_for(std::chrono::seconds(1));
  Block bare;
  Block capture;
  std::vector<double> ratios;
  for (int k = 0; k < blocks; ++k) {
    const Block b = ReceiveBare(frames);
    const Block c = CaptureAll(frames, folder / fmt::format("bench-{}", ::getpid()));
    ratios.push_back(c.Rate() / b.Rate());
    fmt::print(
        "block {}: bare {:.1f}, capture {:.1f} frames/s, ratio {:.3f}; lost {}, {}\n",
        k,
        b.Rate(),
        c.Rate(),
        ratios.back(),
        b.lost,
        c.lost);
    Add(bare, b);
    Add(capture, c);
  }
  ::kill(camera, SIGKILL);
  ::waitpid(camera, nullptr, 0);
  std::sort(ratios.begin(), ratios.end());
  // What the same number of frames costs a process that does nothing with them.
  const double transport = bare.cpu_seconds / static_cast<double>(bare.frames) *
                           static_cast<double>(capture.frames);
  fmt::print(
      "all: bare {:.1f}, capture {:.1f} frames/s ({:.0f} MB/s); ratio {:.3f}, median "
      "of "
      "blocks {:.3f}; {} frames lost of {}; {:.2f} cores beside the transport's "
      "{:.2f}\n",
      bare.Rate(),
      capture.Rate(),
      capture.Rate() * 2e-6 * kSide * kSide,
      capture.Rate() / bare.Rate(),
      ratios[ratios.size() / 2],
      capture.lost,
      capture.frames,
      (capture.cpu_seconds - transport) / capture.seconds,
      transport / capture.seconds);
  return 0;
}

}  // namespace
}  // namespace nacre::bench

int main(int argc, char** argv) {
  try {
    return nacre::bench::Run(argc > 1 ? std::atoi(argv[1]) : 500,
                             argc > 2 ? std::atoi(argv[2]) : 10,
                             argc > 3 ? argv[3] : ".");
  } catch (const std::exception& e) {
    fmt::print(stderr, "{}\n", e.what());
    return 1;
  }
}
