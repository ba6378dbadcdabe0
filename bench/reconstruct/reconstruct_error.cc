// Errors of the reconstruction against the truth, in units of what photons allow:
//
//   reconstruct_error RIG.toml [--seed N] [--phantom NAME] [--spacing CELLS]
//   [--set KEY=VALUE]… [--keep FOLDER] [--values FOLDER] [--no-crosstalk]
//   [--at-grid]
//
// captures the rig's session with each of three phantoms (chessboard, marble with
// veins, skin that is nearly homogeneous) in place of its own, calibrates, reconstructs
// and compares with the fast solver that the rig was lit with. --set changes a key of
// the rig file, --keep keeps sessions and takes those that are there, --values writes
// each value as float32 (Value, below). For each phantom, by decades of R_d relative to
// the largest, the truth being R_d at the points that the beams really lit (with
// --at-grid: at the grid points that they were aimed at):
//   rms of error / Cramér–Rao bound    of the photons collected by the exposures in
//                                      which pixels don't saturate, for R_d of a pencil
//                                      of light: without bias that takes the inverse of
//                                      the known blur by spot and lens
//   rms of error / the same with the sensor's own noise
//   rms of error / noise of the cell's photons, as if there were no blur
//   rms of error / stated sigma, and the share of errors within 1 sigma
// and of the totals of slices the bias, mean and worst.

#include "calibrate/calibrate.h"
#include "calibrate/glare.h"
#include "core/parallel.h"
#include "reconstruct/internal/cell_weights.h"
#include "reconstruct/internal/hdr_merge.h"
#include "reconstruct/internal/spot_width.h"
#include "reconstruct/reconstruct.h"
#include "rigs/transport/transport.h"

#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "error_classes.h"
#include "error_sessions.h"

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
  bench::ErrorSession session;
  std::vector<std::string> phantoms = bench::ErrorPhantoms();
  std::filesystem::path values;
  bool at_grid = false;
  ReconstructOptions options;
};

// Variances of a rate r that is seen for as long as it doesn't saturate: of the photons
// alone, r / (gain T), or of the calibrated sensor.
RateFrame WithNoise(const acquire::SessionReader& session,
                    const calibrate::Calibration& calibration,
                    bool photons_alone,
                    RateFrame frame) {
  const double room = calibration.saturation_counts - calibration.dark.Counts(0);
  for (std::size_t k = 0; k < frame.rate.size(); ++k) {
    const double rate = std::max(0.0, static_cast<double>(frame.rate[k]));
    double information = 0;
    for (const double exposure_us : session.rig().camera.exposures_us) {
      const double signal = rate * exposure_us;
      const bool is_shortest = exposure_us == session.rig().camera.exposures_us.back();
      const double all = calibration.VarianceCounts2(signal);
      const double variance =
          photons_alone ? all - calibration.VarianceCounts2(0) : all;
      if (is_shortest || signal + 4 * std::sqrt(all) < room) {
        information += exposure_us * exposure_us / std::max(variance, 1e-12);
      }
    }
    frame.variance[k] = static_cast<float>(1 / information);
  }
  return frame;
}

class Comparison {
 public:
  Comparison(const std::filesystem::path& folder,
             const calibrate::Calibration& calibration,
             bool at_grid)
      : folder_(folder),
        at_grid_(at_grid),
        session_(folder / "session"),
        calibration_(calibration),
        reader_(folder / "x.rd.exr"),
        header_(reader_.header()),
        weights_(CellLattice(header_), calibration.camera, {}, 0),
        sharp_weights_(CellLattice(header_),
                       calibration.camera,
                       internal::SpotOf(session_, calibration),
                       0),
        glare_(calibration.corrections.glare,
               calibration.camera.width_px,
               calibration.camera.height_px),
        transport_(rigs::MakeTransport(rigs::ReadPhantom(folder / "phantom.toml"),
                                       rigs::Solver::kFast)) {}

