#include "calibrate/response.h"

#include "acquire/mosaic.h"
#include "calibrate/internal/pictures.h"
#include "calibrate/internal/smooth_fit.h"
#include "core/error.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace nacre::calibrate {
namespace {

using acquire::Frame;
using acquire::Target;

// Which pixels to leave out, one set a colour: the hot ones and the other colours'.
std::vector<std::vector<bool>> Excluded(const acquire::SessionReader& session,
                                        const DarkResult& dark) {
  const acquire::CameraInfo& camera = session.manifest().camera;
  const auto pixels =
      static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
  const std::vector<bool> hot = internal::MaskOf(dark.hot_pixels, pixels);
  if (!acquire::IsMosaic(camera.mosaic)) {
    return {hot};
  }
  std::vector<std::vector<bool>> excluded(3, std::vector<bool>(pixels, true));
  for (std::size_t k = 0; k < pixels; ++k) {
    const auto width = static_cast<std::size_t>(camera.width);
    const int colour = acquire::ColourAt(
        camera.mosaic, static_cast<int>(k % width), static_cast<int>(k / width));
    excluded[static_cast<std::size_t>(colour)][k] = !hot.empty() && hot[k];
  }
  return excluded;
}

// Counts above dark of the white card, the mean of all its pictures at an exposure.
// Those of which a thousandth reaches saturation are left out.
std::map<double, std::vector<float>> CardSignals(const acquire::SessionReader& session,
                                                 const DarkResult& dark,
                                                 double saturation_counts,
                                                 const std::vector<bool>& excluded) {
  std::map<double, std::vector<float>> sums;
  std::map<double, int> counts;
  for (const std::int64_t number : internal::PicturesOf(session, Target::kFlat)) {
    const Frame frame = session.ReadFrame(number);
    std::ptrdiff_t full = 0;
    for (std::size_t k = 0; k < frame.counts.size(); ++k) {
      full += frame.counts[k] >= saturation_counts && (excluded.empty() || !excluded[k])
                  ? 1
                  : 0;
    }
    const double level = dark.level.Counts(frame.exposure_us);
    const auto most = static_cast<std::ptrdiff_t>(frame.counts.size() / 1000);
    if (full > most) {
      continue;
    }
    std::vector<float>& sum = sums[frame.exposure_us];
    sum.resize(frame.counts.size(), 0.0F);
    for (std::size_t k = 0; k < sum.size(); ++k) {
      sum[k] += static_cast<float>(frame.counts[k] - level);
    }
    ++counts[frame.exposure_us];
  }
  for (auto& [exposure_us, sum] : sums) {
    for (float& value : sum) {
      value /= static_cast<float>(counts[exposure_us]);
    }
  }
  return sums;
}

// One block at all exposures.
struct Column {
  std::vector<double> t;
  std::vector<double> c;
};

double Dot(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0;
  for (std::size_t k = 0; k < a.size(); ++k) {
    sum += a[k] * b[k];
  }
  return sum;
}

// Divided by √variance, which goes as the counts; what a rate explains taken off.
std::vector<double> Reduced(std::vector<double> values, const Column& column) {
  std::vector<double> t = column.t;
  for (std::size_t k = 0; k < t.size(); ++k) {
    const double weight = 1 / std::sqrt(std::max(column.c[k], 1.0));
    t[k] *= weight;
    values[k] *= weight;
  }
  const double rate = Dot(values, t) / Dot(t, t);
  for (std::size_t k = 0; k < t.size(); ++k) {
    values[k] -= rate * t[k];
  }
  return values;
}

// Σ over blocks of the 2 × 2 normal equations of c + b1 c² + b2 c³ = rate · t.
Linearity FitLinearity(const std::vector<Column>& columns, double saturation) {
  double a11 = 0;
  double a12 = 0;
  double a22 = 0;
  double r1 = 0;
  double r2 = 0;
  double rr = 0;
  double n = 0;
  for (const Column& column : columns) {
    std::vector<double> square;
    std::vector<double> cube;
    for (const double c : column.c) {
      const double x = c / saturation;
      square.push_back(c * x);
      cube.push_back(c * x * x);
    }
    const std::vector<double> y = Reduced(column.c, column);
    const std::vector<double> x1 = Reduced(square, column);
    const std::vector<double> x2 = Reduced(cube, column);
    a11 += Dot(x1, x1);
    a12 += Dot(x1, x2);
    a22 += Dot(x2, x2);
    r1 -= Dot(x1, y);
    r2 -= Dot(x2, y);
    rr += Dot(y, y);
    n += static_cast<double>(y.size()) - 1;
  }
  const double determinant = a11 * a22 - a12 * a12;
  if (!(determinant > 1e-9 * a11 * a22)) {
    return {};
  }
  const double b1 = (r1 * a22 - r2 * a12) / determinant;
  const double b2 = (r2 * a11 - r1 * a12) / determinant;
  const double chi2 = std::max(0.0, rr - b1 * r1 - b2 * r2) / std::max(1.0, n - 2);
  return {.b1_per_count = b1 / saturation,
          .b2_per_count2 = b2 / (saturation * saturation),
          // Of b1 + b2: the variances and twice the covariance.
          .sigma_at_saturation =
              std::sqrt(chi2 * std::max(0.0, a22 + a11 - 2 * a12) / determinant)};
}

}  // namespace

