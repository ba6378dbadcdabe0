#include "calibrate/dark.h"

#include "calibrate/internal/pictures.h"
#include "calibrate/internal/smooth_fit.h"
#include "calibrate/mosaic.h"
#include "core/error.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace nacre::calibrate {
namespace {

using acquire::Frame;
using acquire::Target;

// Sums for a line through each pixel's counts over the exposures.
struct Lines {
  double n = 0;
  double t = 0;
  double tt = 0;
  double longest = 0;      // exposure
  std::vector<double> c;   // a pixel
  std::vector<double> tc;  // a pixel

  void Add(const Frame& frame) {
    c.resize(frame.counts.size(), 0.0);
    tc.resize(frame.counts.size(), 0.0);
    n += 1;
    longest = std::max(longest, frame.exposure_us);
    t += frame.exposure_us;
    tt += frame.exposure_us * frame.exposure_us;
    for (std::size_t k = 0; k < c.size(); ++k) {
      c[k] += frame.counts[k];
      tc[k] += frame.exposure_us * frame.counts[k];
    }
  }
  double Determinant() const { return n * tt - t * t; }
  double Slope(std::size_t k) const { return (n * tc[k] - t * c[k]) / Determinant(); }
  double Offset(std::size_t k) const { return (c[k] - Slope(k) * t) / n; }
};

// Sums over pairs of consecutive pictures of one exposure.
struct Pairs {
  double variance = 0;
  double row_variance = 0;  // of row means
  double count = 0;

