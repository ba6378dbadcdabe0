// nacre demo: the whole line, as the commands that a user would type.

#include "cli/command.h"
#include "cli/command_line.h"
#include "cli/resources.h"
#include "cli/stage_clock.h"
#include "core/error.h"

#include <filesystem>
#include <functional>
#include <memory>
#include <sstream>

namespace nacre::cli {
namespace {

namespace fs = std::filesystem;

struct DemoArguments {
  fs::path out = "out";
  fs::path mesh;
  bool quick = false;
  int size = 512;
  int spp = 32;
  int terms = 3;
};

double Number(const Json& json, const char* key) {
  return Get<double>(json, key, "result");
}

/// Runs the commands of the line, and keeps the books for the report.
class Line {
 public:
  Line(const Common& common, fs::path out) : common_(common), out_(std::move(out)) {}

  /// Runs one command; `error` turns its result into the figure that the report's table
  /// shows, empty where there is none.
  void Run(const std::string& name,
           std::vector<std::string> command,
           const fs::path& output,
           const std::function<std::string(const Json&)>& error = {}) {
    command.insert(command.end(),
                   {"--json",
                    "--threads",
                    std::to_string(common_.thread_count),
                    "--seed",
                    std::to_string(common_.seed)});
    if (common_.verbosity == 0) {
      command.emplace_back("--quiet");
    }
    Say(common_, fmt::format("\n$ nacre {}", fmt::join(command, " ")));
    const StageClock clock;
    std::ostringstream result;
    const int code = RunCommand(command, result);
    if (code != 0) {
      throw Error("the demo's " + name + " failed", static_cast<ExitCode>(code));
    }
    const StageCost cost = clock.Read();
    const Json json = ParseJson(result.str(), name);
    const std::string figure = error ? error(json) : "";
    Say(common_,
        fmt::format("{:<12} {:6.1f} s  {:6.0f} MB  {}",
                    name,
                    cost.seconds,
                    cost.peak_mb,
                    figure));
    stages_.push_back({{"name", name},
                       {"seconds", cost.seconds},
                       {"cpu_seconds", cost.cpu_seconds},
                       {"peak_mb", cost.peak_mb},
                       {"error", figure},
                       {"output", output.lexically_relative(out_).string()},
                       {"result", json}});
    total_seconds_ += cost.seconds;
  }

  /// Written before the report reads it.
  void WriteBooks() const { WriteJson(out_ / "stages.json", {{"stages", stages_}}); }

  double total_seconds() const { return total_seconds_; }
  const Json& stages() const { return stages_; }

