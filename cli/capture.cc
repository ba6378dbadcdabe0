#include "cli/capture.h"

#include "calibrate/calibrate.h"
#include "calibrate/geometry.h"
#include "cli/command_line.h"
#include "cli/preview/monitor.h"
#include "cli/preview/server.h"
#include "cli/rig_devices.h"
#include "core/error.h"

#include <chrono>
#include <memory>
#include <thread>

namespace nacre::cli {
namespace {

// Between two exposures of a camera under software trigger, roughly.
constexpr double kReadoutSeconds = 0.015;

std::unique_ptr<RigDevices> Open(const CaptureRequest& request,
                                 std::optional<std::uint64_t> seed) {
  return OpenRigDevices(request.rig,
                        {.seed = seed,
                         .thread_count = request.thread_count,
                         .arm_laser = request.arm_laser,
                         .dry_run = request.dry_run});
}

// The size of the pictures without asking a camera, if the rig description says it.
acquire::CameraInfo PlannedCamera(const CaptureRequest& request) {
  const acquire::RigDescription rig = acquire::ReadRig(request.rig);
  if (rig.kind == "simulated" || request.dry_run) {
    return Open(request, request.seed)->camera().Info();
  }
  acquire::CameraInfo camera;
  if (rig.camera.device && rig.camera.device->region) {
    camera.width = rig.camera.device->region->width;
    camera.height = rig.camera.device->region->height;
  }
  return camera;
}

int Plan(const CaptureRequest& request, const Common& common) {
  const acquire::RigDescription rig = acquire::ReadRig(request.rig);
  const acquire::CameraInfo camera = PlannedCamera(request);
  const acquire::CapturePlan plan = acquire::PlanCapture(rig, camera);
  const std::int64_t pictures = plan.target_pictures + plan.grid_pictures;
  const double seconds =
      plan.exposure_seconds + kReadoutSeconds * static_cast<double>(pictures);
  const std::string disk =
      camera.width > 0
          ? fmt::format("{:.2f} GB", static_cast<double>(plan.disk_bytes) * 1e-9)
          : std::string("disk unknown: camera.device.region isn't given");
  Print(
      common,
      Json{{"pictures", pictures},
           {"target_pictures", plan.target_pictures},
           {"grid_pictures", plan.grid_pictures},
           {"grid_points", plan.grid_points},
           {"spot_groups", plan.spot_groups},
           {"adaptive", rig.adaptive.has_value()},
           {"exposure_seconds", plan.exposure_seconds},
           {"seconds", seconds},
           {"disk_bytes", camera.width > 0 ? Json(plan.disk_bytes) : Json()}},
      fmt::format(
          "{}{} pictures: {} of targets, {} of the sample, its {} points in {} groups "
          "of spots\n{:.0f} s of exposures, about {:.0f} s at a real rig; {}",
          rig.adaptive ? "at most " : "",
          pictures,
          plan.target_pictures,
          plan.grid_pictures,
          plan.grid_points,
          plan.spot_groups,
          plan.exposure_seconds,
          seconds,
          disk));
  return 0;
}

// What the disk may lack for the rest of a session.
void SayIfDiskIsShort(const CaptureRequest& request, const Common& common) {
  std::filesystem::path folder = std::filesystem::absolute(request.out);
  while (!std::filesystem::exists(folder)) {
    folder = folder.parent_path();
  }
  const acquire::CameraInfo camera = PlannedCamera(request);
  const acquire::CapturePlan plan =
      acquire::PlanCapture(acquire::ReadRig(request.rig), camera);
  std::error_code unknown;
  const auto free = std::filesystem::space(folder, unknown).available;
  if (!unknown && !request.resume && camera.width > 0 && free < plan.disk_bytes) {
    Say(common,
        fmt::format(
            "{} may take {:.2f} GB and {:.2f} GB are free there; a capture that "
            "fills the disk stops and can be resumed",
            request.out.string(),
            static_cast<double>(plan.disk_bytes) * 1e-9,
            static_cast<double>(free) * 1e-9));
  }
}

int Capture(const CaptureRequest& request, const Common& common) {
  SayIfDiskIsShort(request, common);
  const CaptureOutcome outcome = RunCapture(request, ConsoleProgress(common));
  Print(common,
        Json{{"pictures", outcome.pictures},
             {"pictures_taken", outcome.pictures_taken},
             {"pictures_left_out", outcome.pictures_left_out},
             {"frames_lost", outcome.frames_lost},
             {"light_failures", outcome.light_failures},
             {"frames_damaged", outcome.frames_damaged},
             {"waits_for_disk", outcome.waits_for_disk},
             {"seconds", outcome.seconds}},
        fmt::format(
            "{} pictures, {} of them taken and {} left out now in {:.1f} s; {} lost "
            "frames, {} failures of the light and {} damaged frames made good",
            outcome.pictures,
            outcome.pictures_taken,
            outcome.pictures_left_out,
            outcome.seconds,
            outcome.frames_lost,
            outcome.light_failures,
            outcome.frames_damaged));
  return 0;
}

// The page that shows a capture under way, if somebody wants it.
class Preview {
 public:
  Preview(const CaptureRequest& request,
          const acquire::RigDescription& rig,
          const acquire::CameraInfo& camera) {
    if (request.on_preview) {
      monitor_ = std::make_unique<preview::Monitor>(rig, camera);
      server_ = std::make_unique<preview::Server>(*monitor_, request.preview_port);
      request.on_preview(server_->url());
    }
  }