  /// `each` is told of every valid value.
  template <class Each>
  Figures Run(Each&& each) {
    Figures figures;
    const std::vector<std::vector<float>> truth = Truth(figures);
    for (const auto& window : truth) {
      peak_ = std::max(peak_, *std::max_element(window.begin(), window.end()));
    }
    for (int group = 0; group < session_.schedule().group_count(); ++group) {
      for (int c = 0; c < session_.rig().ChannelCount(); ++c) {
        Compare(group, c, truth, figures, each);
      }
    }
    return figures;
  }

 private:
  std::vector<PointMm> GridPoints() const {
    std::vector<PointMm> points;
    for (std::int64_t s = 0; s < header_.PointCount(); ++s) {
      points.push_back(header_.GridPoint(static_cast<int>(s % header_.points_x),
                                         static_cast<int>(s / header_.points_x)));
    }
    return points;
  }

  std::vector<std::vector<float>> Truth(Figures& figures) const {
    const std::vector<PointMm> grid = GridPoints();
    std::vector<std::vector<PointMm>> lit(grid.size());
    for (std::size_t s = 0; s < grid.size(); ++s) {
      lit[s] = {grid[s]};
    }
    if (!at_grid_) {
      lit = bench::PointsLit(folder_, session_);
    }
    std::vector<PointMm> points;
    std::vector<std::size_t> slices;
    double square = 0;
    for (std::size_t s = 0; s < grid.size(); ++s) {
      PointMm off;
      for (const PointMm& point : lit[s]) {
        points.push_back(point);
        slices.push_back(s);
        off.x += (point.x - grid[s].x) / static_cast<double>(lit[s].size());
        off.y += (point.y - grid[s].y) / static_cast<double>(lit[s].size());
      }
      square += off.x * off.x + off.y * off.y;
    }
    figures.aside_mm = std::sqrt(square / static_cast<double>(grid.size()));
    std::vector<std::vector<float>> truth(grid.size());
    transport_->SolveWindows(points, [&](std::size_t k, rigs::Window&& window) {
      std::vector<float>& mean = truth[slices[k]];
      mean.resize(window.rd.size(), 0.0F);
      for (std::size_t at = 0; at < mean.size(); ++at) {
        mean[at] += window.rd[at] / static_cast<float>(lit[slices[k]].size());
      }
    });
    return truth;
  }

  RateFrame Rates(int group, int channel) const {
    std::vector<acquire::Frame> frames;
    const acquire::Schedule& schedule = session_.schedule();
    for (std::int64_t n = schedule.grid_begin(); n < schedule.size(); ++n) {
      if (schedule[n].group == group && schedule[n].channel == channel &&
          schedule[n].target == acquire::Target::kSample) {
        frames.push_back(session_.ReadFrame(n));
      }
    }
    return internal::MergeExposures(frames, calibration_);
  }

