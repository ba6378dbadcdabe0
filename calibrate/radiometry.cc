#include "calibrate/radiometry.h"

#include "acquire/mosaic.h"
#include "calibrate/internal/pictures.h"
#include "calibrate/mosaic.h"
#include "core/error.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <fmt/format.h>

namespace nacre::calibrate {
namespace {

using acquire::Frame;
using acquire::Target;

// What a pair of pictures of the same scene says.
struct Pair {
  double mean_counts = 0;
  double variance_counts2 = 0;  // of one picture's pixel, from one time to the next
};

// The counts of one colour of a mosaic; all of a monochrome picture.
std::vector<std::uint16_t> CountsOf(const Frame& frame,
                                    const std::string& mosaic,
                                    int colour) {
  if (!acquire::IsMosaic(mosaic)) {
    return frame.counts;
  }
  std::vector<std::uint16_t> counts;
  for (const MosaicPlane& plane : PlanesOf(mosaic)) {
    for (int y = plane.row; plane.colour == colour && y < frame.height;
         y += plane.step) {
      for (int x = plane.column; x < frame.width; x += plane.step) {
        counts.push_back(
            frame.counts[static_cast<std::size_t>(std::int64_t{y} * frame.width + x)]);
      }
    }
  }
  return counts;
}

double Mean(const std::vector<std::uint16_t>& counts) {
  std::uint64_t sum = 0;
  for (const std::uint16_t count : counts) {
    sum += count;
  }
  return static_cast<double>(sum) / static_cast<double>(counts.size());
}

Pair ComparePair(const std::vector<std::uint16_t>& first,
                 const std::vector<std::uint16_t>& second) {
  const double first_mean = Mean(first);
  const double second_mean = Mean(second);
  const double shift = first_mean - second_mean;  // the light may have drifted
  double square_sum = 0;
  for (std::size_t k = 0; k < first.size(); ++k) {
    const double difference = first[k] - second[k] - shift;
    square_sum += difference * difference;
  }
  return {.mean_counts = 0.5 * (first_mean + second_mean),
          .variance_counts2 = square_sum / (2 * static_cast<double>(first.size() - 1))};
}

// The count around which a saturated picture's pixels pile up, less six of its standard
// deviations.
double PileUp(const std::vector<std::uint16_t>& counts, double variance_counts2) {
  std::vector<std::int64_t> histogram(1 << 16, 0);
  for (const std::uint16_t count : counts) {
    ++histogram[count];
  }
  const auto mode = std::max_element(histogram.begin(), histogram.end());
  return static_cast<double>(mode - histogram.begin()) -
         6 * std::sqrt(variance_counts2);
}

// A line through the dark pictures' variance. The variance of a variance goes as its
// square: weights 1 / variance², times the number of pixels.
struct Line {
  double product = 0;
  double square = 0;
  double significance = 0;  // of the clearest pair's shot noise

  double Slope() const { return product / square; }
};

// Adds the pairs of one colour, from dark to bright: a pair is judged by the ones
// before it. Returns from which counts on pixels saturate, if they do.
double AddPairs(const acquire::SessionReader& session,
                const DarkResult& dark,
                const Linearity& linearity,
                int colour,
                Line& line) {
  const acquire::CameraInfo& camera = session.manifest().camera;
  std::vector<std::int64_t> numbers = internal::PicturesOf(session, Target::kFlat);
  std::stable_sort(numbers.begin(), numbers.end(), [&](auto a, auto b) {
    return session.schedule()[a].exposure_us < session.schedule()[b].exposure_us;
  });
  for (std::size_t k = 0; k + 1 < numbers.size(); k += 2) {
    const Frame frame = session.ReadFrame(numbers[k]);
    const auto first = CountsOf(frame, camera.mosaic, colour);
    const Pair pair = ComparePair(
        first, CountsOf(session.ReadFrame(numbers[k + 1]), camera.mosaic, colour));
    const double counts = pair.mean_counts - dark.level.Counts(frame.exposure_us);
    const double signal = linearity.Linear(counts);
    const double slope = linearity.Slope(counts);
    const double variance = slope * slope * pair.variance_counts2;
    const double excess = variance - slope * slope * dark.variance_counts2;
    if (line.square > 0 && excess < 0.5 * signal * line.Slope()) {
      return PileUp(first, dark.variance_counts2);
    }
    const auto pixels = static_cast<double>(first.size());
    const double weight = pixels / (variance * variance);
    line.product += weight * signal * excess;
    line.square += weight * signal * signal;
    line.significance =
        std::max(line.significance, excess / (variance * std::sqrt(2 / pixels)));
  }
  return HUGE_VAL;
}

}  // namespace

PhotonTransfer EstimatePhotonTransfer(const acquire::SessionReader& session,
                                      const DarkResult& dark,
                                      const Linearity& linearity) {
  PhotonTransfer result;
  result.saturation_counts = (1 << session.manifest().camera.bit_depth) - 1;
  Line line;
  const int colours = acquire::IsMosaic(session.manifest().camera.mosaic) ? 3 : 1;
  for (int colour = 0; colour < colours; ++colour) {
    result.saturation_counts = std::min(
        result.saturation_counts, AddPairs(session, dark, linearity, colour, line));
  }
  constexpr double kMinSignificance = 20;  // the gain to 5 %
  if (!(line.significance >= kMinSignificance && line.product > 0)) {
    throw BadData(
        fmt::format("{}: the flat pictures are hardly noisier than the dark ones; "
                    "was the white card lit, and are flat_exposures_us long "
                    "enough to see it?",
                    session.folder().string()));
  }
  result.gain_electrons_per_count = 1 / line.Slope();
  // The slope's variance is 2 / Σ weight · signal².
  result.gain_sigma_electrons_per_count = result.gain_electrons_per_count *
                                          result.gain_electrons_per_count *
                                          std::sqrt(2 / line.square);
  constexpr double kRounding = 1.0 / 12;
  const double read_variance = std::max(
      dark.variance_counts2 - kRounding - dark.row_noise_counts * dark.row_noise_counts,
      0.0);
  result.read_noise_electrons =
      std::sqrt(read_variance) * result.gain_electrons_per_count;
  if (read_variance > 0) {
    result.read_noise_sigma_electrons =
        result.read_noise_electrons *
        std::hypot(
            0.5 * dark.variance_sigma_counts2 / read_variance,
            result.gain_sigma_electrons_per_count / result.gain_electrons_per_count);
  }
  return result;
}

}  // namespace nacre::calibrate