  void Add(const Frame& first, const Frame& second) {
    const double shift = internal::MeanCounts(first) - internal::MeanCounts(second);
    double square = 0;
    double row_square = 0;
    const auto width = static_cast<std::size_t>(first.width);
    for (std::size_t row = 0; row < first.counts.size(); row += width) {
      double row_sum = 0;
      for (std::size_t k = row; k < row + width; ++k) {
        const double difference = first.counts[k] - second.counts[k] - shift;
        square += difference * difference;
        row_sum += difference;
      }
      row_square += row_sum * row_sum / static_cast<double>(width * width);
    }
    variance += square / (2 * static_cast<double>(first.counts.size() - 1));
    row_variance += row_square / (2.0 * (first.height - 1));
    count += 1;
  }
};

double Median(std::vector<double> values) {
  const auto middle = values.begin() + std::ssize(values) / 2;
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// Hot pixels, and mean and spread of the others' slopes and offsets.
// What is less than a count in the longest exposure is none of a converter's business.
void SortPixels(const Lines& lines, double noise_slope, DarkResult& result) {
  const std::size_t count = lines.c.size();
  std::vector<double> slopes(count);
  for (std::size_t k = 0; k < count; ++k) {
    slopes[k] = lines.Slope(k);
  }
  const double middle = Median(slopes);
  std::vector<double> deviations(count);
  for (std::size_t k = 0; k < count; ++k) {
    deviations[k] = std::abs(slopes[k] - middle);
  }
  constexpr double kPerMedianDeviation = 1.4826;  // of a normal distribution
  const double scatter =
      std::max(kPerMedianDeviation * Median(deviations), noise_slope);
  constexpr double kFarOff = 5;
  constexpr double kLeastCounts = 1;
  const double limit =
      middle + std::max(kFarOff * scatter, kLeastCounts / lines.longest);
  double n = 0;
  double slope = 0;
  double offset = 0;
  for (std::size_t k = 0; k < count; ++k) {
    if (slopes[k] <= limit) {
      n += 1;
      slope += slopes[k];
      offset += lines.Offset(k);
    }
  }
  slope /= n;
  double square = 0;
  for (std::size_t k = 0; k < count; ++k) {
    if (slopes[k] <= limit) {
      square += (slopes[k] - slope) * (slopes[k] - slope) / n;
    } else {
      result.hot_pixels.push_back({static_cast<std::int32_t>(k), slopes[k] - slope});
    }
  }
  result.level.offset_counts = offset / n;
  result.level.rate_counts_per_us = slope;
  result.spread_counts_per_us =
      std::sqrt(std::max(0.0, square - noise_slope * noise_slope));
}

}  // namespace

DarkResult EstimateDarkMaps(const acquire::SessionReader& session) {
  Lines lines;
  Pairs pairs;
  std::optional<Frame> last;
  int rows = 1;
  for (const std::int64_t number : internal::PicturesOf(session, Target::kNothing)) {
    Frame frame = session.ReadFrame(number);
    lines.Add(frame);
    if (session.schedule()[number].repeat > 0) {
      pairs.Add(*last, frame);
    }
    rows = frame.height;
    last = std::move(frame);
  }
  Expect(lines.Determinant() > 0 && pairs.count > 0,
         "pairs of dark pictures at two exposures at least");
  DarkResult result;
  const auto pixels = static_cast<double>(lines.c.size());
  result.variance_counts2 = pairs.variance / pairs.count;
  result.variance_sigma_counts2 =
      result.variance_counts2 * std::sqrt(2 / (pixels * pairs.count));
  const double width = pixels / rows;
  const double row_variance =
      pairs.row_variance / pairs.count - result.variance_counts2 / width;
  const double row_uncertainty =
      pairs.row_variance / pairs.count * std::sqrt(2 / (rows * pairs.count));
  constexpr double kSignificant = 4;
  result.row_noise_counts =
      row_variance > kSignificant * row_uncertainty ? std::sqrt(row_variance) : 0;
  const double noise_slope =
      std::sqrt(result.variance_counts2 * lines.n / lines.Determinant());
  SortPixels(lines, noise_slope, result);
  // A picture's mean varies by its rows' too.
  const double mean_variance = result.variance_counts2 / pixels +
                               result.row_noise_counts * result.row_noise_counts / rows;
  result.level.rate_sigma_counts_per_us =
      std::sqrt(mean_variance * lines.n / lines.Determinant());
  result.level.offset_sigma_counts =
      std::sqrt(mean_variance * lines.tt / lines.Determinant());
  return result;
}

SmoothField EstimateAmbient(const acquire::SessionReader& session,
                            const DarkResult& dark,
                            const Linearity& linearity,
                            const ColourFilters& filters,
                            int pose) {
  const std::vector<std::int64_t> numbers =
      internal::PicturesOf(session, Target::kAmbient, -1, pose);
  if (numbers.empty()) {
    return {};
  }
  std::vector<float> rates;
  int width = 0;
  double exposure_us = 0;
  for (const std::int64_t number : numbers) {
    const Frame frame = session.ReadFrame(number);
    width = frame.width;
    exposure_us = frame.exposure_us;
    rates.resize(frame.counts.size(), 0.0F);
    const double level = dark.level.Counts(exposure_us);
    const double scale = exposure_us * static_cast<double>(numbers.size());
    for (std::size_t k = 0; k < rates.size(); ++k) {
      rates[k] += static_cast<float>(linearity.Linear(frame.counts[k] - level) / scale);
    }
  }
  Balance(filters.mosaic, filters.ambient, width, rates);
  constexpr int kSide = 8;
  constexpr int kDegree = 4;
  const std::vector<internal::Block> blocks = internal::BlockMeans(
      rates, width, kSide, internal::MaskOf(dark.hot_pixels, rates.size()));
  SmoothField field = internal::FitSmoothField(blocks, kDegree);
  // What all pixels have in common is not in the residuals.
  const double common = dark.level.offset_sigma_counts / exposure_us +
                        dark.level.rate_sigma_counts_per_us;
  field.sigma = std::hypot(field.sigma, common);
  double mean = 0;
  for (const internal::Block& block : blocks) {
    mean += block.mean / static_cast<double>(blocks.size());
  }
  constexpr double kSignificant = 4;
  return std::abs(mean) > kSignificant * field.sigma ? field : SmoothField();
}

}  // namespace nacre::calibrate