  template <class Each>
  void Compare(int group,
               int channel,
               const std::vector<std::vector<float>>& truths,
               Figures& figures,
               Each&& each) {
    const RateFrame merged = Rates(group, channel);
    const RateFrame photons = WithNoise(session_, calibration_, true, merged);
    const RateFrame sensor = WithNoise(session_, calibration_, false, merged);
    RateFrame sharp = merged;
    glare_.Remove(sharp.rate);
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
        const float truth =
            truths[static_cast<std::size_t>(j * header_.points_x + i)][at];
        const PointMm d = header_.Offset(u, v);
        const PointMm x_o{x_i.x + d.x, x_i.y + d.y};
        const double factor = calibration_.RdPerRate(channel, x_i, x_o, header_.eta);
        const std::int64_t at_lattice = weights_.lattice().Index(i + u, j + v);
        const auto seen = weights_.Mean(photons, at_lattice);
        const double mean = factor * seen.mean;
        // A mean rate that was measured is as good as the true one, but where few
        // photons came.
        const double few = std::sqrt(static_cast<double>(truth) /
                                     std::max(mean, 0.5 * static_cast<double>(truth)));
        const Value value{
            .channel = static_cast<float>(channel),
            .i = static_cast<float>(i),
            .j = static_cast<float>(j),
            .u = static_cast<float>(u),
            .v = static_cast<float>(v),
            .truth = truth,
            .rd = slice.rd[at],
            .sigma = slice.sigma[at],
            .bound = static_cast<float>(
                factor * few *
                std::sqrt(sharp_weights_.Mean(photons, at_lattice).variance)),
            .sensor_bound = static_cast<float>(
                factor * std::sqrt(sharp_weights_.Mean(sensor, at_lattice).variance)),
            .plain = static_cast<float>(factor * std::sqrt(seen.variance) * few),
            .glare = static_cast<float>(
                mean - factor * weights_.Mean(sharp, at_lattice).mean)};
        const float level = std::log10(peak_ / truth);
        figures.decades[static_cast<std::size_t>(std::clamp(level, 0.0F, 4.0F))].Add(
            value);
        figures.decades[5].Add(value);
        each(value);
        sum_truth += static_cast<double>(truth);
        sum_error += static_cast<double>(slice.rd[at] - truth);
      }
      const double total = sum_error / sum_truth;
      figures.total_bias += total;
      figures.total_rms += total * total;
      figures.total_worst = std::max(figures.total_worst, std::abs(total));
      figures.totals += 1;
    }
  }

  std::filesystem::path folder_;
  bool at_grid_;
  acquire::SessionReader session_;
  const calibrate::Calibration& calibration_;
  RdReader reader_;
  RdHeader header_;
  internal::CellWeights weights_;
  internal::CellWeights sharp_weights_;
  calibrate::GlareFilter glare_;
  std::shared_ptr<const rigs::Transport> transport_;
  float peak_ = 0;
};

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
  for (const std::string& phantom : args.phantoms) {
    double start = Seconds();
    bench::ErrorSession wanted = args.session;
    wanted.phantom = phantom;
    const std::filesystem::path folder = bench::CaptureErrorSession(wanted);
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
        phantom.c_str(),
        captured,
        reconstructed,
        reading,
        100 * reading / reconstructed,
        summary.Brief().c_str());
    for (const std::string& warning : summary.warnings) {
      std::printf("  %s\n", warning.c_str());
    }
    std::FILE* file = args.values.empty()
                          ? nullptr
                          : std::fopen((args.values / phantom).c_str(), "wb");
    Print(Comparison(folder, calibration, args.at_grid).Run([&](const Value& value) {
      if (file != nullptr) {
        std::fwrite(&value, sizeof(value), 1, file);
      }
    }));
    if (file != nullptr) {
      std::fclose(file);
    }
    std::fflush(stdout);
  }
}

}  // namespace
}  // namespace nacre::reconstruct

int main(int argc, char** argv) {
  using namespace nacre;
  reconstruct::Arguments args;
  args.session.folder = std::filesystem::temp_directory_path() / "reconstruct_error";
  bool keep = false;
  for (int n = 1; n < argc; ++n) {
    const std::string argument = argv[n];
    const auto value = [&] { return std::string(n + 1 < argc ? argv[++n] : ""); };
    if (argument == "--seed") {
      args.session.seed = value();
    } else if (argument == "--spacing") {
      args.session.changes.emplace_back("spot_spacing_cells", value());
    } else if (argument == "--at-grid") {
      args.at_grid = true;
    } else if (argument == "--phantom") {
      args.phantoms = {value()};
    } else if (argument == "--values") {
      args.values = value();
    } else if (argument == "--set") {
      const std::string text = value();
      const std::size_t equals = std::min(text.find('='), text.size() - 1);
      args.session.changes.emplace_back(text.substr(0, equals),
                                        text.substr(equals + 1));
    } else if (argument == "--keep") {
      args.session.folder = value();
      keep = true;
    } else if (argument == "--specular") {
      args.options.specular_radius_cells = std::atof(value().c_str());
    } else if (argument == "--no-crosstalk") {
      args.options.subtract_crosstalk = false;
    } else {
      args.session.rig = argument;
    }
  }
  try {
    reconstruct::Run(args);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "reconstruct_error: %s\n", e.what());
    return 1;
  }
  if (!keep) {
    std::filesystem::remove_all(args.session.folder);
  }
  return 0;
}
