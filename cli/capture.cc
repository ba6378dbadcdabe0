#include "cli/capture.h"

#include "calibrate/calibrate.h"
#include "cli/command_line.h"
#include "core/error.h"
#include "rigs/simulated_rig.h"

#include <chrono>
#include <memory>

namespace nacre::cli {
namespace {

// Between two exposures of a camera under software trigger, roughly.
constexpr double kReadoutSeconds = 0.015;

// There is no driver yet for an illuminator that isn't simulated.
void RequireSimulated(const std::filesystem::path& rig_toml) {
  const std::string kind = acquire::ReadRig(rig_toml).kind;
  if (kind != "simulated") {
    throw DeviceError(
        fmt::format("{}: this build has a driver for the camera of a rig of kind '{}' "
                    "but none for its illuminator, so it can't capture; `nacre doctor "
                    "--camera {}` takes a picture with the camera alone",
                    rig_toml.string(),
                    kind,
                    rig_toml.string()));
  }
}

acquire::SessionWriter OpenSession(const CaptureRequest& request,
                                   rigs::SimulatedRig& rig,
                                   std::optional<std::uint64_t> seed,
                                   const ProgressFunction& progress) {
  const acquire::SessionManifest manifest = acquire::MakeManifest(
      rig.description(), rig.camera().Info(), rig.illuminator().Info(), seed);
  return request.resume
             ? acquire::SessionWriter::Resume(
                   request.out, manifest, request.durable, progress)
             : acquire::SessionWriter::Create(request.out, manifest, request.durable);
}

int Plan(const CaptureRequest& request, const Common& common) {
  rigs::SimulatedRig rig(request.rig,
                         {.seed = request.seed, .thread_count = request.thread_count});
  const acquire::CapturePlan plan =
      acquire::PlanCapture(rig.description(), rig.camera().Info());
  const std::int64_t pictures = plan.target_pictures + plan.grid_pictures;
  const double seconds =
      plan.exposure_seconds + kReadoutSeconds * static_cast<double>(pictures);
  Print(
      common,
      Json{{"pictures", pictures},
           {"target_pictures", plan.target_pictures},
           {"grid_pictures", plan.grid_pictures},
           {"spot_groups", plan.spot_groups},
           {"exposure_seconds", plan.exposure_seconds},
           {"seconds", seconds},
           {"disk_bytes", plan.disk_bytes}},
      fmt::format("{} pictures: {} of targets, {} of the sample in {} groups of spots\n"
                  "{:.0f} s of exposures, about {:.0f} s at a real rig; {:.2f} GB",
                  pictures,
                  plan.target_pictures,
                  plan.grid_pictures,
                  plan.spot_groups,
                  plan.exposure_seconds,
                  seconds,
                  static_cast<double>(plan.disk_bytes) * 1e-9));
  return 0;
}

int Capture(const CaptureRequest& request, const Common& common) {
  const CaptureOutcome outcome = RunCapture(request, ConsoleProgress(common));
  Print(common,
        Json{{"pictures", outcome.pictures},
             {"pictures_taken", outcome.pictures_taken},
             {"frames_lost", outcome.frames_lost},
             {"frames_damaged", outcome.frames_damaged},
             {"seconds", outcome.seconds}},
        fmt::format("{} pictures, {} of them taken now in {:.1f} s; {} lost frames and "
                    "{} damaged ones taken again",
                    outcome.pictures,
                    outcome.pictures_taken,
                    outcome.seconds,
                    outcome.frames_lost,
                    outcome.frames_damaged));
  return 0;
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
  rigs::SimulatedRig rig(request.rig,
                         {.seed = seed, .thread_count = request.thread_count});
  acquire::SessionWriter session = OpenSession(request, rig, seed, progress);
  const acquire::Devices devices{rig.camera(), rig.illuminator(), rig.stage()};
  try {
    const acquire::CaptureSummary targets =
        acquire::CaptureCalibration(session, devices, progress);
    const acquire::ScanMap map =
        session.manifest().scan_map
            ? *session.manifest().scan_map
            : calibrate::EstimateScanMap(
                  acquire::SessionReader(request.out), {}, progress);
    const acquire::CaptureSummary grid =
        acquire::CaptureGrid(session, devices, map, progress);
    return {.pictures = session.picture_count(),
            .pictures_taken = targets.pictures_taken + grid.pictures_taken,
            .frames_lost = targets.frames_lost + grid.frames_lost,
            .frames_damaged = session.dropped_count(),
            .seconds =
                std::chrono::duration<double>(std::chrono::steady_clock::now() - start)
                    .count()};
  } catch (const Error& e) {
    if (e.code() != ExitCode::kInterrupted) {
      throw;
    }
    throw Interrupted(
        fmt::format("stopped with {} of {} pictures in {}; nacre capture "
                    "--resume goes on",
                    session.picture_count(),
                    session.schedule().size(),
                    request.out.string()));
  }
}

std::function<int()> MakeCaptureVerb(CLI::App& app, const Common& common) {
  struct Arguments {
    CaptureRequest request;
    bool plan = false;
  };
  auto arguments = std::make_shared<Arguments>();
  CaptureRequest& request = arguments->request;
  app.add_option("rig", request.rig, "rig description, rig.toml")->required();
  CLI::Option* out = app.add_option("--out", request.out, "session folder");
  app.add_flag("--resume", request.resume, "go on with the session in that folder");
  app.add_flag("--durable",
               request.durable,
               "flush every frame to disk, so that even a power cut costs one only");
  app.add_flag(
      "--plan", arguments->plan, "print pictures, time and disk; take nothing");
  const CLI::Option* seed = app.get_option("--seed");
  return [arguments, out, seed, &common] {
    CaptureRequest& given = arguments->request;
    given.thread_count = common.thread_count;
    if (seed->count() > 0) {
      given.seed = common.seed;
    }
    RequireSimulated(given.rig);
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
