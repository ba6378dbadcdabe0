#include "calibrate/radiometry.h"

#include "core/error.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <map>
#include <numbers>
#include <numeric>
#include <optional>

namespace nacre::calibrate {
namespace {

using acquire::Frame;
using acquire::Target;

double MeanCounts(const Frame& frame) {
  std::uint64_t sum = 0;
  for (const std::uint16_t count : frame.counts) {
    sum += count;
  }
  return static_cast<double>(sum) / static_cast<double>(frame.counts.size());
}

// What a pair of pictures of the same scene says.
struct Pair {
  double mean_counts = 0;
  double variance_counts2 = 0;  // of one picture's pixel, from one time to the next
};

Pair ComparePair(const Frame& first, const Frame& second) {
  const double first_mean = MeanCounts(first);
  const double second_mean = MeanCounts(second);
  const double shift = first_mean - second_mean;  // the light may have drifted
  double square_sum = 0;
  for (std::size_t k = 0; k < first.counts.size(); ++k) {
    const double difference = first.counts[k] - second.counts[k] - shift;
    square_sum += difference * difference;
  }
  return {.mean_counts = 0.5 * (first_mean + second_mean),
          .variance_counts2 =
              square_sum / (2 * static_cast<double>(first.counts.size() - 1))};
}

// Numbers of the pictures of a target, in order.
std::vector<std::int64_t> PicturesOf(const acquire::SessionReader& session,
                                     Target target) {
  std::vector<std::int64_t> numbers;
  for (std::int64_t k = 0; k < session.schedule().grid_begin(); ++k) {
    if (session.schedule()[k].target == target) {
      numbers.push_back(k);
    }
  }
  return numbers;
}

// The mean variance of consecutive dark pictures of one exposure. Dark current adds
// shot noise of its own; it is part of the noise floor and is averaged into it.
double DarkVariance(const acquire::SessionReader& session) {
  double sum = 0;
  int pair_count = 0;
  std::optional<Frame> last;
  for (const std::int64_t number : PicturesOf(session, Target::kNothing)) {
    Frame frame = session.ReadFrame(number);
    if (session.schedule()[number].repeat > 0) {
      sum += ComparePair(*last, frame).variance_counts2;
      ++pair_count;
    }
    last = std::move(frame);
  }
  return sum / pair_count;
}

// The count around which a saturated picture's pixels pile up, less six of its standard
// deviations.
double PileUp(const Frame& frame, double variance_counts2) {
  std::vector<std::int64_t> histogram(1 << 16, 0);
  for (const std::uint16_t count : frame.counts) {
    ++histogram[count];
  }
  const auto mode = std::max_element(histogram.begin(), histogram.end());
  return static_cast<double>(mode - histogram.begin()) -
         6 * std::sqrt(variance_counts2);
}

}  // namespace

DarkLevel EstimateDark(const acquire::SessionReader& session) {
  // Sums for a line through (exposure, mean counts).
  double n = 0;
  double sx = 0;
  double sy = 0;
  double sxx = 0;
  double sxy = 0;
  for (const std::int64_t number : PicturesOf(session, Target::kNothing)) {
    const Frame frame = session.ReadFrame(number);
    const double mean_counts = MeanCounts(frame);
    n += 1;
    sx += frame.exposure_us;
    sy += mean_counts;
    sxx += frame.exposure_us * frame.exposure_us;
    sxy += frame.exposure_us * mean_counts;
  }
  const double determinant = n * sxx - sx * sx;
  Expect(determinant > 0, "dark pictures at two exposures at least");
  const double rate = (n * sxy - sx * sy) / determinant;
  return {.offset_counts = (sy - rate * sx) / n, .rate_counts_per_us = rate};
}

PhotonTransfer EstimatePhotonTransfer(const acquire::SessionReader& session,
                                      const DarkLevel& dark) {
  const double dark_variance = DarkVariance(session);
  PhotonTransfer result;
  result.saturation_counts = (1 << session.manifest().camera.bit_depth) - 1;
  std::vector<std::int64_t> numbers = PicturesOf(session, Target::kFlat);
  // From dark to bright: a pair is judged by the ones before it.
  std::stable_sort(numbers.begin(), numbers.end(), [&](auto a, auto b) {
    return session.schedule()[a].exposure_us < session.schedule()[b].exposure_us;
  });
  // A line through the dark pictures' variance. The variance of a variance goes as its
  // square: weights 1 / variance².
  double weighted_product = 0;
  double weighted_square = 0;
  double significance = 0;  // of the clearest pair's shot noise
  for (std::size_t k = 0; k + 1 < numbers.size(); k += 2) {
    const Frame first = session.ReadFrame(numbers[k]);
    const Pair pair = ComparePair(first, session.ReadFrame(numbers[k + 1]));
    const double signal = pair.mean_counts - dark.Counts(first.exposure_us);
    const double excess = pair.variance_counts2 - dark_variance;
    if (weighted_square > 0) {
      const double expected = signal * weighted_product / weighted_square;
      if (excess < 0.5 * expected) {
        result.saturation_counts =
            std::min(result.saturation_counts, PileUp(first, dark_variance));
        break;
      }
    }
    const double weight = 1 / (pair.variance_counts2 * pair.variance_counts2);
    weighted_product += weight * signal * excess;
    weighted_square += weight * signal * signal;
    const double pixel_count = static_cast<double>(first.counts.size());
    significance = std::max(
        significance, excess / (pair.variance_counts2 * std::sqrt(2 / pixel_count)));
  }
  constexpr double kMinSignificance = 20;  // the gain to 5 %
  if (!(significance >= kMinSignificance && weighted_product > 0)) {
    throw BadData(
        fmt::format("{}: the flat pictures are hardly noisier than the dark ones; "
                    "was the white card lit, and are flat_exposures_us long "
                    "enough to see it?",
                    session.folder().string()));
  }
  result.gain_electrons_per_count = weighted_square / weighted_product;
  constexpr double kRounding = 1.0 / 12;
  result.read_noise_electrons = std::sqrt(std::max(dark_variance - kRounding, 0.0)) *
                                result.gain_electrons_per_count;
  return result;
}

}  // namespace nacre::calibrate
