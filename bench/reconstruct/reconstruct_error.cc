// Errors of the reconstruction against the truth, in units of what photons allow:
//
//   reconstruct_error RIG.toml [--seed N] [--spacing CELLS] [--keep FOLDER]
//   [--no-crosstalk]
//
// captures the rig's session with each of three phantoms (chessboard, marble with
// veins, skin that is nearly homogeneous) in place of its own, calibrates, reconstructs
// and compares with the fast solver that the rig was lit with. --keep keeps sessions
// and takes those that are there. For each phantom, by decades of R_d relative to the
// largest:
//   rms of error / Cramér–Rao bound    of the photons collected in the cell by the
//                                      exposures in which its pixels don't saturate
//   rms of error / stated sigma, and the share of errors within 1 sigma
// and of the totals of slices the bias, mean and worst.

#include "acquire/capture.h"
#include "calibrate/calibrate.h"
#include "core/atomic_file.h"
#include "core/parallel.h"
#include "reconstruct/error_figures.h"
#include "reconstruct/internal/cell_weights.h"
#include "reconstruct/internal/hdr_merge.h"
#include "reconstruct/reconstruct.h"
#include "rigs/simulated_rig.h"
#include "rigs/transport/transport.h"

#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fmt/format.h>
#include <regex>

namespace nacre::reconstruct {
namespace {

using internal::CellLattice;
using internal::RateFrame;

double Seconds() {
  return std::chrono::duration<double>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

struct Arguments {
  std::filesystem::path rig;
  std::filesystem::path folder;
  std::string seed = "4711";
  std::string spacing;
  ReconstructOptions options;
};

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
                    const char* key,
                    const std::string& value) {
  return std::regex_replace(text,
                            std::regex(fmt::format("(^|\n){} = [^\n]*", key)),
                            fmt::format("$1{} = {}", key, value));
}

std::filesystem::path Capture(const Arguments& args, const Sample& sample) {
  const std::filesystem::path folder =
      args.folder / fmt::format("{}-{}-{}-{}",
                                args.rig.stem().string(),
                                sample.name,
                                args.seed,
                                args.spacing.empty() ? "as-is" : args.spacing);
  std::filesystem::create_directories(folder);
  const acquire::RigDescription base = acquire::ReadRig(args.rig);
  WriteFile(
      folder / "phantom.toml",
      fmt::format("[slab]\nthickness_mm = 10.0\neta = {}\n{}[beam]\nshape = "
                  "\"pencil\"\n[grid]\npoints = [{}, {}]\npitch_mm = {}\ncore = {}\n",
                  base.sample.eta,
                  sample.media,
                  base.grid.points_x,
                  base.grid.points_y,
                  base.grid.pitch_mm,
                  base.grid.core));
  std::string rig = Replace(base.text, "phantom", "\"phantom.toml\"");
  if (!args.spacing.empty()) {
    rig = Replace(rig, "spot_spacing_cells", args.spacing);
  }
  WriteFile(folder / "rig.toml", Replace(rig, "seed", args.seed));
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

// Variances of the photons alone: of a rate r seen for as long as it doesn't saturate,
// r / (gain T).
void KeepPhotonNoise(const acquire::SessionReader& session,
                     const calibrate::Calibration& calibration,
                     RateFrame& frame) {
  const double room = calibration.saturation_counts - calibration.dark.Counts(0);
  for (std::size_t k = 0; k < frame.rate.size(); ++k) {
    const double rate = std::max(0.0, static_cast<double>(frame.rate[k]));
    double time_us = 0;
    double shortest_us = 1e30;
    for (const double exposure_us : session.rig().camera.exposures_us) {
      const double signal = rate * exposure_us;
      shortest_us = std::min(shortest_us, exposure_us);
      time_us += signal + 4 * std::sqrt(calibration.VarianceCounts2(signal)) < room
                     ? exposure_us
                     : 0;
    }
    frame.variance[k] = static_cast<float>(
        rate / (calibration.gain_electrons_per_count * std::max(time_us, shortest_us)));
  }
}

struct Decade {
  double count = 0;
  double per_bound2 = 0;
  double per_sigma2 = 0;
  double within = 0;
  double error = 0;
  double truth = 0;
  double error2 = 0;
};

struct Figures {
  std::array<Decade, 6> decades;  // of R_d / peak: down to 0.1, 0.01, …; and all
  double total_bias = 0;
  double total_rms = 0;
  double total_worst = 0;
  double totals = 0;
};

void AddValue(Decade& decade, double truth, double error, double sigma, double bound) {
  decade.count += 1;
  decade.per_bound2 += error * error / (bound * bound);
  decade.per_sigma2 += error * error / (sigma * sigma);
  decade.within += std::abs(error) <= sigma ? 1.0 : 0.0;
  decade.error += error;
  decade.truth += truth;
  decade.error2 += error * error;
}

class Comparison {
 public:
  Comparison(const std::filesystem::path& folder,
             const calibrate::Calibration& calibration)
      : session_(folder / "session"),
        calibration_(calibration),
        reader_(folder / "x.rd.exr"),
        header_(reader_.header()),
        weights_(CellLattice(header_), calibration.camera, 0, 0),
        transport_(rigs::MakeTransport(rigs::ReadPhantom(folder / "phantom.toml"),
                                       rigs::Solver::kFast)) {}

  Figures Run() {
    Figures figures;
    std::vector<PointMm> points;
    for (std::int64_t s = 0; s < header_.PointCount(); ++s) {
      points.push_back(header_.GridPoint(static_cast<int>(s % header_.points_x),
                                         static_cast<int>(s / header_.points_x)));
    }
    std::vector<std::vector<float>> truth(points.size());
    transport_->SolveWindows(points, [&](std::size_t k, rigs::Window&& window) {
      truth[k] = std::move(window.rd);
    });
    float peak = 0;
    for (const auto& window : truth) {
      peak = std::max(peak, *std::max_element(window.begin(), window.end()));
    }
    for (int group = 0; group < session_.schedule().group_count(); ++group) {
      for (int c = 0; c < session_.rig().ChannelCount(); ++c) {
        Compare(group, c, static_cast<double>(peak), truth, figures);
      }
    }
    return figures;
  }

 private:
  RateFrame Rates(int group, int channel) const {
    std::vector<acquire::Frame> frames;
    const acquire::Schedule& schedule = session_.schedule();
    for (std::int64_t n = schedule.grid_begin(); n < schedule.size(); ++n) {
      if (schedule[n].group == group && schedule[n].channel == channel &&
          schedule[n].target == acquire::Target::kSample) {
        frames.push_back(session_.ReadFrame(n));
      }
    }
    RateFrame rates = internal::MergeExposures(frames, calibration_);
    KeepPhotonNoise(session_, calibration_, rates);
    return rates;
  }

  void Compare(int group,
               int channel,
               double peak,
               const std::vector<std::vector<float>>& truths,
               Figures& figures) {
    const RateFrame rates = Rates(group, channel);
    for (const auto& [i, j] : session_.schedule().Group(group)) {
      const RdSlice slice = reader_.ReadSlice(i, j);
      const PointMm x_i = header_.GridPoint(i, j);
      double sum_truth = 0;
      double sum_error = 0;
      for (int cell = 0; cell < header_.WindowSize(); ++cell) {
        const int u = cell % header_.core;
        const int v = cell / header_.core;
        const auto at = static_cast<std::size_t>(channel * header_.WindowSize() + cell);
        if (slice.valid[at] == 0) {
          continue;
        }
        const auto truth = static_cast<double>(
            truths[static_cast<std::size_t>(j * header_.points_x + i)][at]);
        const double error = static_cast<double>(slice.rd[at]) - truth;
        sum_truth += truth;
        sum_error += error;
        const PointMm d = header_.Offset(u, v);
        const PointMm x_o{x_i.x + d.x, x_i.y + d.y};
        const double factor = calibration_.RdPerRate(channel, x_i, x_o, header_.eta);
        const auto value = weights_.Mean(rates, weights_.lattice().Index(i + u, j + v));
        // A mean rate that was measured is as good as the true one, but where few
        // photons came.
        const double bound =
            factor * std::sqrt(value.variance) *
            std::sqrt(truth / std::max(value.mean * factor, 0.5 * truth));
        const double level = std::log10(peak / truth);
        const auto decade = static_cast<std::size_t>(std::clamp(level, 0.0, 4.0));
        const auto sigma = static_cast<double>(slice.sigma[at]);
        AddValue(figures.decades[decade], truth, error, sigma, bound);
        AddValue(figures.decades[5], truth, error, sigma, bound);
      }
      const double total = sum_error / sum_truth;
      figures.total_bias += total;
      figures.total_rms += total * total;
      figures.total_worst = std::max(figures.total_worst, std::abs(total));
      figures.totals += 1;
    }
  }

  acquire::SessionReader session_;
  const calibrate::Calibration& calibration_;
  RdReader reader_;
  RdHeader header_;
  internal::CellWeights weights_;
  std::shared_ptr<const rigs::Transport> transport_;
};

void Print(const Figures& figures) {
  constexpr std::array<const char*, 6> kNames = {
      "1 to 0.1", "0.1 to 0.01", "to 1e-3", "to 1e-4", "below", "all"};
  for (std::size_t n = 0; n < kNames.size(); ++n) {
    const Decade& d = figures.decades[n];
    if (d.count > 0) {
      std::printf(
          "  %-12s %7.0f values: error/bound %6.2f  error/sigma %5.2f  within 1 "
          "sigma %4.1f %%  bias %+.3f %%  rms/mean %.3f %%\n",
          kNames[n],
          d.count,
          std::sqrt(d.per_bound2 / d.count),
          std::sqrt(d.per_sigma2 / d.count),
          100 * d.within / d.count,
          100 * d.error / d.truth,
          100 * std::sqrt(d.error2 / d.count) / (d.truth / d.count));
    }
  }
  std::printf("  totals: bias %+.3f %%, rms %.3f %%, worst %.3f %%\n",
              100 * figures.total_bias / figures.totals,
              100 * std::sqrt(figures.total_rms / figures.totals),
              100 * figures.total_worst);
}

// What reading and decoding the same pictures takes, alone, on as many threads.
double ReadingSeconds(const acquire::SessionReader& session) {
  const double start = Seconds();
  const std::int64_t begin = session.schedule().grid_begin();
  ParallelFor(session.schedule().size() - begin, 0, [&](std::int64_t n) {
    if (session.WasTaken(begin + n)) {
      session.ReadFrame(begin + n);
    }
  });
  return Seconds() - start;
}

void Run(const Arguments& args) {
  for (const Sample& sample : kSamples) {
    double start = Seconds();
    const std::filesystem::path folder = Capture(args, sample);
    const double captured = Seconds() - start;
    const acquire::SessionReader session(folder / "session");
    const calibrate::Calibration calibration = calibrate::Calibrate(session, {});
    ReadingSeconds(session);  // pictures into the system's cache
    const double reading = ReadingSeconds(session);
    start = Seconds();
    const ReconstructSummary summary =
        Reconstruct(session, calibration, folder / "x.rd.exr", args.options);
    const double reconstructed = Seconds() - start;
    std::printf(
        "%s: capture %.1f s; reconstruct %.2f s, reading alone %.2f s (%.0f %%)\n  "
        "%s\n",
        sample.name,
        captured,
        reconstructed,
        reading,
        100 * reading / reconstructed,
        summary.Brief().c_str());
    Print(Comparison(folder, calibration).Run());
    std::fflush(stdout);
  }
}

}  // namespace
}  // namespace nacre::reconstruct

int main(int argc, char** argv) {
  using namespace nacre;
  reconstruct::Arguments args;
  args.folder = std::filesystem::temp_directory_path() / "reconstruct_error";
  bool keep = false;
  for (int n = 1; n < argc; ++n) {
    const std::string argument = argv[n];
    const auto value = [&] { return std::string(n + 1 < argc ? argv[++n] : ""); };
    if (argument == "--seed") {
      args.seed = value();
    } else if (argument == "--spacing") {
      args.spacing = value();
    } else if (argument == "--keep") {
      args.folder = value();
      keep = true;
    } else if (argument == "--specular") {
      args.options.specular_radius_cells = std::atof(value().c_str());
    } else if (argument == "--no-crosstalk") {
      args.options.subtract_crosstalk = false;
    } else {
      args.rig = argument;
    }
  }
  try {
    reconstruct::Run(args);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "reconstruct_error: %s\n", e.what());
    return 1;
  }
  if (!keep) {
    std::filesystem::remove_all(args.folder);
  }
  return 0;
}
