#include "calibrate/radiometry.h"

#include "calibrate/internal/pictures.h"
#include "core/error.h"

#include <algorithm>
#include <cmath>
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

Pair ComparePair(const Frame& first, const Frame& second) {
  const double first_mean = internal::MeanCounts(first);
  const double second_mean = internal::MeanCounts(second);
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

PhotonTransfer EstimatePhotonTransfer(const acquire::SessionReader& session,
                                      const DarkResult& dark,
                                      const Linearity& linearity) {
  const double dark_variance = dark.variance_counts2;
  PhotonTransfer result;
  result.saturation_counts = (1 << session.manifest().camera.bit_depth) - 1;
  std::vector<std::int64_t> numbers = internal::PicturesOf(session, Target::kFlat);
  // From dark to bright: a pair is judged by the ones before it.
  std::stable_sort(numbers.begin(), numbers.end(), [&](auto a, auto b) {
    return session.schedule()[a].exposure_us < session.schedule()[b].exposure_us;
  });
  // A line through the dark pictures' variance. The variance of a variance goes as its
  // square: weights 1 / variance².
  double weighted_product = 0;
  double weighted_square = 0;
  double pixels = 1;
  double significance = 0;  // of the clearest pair's shot noise
  for (std::size_t k = 0; k + 1 < numbers.size(); k += 2) {
    const Frame first = session.ReadFrame(numbers[k]);
    const Pair pair = ComparePair(first, session.ReadFrame(numbers[k + 1]));
    const double counts = pair.mean_counts - dark.level.Counts(first.exposure_us);
    const double signal = linearity.Linear(counts);
    const double slope = linearity.Slope(counts);
    const double variance = slope * slope * pair.variance_counts2;
    const double excess = variance - slope * slope * dark_variance;
    if (weighted_square > 0) {
      const double expected = signal * weighted_product / weighted_square;
      if (excess < 0.5 * expected) {
        result.saturation_counts =
            std::min(result.saturation_counts, PileUp(first, dark_variance));
        break;
      }
    }
    const double weight = 1 / (variance * variance);
    weighted_product += weight * signal * excess;
    weighted_square += weight * signal * signal;
    const auto pixel_count = static_cast<double>(first.counts.size());
    pixels = pixel_count;
    significance =
        std::max(significance, excess / (variance * std::sqrt(2 / pixel_count)));
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
  // The slope's variance is (2 / pixels) / Σ weight · signal².
  result.gain_sigma_electrons_per_count = result.gain_electrons_per_count *
                                          result.gain_electrons_per_count *
                                          std::sqrt(2 / (pixels * weighted_square));
  constexpr double kRounding = 1.0 / 12;
  const double read_variance = std::max(
      dark_variance - kRounding - dark.row_noise_counts * dark.row_noise_counts, 0.0);
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