 private:
  const Common& common_;
  fs::path out_;
  Json stages_ = Json::array();
  double total_seconds_ = 0;
};

std::string AgainstTruth(const Json& json) {
  return fmt::format(
      "R_d off by {:.2f} % (relative L2), worst slice's flux by {:.2f} %",
      100 * Number(json, "relative_l2"),
      100 * Number(json, "worst_total"));
}

void RunLine(Line& line, const DemoArguments& args) {
  const fs::path& out = args.out;
  const std::string variant = args.quick ? "-quick" : "";
  const std::string phantom =
      FindResource("rigs/chessboard4x4" + variant + ".toml").string();
  const std::string rig =
      FindResource("rigs/simulated-chessboard4x4" + variant + ".toml").string();
  const std::string truth = out / "truth.rd.exr";
  const std::string session = out / "session";
  const std::string calibration = out / "calibration.json";
  const std::string sample = out / "sample.rd.exr";
  const std::string material = out / "sample.nacre.exr";
  const std::string picture = out / "dragon.exr";

  line.Run("simulate", {"simulate", phantom, "--out", truth}, truth);
  line.Run("capture", {"capture", rig, "--out", session}, session);
  line.Run("calibrate",
           {"calibrate", session, "--out", calibration},
           calibration,
           [](const Json& json) {
             return fmt::format("{:.3f} px reprojection, {:.3f} mm laser map (rms)",
                                Number(json, "reprojection_rms_px"),
                                Number(json, "laser_map_rms_mm"));
           });
  line.Run("reconstruct",
           {"reconstruct", session, "--calibration", calibration, "--out", sample},
           sample);
  line.Run("compare", {"compare", sample, truth}, sample, AgainstTruth);
  line.Run("factor",
           {"factor",
            sample,
            "--method",
            "reciprocal",
            "--terms",
            std::to_string(args.terms),
            "--out",
            material},
           material,
           [](const Json& json) {
             return fmt::format("adds {:.2f} % (relative L2), {:.0f} kB",
                                100 * Number(json, "relative_l2"),
                                Number(json, "bytes") / 1000);
           });
  line.Run("compare", {"compare", material, truth}, material, AgainstTruth);
  line.Run("render",
           {"render",
            FindResource("scenes/dragon.xml").string(),
            "--out",
            picture,
            "--png",
            out / "dragon.png",
            "-D",
            "model=" + fs::absolute(args.mesh).string(),
            "-D",
            "material=" + fs::absolute(material).string(),
            "-D",
            "res=" + std::to_string(args.size),
            "--spp",
            std::to_string(args.spp)},
           picture);
}

/// A mesh of the user's choice goes straight to the renderer; the scans that
/// scripts/fetch-dragon gets need scale and texture coordinates first.
fs::path PrepareMesh(Line& line, const DemoArguments& args, const Common& common) {
  if (args.mesh.empty()) {
    throw UsageError(
        "--mesh is needed: a dragon as .ply.gz, .ply, .obj or .off, which "
        "scripts/fetch-dragon gets (scripts/demo does it all)");
  }
  fs::path prepared = args.out / "dragon.ply";
  Say(common, "mesh: " + args.mesh.string());
  line.Run("mesh",
           {"mesh", args.mesh.string(), prepared.string(), "--width-mm", "126"},
           prepared);
  return prepared;
}

int Run(DemoArguments args, const Common& common) {
  if (args.quick) {
    args.size = 256;
    args.spp = 16;
  }
  fs::create_directories(args.out);
  if (fs::exists(args.out /
                 "session")) {  // left by an earlier demo: it made it, it may go
    fs::remove_all(args.out / "session");
  }
  Line line(common, args.out);
  args.mesh = PrepareMesh(line, args, common);
  RunLine(line, args);
  line.WriteBooks();
  const fs::path report = args.out / "report.html";
  line.Run("report", {"report", args.out, "--out", report}, report);
  Say(common,
      fmt::format("\ndone in {:.1f} s; look at {} and {}",
                  line.total_seconds(),
                  report.string(),
                  (args.out / "dragon.png").string()));
  Print(common,
        {{"out", args.out.string()},
         {"report", report.string()},
         {"picture", (args.out / "dragon.png").string()},
         {"seconds", line.total_seconds()},
         {"stages", line.stages()}},
        report.string());
  return 0;
}

}  // namespace

std::function<int()> MakeDemoVerb(CLI::App& app, const Common& common) {
  auto args = std::make_shared<DemoArguments>();
  app.add_option("--out", args->out, "folder for everything that is made")
      ->capture_default_str();
  app.add_option("--mesh", args->mesh, "the object: .ply, .ply.gz, .obj or .off");
  app.add_flag("--quick", args->quick, "a small grid, 256 x 256 pixels, 16 spp");
  app.add_option("--size", args->size, "width and height of the picture, pixels")
      ->capture_default_str()
      ->check(CLI::Range(16, 8192));
  app.add_option("--spp", args->spp, "samples a pixel")
      ->capture_default_str()
      ->check(CLI::Range(1, 65536));
  app.add_option("--terms", args->terms, "terms of the factorization")
      ->capture_default_str()
      ->check(CLI::Range(1, 64));
  return [args, &common] { return Run(*args, common); };
}

}  // namespace nacre::cli