ResponseResult EstimateResponse(const acquire::SessionReader& session,
                                const DarkResult& dark,
                                double saturation_counts) {
  const int width = session.manifest().camera.width;
  constexpr int kSide = 16;
  constexpr std::size_t kFewestExposures = 3;
  std::vector<Column> columns;
  for (const std::vector<bool>& excluded : Excluded(session, dark)) {
    const auto signals = CardSignals(session, dark, saturation_counts, excluded);
    if (signals.size() < kFewestExposures) {
      continue;
    }
    const std::size_t first = columns.size();
    for (const auto& [exposure_us, signal] : signals) {
      const auto blocks = internal::BlockMeans(signal, width, kSide, excluded);
      columns.resize(first + blocks.size());
      for (std::size_t k = 0; k < blocks.size(); ++k) {
        columns[first + k].t.push_back(exposure_us);
        columns[first + k].c.push_back(blocks[k].mean);
      }
    }
  }
  ResponseResult result;
  if (columns.empty()) {
    return result;
  }
  result.linearity = FitLinearity(columns, saturation_counts);
  for (const Column& column : columns) {
    std::vector<double> linear;
    for (const double c : column.c) {
      linear.push_back(result.linearity.Linear(c));
    }
    const double rate = Dot(linear, column.t) / Dot(column.t, column.t);
    for (std::size_t k = 0; k < linear.size(); ++k) {
      const double expected = rate * column.t[k];
      result.points.push_back({.counts = column.c[k],
                               .exposure_us = column.t[k],
                               .deviation = column.c[k] / expected - 1,
                               .residual = linear[k] / expected - 1});
    }
  }
  return result;
}

FlatResult EstimateFlatField(const acquire::SessionReader& session,
                             const DarkResult& dark,
                             const Linearity& linearity,
                             double saturation_counts,
                             double gain_electrons_per_count) {
  const acquire::CameraInfo& camera = session.manifest().camera;
  const auto pixels =
      static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
  std::vector<float> relative(pixels, 0.0F);
  std::vector<bool> unknown(pixels, true);
  double variance = 0;  // of a pixel, relative; the mean over colours
  double colours = 0;
  for (const std::vector<bool>& excluded : Excluded(session, dark)) {
    const auto signals = CardSignals(session, dark, saturation_counts, excluded);
    if (signals.empty()) {
      continue;
    }
    // Long exposures know most: weights are the exposures, the sum is of counts.
    std::vector<double> sum(pixels, 0.0);
    double counts = 0;
    double count = 0;
    for (std::size_t k = 0; k < pixels; ++k) {
      if (!excluded.empty() && excluded[k]) {
        continue;
      }
      for (const auto& [exposure_us, signal] : signals) {
        sum[k] += linearity.Linear(static_cast<double>(signal[k]));
      }
      counts += sum[k];
      count += 1;
      unknown[k] = false;
    }
    const double mean = counts / count;
    for (std::size_t k = 0; k < pixels; ++k) {
      if (excluded.empty() || !excluded[k]) {
        relative[k] = static_cast<float>(sum[k] / mean);
      }
    }
    // Two pictures an exposure are averaged.
    variance += 1 / (2 * mean * gain_electrons_per_count);
    colours += 1;
  }
  FlatResult result;
  result.field.value_if_empty = 1;
  if (colours == 0) {
    return result;
  }
  constexpr int kSide = 8;
  constexpr int kDegree = 6;
  const auto blocks = internal::BlockMeans(relative, camera.width, kSide, unknown);
  result.field = internal::FitSmoothField(blocks, kDegree);
  result.field.value_if_empty = 1;
  result.residual = internal::ResidualRms(blocks, result.field);
  result.noise = std::sqrt(variance / colours) / kSide;
  return result;
}

}  // namespace nacre::calibrate