  // Stays up until those who look have heard the last word.
  void End(const std::string& message) const {
    if (!monitor_) {
      return;
    }
    monitor_->OnEnd(message);
    for (int k = 0; k < 15 && monitor_->IsLastWordAwaited(); ++k) {
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
  }

  ProgressFunction Watch(const ProgressFunction& progress) const {
    if (!monitor_) {
      return progress;
    }
    return [this, &progress](const Progress& state) {
      monitor_->OnProgress(state);
      return !progress || progress(state);
    };
  }
  acquire::FrameFunction OnFrame() const {
    if (!monitor_) {
      return {};
    }
    return [this](std::int64_t number,
                  const std::shared_ptr<const acquire::Frame>& frame) {
      monitor_->OnFrame(number, frame);
    };
  }

 private:
  std::unique_ptr<preview::Monitor> monitor_;
  std::unique_ptr<preview::Server> server_;
};

// Both halves of a capture, and what comes between them.
void TakeAll(acquire::SessionWriter& session,
             RigDevices& rig,
             const Preview& preview,
             const ProgressFunction& progress,
             CaptureOutcome& outcome) {
  const acquire::Devices devices{rig.camera(), rig.illuminator(), rig.stage()};
  acquire::CaptureOptions options;
  options.on_frame = preview.OnFrame();
  const auto add = [&outcome](const acquire::CaptureSummary& part) {
    outcome.pictures_taken += part.pictures_taken;
    outcome.pictures_left_out += part.pictures_skipped;
    outcome.frames_lost += part.frames_lost;
    outcome.light_failures += part.light_failures;
    outcome.waits_for_disk += part.waits_for_disk;
  };
  add(acquire::CaptureCalibration(session, devices, progress, options));
  const acquire::SessionReader targets(session.folder());
  const acquire::ScanMap map = session.manifest().scan_map
                                   ? *session.manifest().scan_map
                                   : calibrate::EstimateScanMap(targets, {}, progress);
  if (session.rig().adaptive && session.rig().adaptive->skip_empty &&
      !session.manifest().adaptive_plan) {
    const calibrate::CameraGeometry camera =
        calibrate::EstimateGeometry(targets, progress).camera;
    options.pixel_from_sample = [camera](PointMm point) {
      const calibrate::PixelPoint pixel = camera.PixelFromSample(point);
      return std::pair(pixel.x, pixel.y);
    };
  }
  add(acquire::CaptureGrid(session, devices, map, progress, options));
}

}  // namespace

CaptureOutcome RunCapture(const CaptureRequest& request,
                          const ProgressFunction& progress) {
  const auto start = std::chrono::steady_clock::now();
  const bool exists = std::filesystem::exists(request.out / "session.json");
  if (exists && !request.resume) {
    throw UsageError(
        fmt::format("{}: there is a session already; --resume goes on "
                    "with it, or choose another folder",
                    request.out.string()));
  }
  // A session goes on with the seed that it began with.
  const std::optional<std::uint64_t> seed =
      request.resume && !request.seed ? acquire::ReadManifest(request.out).seed
                                      : request.seed;
  const std::unique_ptr<RigDevices> rig = Open(request, seed);
  acquire::SessionManifest manifest = acquire::MakeManifest(
      rig->description(), rig->camera().Info(), rig->illuminator().Info(), seed);
  if (rig->description().kind != "simulated" && !request.dry_run) {
    manifest.captured_unix_s = std::chrono::duration_cast<std::chrono::seconds>(
                                   std::chrono::system_clock::now().time_since_epoch())
                                   .count();
  }
  const Preview preview(request, rig->description(), manifest.camera);
  const ProgressFunction watched = preview.Watch(progress);
  acquire::SessionWriter session =
      request.resume
          ? acquire::SessionWriter::Resume(
                request.out, manifest, request.durable, watched)
          : acquire::SessionWriter::Create(request.out, manifest, request.durable);
  CaptureOutcome outcome;
  try {
    TakeAll(session, *rig, preview, watched, outcome);
    preview.End("done");
  } catch (const Error& e) {
    preview.End(e.what());
    const std::string rest =
        fmt::format("with {} of {} pictures in {}; nacre capture --resume goes on",
                    session.picture_count(),
                    session.schedule().size(),
                    request.out.string());
    if (e.code() == ExitCode::kInterrupted) {
      throw Interrupted("stopped " + rest);
    }
    if (e.code() == ExitCode::kFailed || e.code() == ExitCode::kDevice) {
      throw Error(fmt::format("{}\nstopped {}", e.what(), rest), e.code());
    }
    throw;
  }
  outcome.pictures = session.picture_count();
  outcome.frames_damaged = session.dropped_count();
  outcome.seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return outcome;
}

std::function<int()> MakeCaptureVerb(CLI::App& app, const Common& common) {
  struct Arguments {
    CaptureRequest request;
    bool plan = false;
    bool preview = false;
  };
  auto arguments = std::make_shared<Arguments>();
  CaptureRequest& request = arguments->request;
  app.add_option("rig", request.rig, "rig description, rig.toml")->required();
  CLI::Option* out = app.add_option("--out", request.out, "session folder");
  app.add_flag("--resume", request.resume, "go on with the session in that folder");
  app.add_flag("--durable",
               request.durable,
               "flush every frame to disk, so that even a power cut costs one only");
  app.add_flag("--plan",
               arguments->plan,
               "print pictures, time and disk; take nothing, need no devices");
  app.add_flag("--dry-run",
               request.dry_run,
               "on the rig that the file's [simulated] describes, whatever its kind");
  app.add_flag(
      "--arm-laser", request.arm_laser, "let a rig of kind hardware emit light");
  app.add_flag("--preview", arguments->preview, "show the capture on a local web page");
  app.add_option(
         "--preview-port", request.preview_port, "of that page; 0: any free one")
      ->check(CLI::Range(0, 65535));
  const CLI::Option* seed = app.get_option("--seed");
  return [arguments, out, seed, &common] {
    CaptureRequest& given = arguments->request;
    given.thread_count = common.thread_count;
    if (seed->count() > 0) {
      given.seed = common.seed;
    }
    if (arguments->preview) {
      given.on_preview = [](const std::string& url) {
        // Told to the quiet too: there is no other way to the page.
        Say({.verbosity = 1}, "preview: " + url);
      };
    }
    if (arguments->plan) {
      return Plan(given, common);
    }
    if (out->count() == 0) {
      throw UsageError("capture needs --out SESSION, or --plan");
    }
    return Capture(given, common);
  };
}

}  // namespace nacre::cli
