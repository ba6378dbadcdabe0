#include "factor/internal/quantize.h"

#include "core/error.h"
#include "factor/internal/form_weights.h"
#include "factor/internal/measure.h"
#include "factor/internal/reciprocal_taps.h"
#include "factor/internal/tucker.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <fmt/format.h>
#include <optional>

namespace nacre::factor::internal {
namespace {

constexpr double kLeastBits = 4;
constexpr double kMostBits = 16;
constexpr double kFloatBits = 32;
constexpr double kKernelFinesse = 32;
constexpr double kLogKernelFinesse = 4;
constexpr double kLogBetaStep = 0x1p-16;  // of ln β: 1e-4 of exp(−10)
constexpr float kMostCode = 0x1p22F;      // either way; floats hold four times as much
constexpr double kLeastStep = 1e-37;      // floats lose digits below
constexpr float kFinestScale = 0x1p-20F;  // steps of row_scale
constexpr float kCoarsestScale = 0x1p-10F;

// d R_d / d s, rms over the sample, s being what maps and kernels add up to.
double Gain(const Job& job, const Material& m, std::size_t channel) {
  if (m.transform == Transform::kLinear) {
    return 1;
  }
  const bool is_root = m.transform == Transform::kSqrt;
  const double offset = m.a[channel] * m.b[channel];
  const auto window = static_cast<std::size_t>(m.WindowSize());
  double sum = 0;
  for (std::size_t row = 0; row < job.sample.rows.size(); ++row) {
    const float* rd =
        &job.sample.dataset.rd[(row * m.channels.size() + channel) * window];
    for (std::size_t cell = 0; cell < window; ++cell) {
      const double value = std::max(0.0, static_cast<double>(rd[cell]));
      const double slope = is_root ? 2 * std::sqrt(value) : value + offset;
      sum += slope * slope;
    }
  }
  return std::sqrt(sum / static_cast<double>(job.sample.rows.size() * window));
}

// How much a unit of each map of a reciprocal material matters: rms of what it changes
// the logarithm of R_d by, weighted by R_d's size at an offset.
std::vector<double> ReciprocalMapWeights(const Material& m) {
  std::vector<double> squares(static_cast<std::size_t>(m.MapCount()), 0.0);
  double all = 0;
  for (int c = 0; c < static_cast<int>(m.channels.size()); ++c) {
    for (std::int64_t cell = 0; cell < m.KernelSize(); ++cell) {
      const auto kernel = [&](int n) {
        return static_cast<double>(m.Kernel(c, 0, n)[cell]);
      };
      const double weight = std::exp(std::clamp(kernel(0), -20.0, 1.0));
      all += weight;
      for (int j = 0; j < m.terms; ++j) {
        double sum = 0;
        for (int tap = 0; tap < m.taps; ++tap) {
          sum += std::pow(2 * kernel(TapKernel(m.terms, tap, j)), 2);
        }
        for (int k = 0; k < m.terms; ++k) {
          const int n = PairKernel(m.terms, m.taps, std::min(j, k), std::max(j, k));
          sum += std::pow(2 * kernel(n), 2);
        }
        squares[static_cast<std::size_t>(j)] += weight * sum;
      }
      for (int k = 0; k < m.rest; ++k) {
        squares[static_cast<std::size_t>(std::int64_t{m.terms} + k)] +=
            weight * std::pow(kernel(ReciprocalKernelCount(m.terms, m.taps) + k), 2);
      }
      if (m.sides > 0) {
        squares.back() += weight * std::pow(2 * kernel(m.KernelCount() - 1), 2);
      }
    }
  }
  for (double& square : squares) {
    square = std::sqrt(square / all);
  }
  return squares;
}

// How much a unit of each map matters: the norm of the kernels it goes with, in R_d.
std::vector<double> MapWeights(const Material& m, const std::vector<double>& gains) {
  if (m.form == Form::kReciprocal) {
    return ReciprocalMapWeights(m);
  }
  if (m.form == Form::kTucker) {
    return TuckerMapWeights(m);
  }
  if (m.form == Form::kProfiles) {
    return ProfilesMapWeights(m);
  }
  std::vector<double> squares(static_cast<std::size_t>(m.MapSets() * m.terms), 0.0);
  const auto add = [&](int channel, int term, const float* kernel) {
    const double gain = gains[static_cast<std::size_t>(channel)];
    double sum = 0;
    for (std::int64_t cell = 0; cell < m.WindowSize(); ++cell) {
      sum += std::pow(static_cast<double>(kernel[cell]) * gain, 2);
    }
    const int set = m.MapSets() == 1 ? 0 : channel;
    squares[static_cast<std::size_t>(std::int64_t{set} * m.terms + term)] += sum;
  };
  for (int c = 0; c < static_cast<int>(m.channels.size()); ++c) {
    for (int k = 0; k < m.cluster_count; ++k) {
      int n = 0;
      for (int j = 0; j < m.terms; ++j) {
        if (m.form == Form::kSum) {
          add(c, j, m.Kernel(c, k, j));
          continue;
        }
        for (int other = j; other < m.terms; ++other) {
          add(c, j, m.Kernel(c, k, n));
          add(c, other, m.Kernel(c, k, n++));
        }
      }
    }
  }
  for (double& square : squares) {
    square = std::sqrt(square / m.cluster_count);
  }
  return squares;
}

bool Round(std::span<float> values, float step) {
  for (float& value : values) {
    const float multiple = std::nearbyint(value / step) + 0.0F;  // no negative zeros
    if (!(std::abs(multiple) <= kMostCode)) {
      return false;
    }
    value = multiple * step;
  }
  return true;
}

// A tenth of the error; a power of two, so that 1 is a multiple.
float ScaleStep(double relative_l2) {
  const auto wanted = static_cast<float>(0.1 * relative_l2);
  return wanted > kFinestScale
             ? std::exp2(std::floor(std::log2(std::min(wanted, kCoarsestScale))))
             : kFinestScale;
}

class Rounding {
 public:
  Rounding(const Job& job, const Material& exact) : exact_(exact) {
    for (std::size_t c = 0; c < exact.channels.size(); ++c) {
      gains_.push_back(Gain(job, exact, c));
    }
    if (exact.form == Form::kTucker) {
      gains_.assign(1, TuckerGain(exact));
    }
    weights_ = MapWeights(exact, gains_);
    const auto size = static_cast<std::size_t>(exact.MapSize());
    for (std::size_t n = 0; n < weights_.size(); ++n) {
      const auto [low, high] =
          std::minmax_element(&exact.f[n * size], &exact.f[n * size] + size);
      widest_ = std::max(widest_, static_cast<double>(*high - *low) * weights_[n]);
      // A map of one value needs the digits of its size.
      widest_ = std::max(widest_, static_cast<double>(std::abs(*high)) * weights_[n]);
      heaviest_ = std::max(heaviest_, weights_[n]);
    }
  }

  // Nothing if floats can't hold the numbers.
  std::optional<Material> Apply(double bits) const {
    const double delta = widest_ / (std::exp2(bits) - 1);
    if (!(delta > 0)) {
      return std::nullopt;
    }
    Material m = exact_;
    const auto map_size = static_cast<std::size_t>(m.MapSize());
    for (std::size_t n = 0; n < weights_.size(); ++n) {
      // Maps that hardly matter still need a step that is a number.
      const double weight = std::max(weights_[n], 1e-12 * heaviest_);
      m.steps.f.push_back(IsCount(n) ? 1.0F : static_cast<float>(delta / weight));
      if (!Round({&m.f[n * map_size], map_size}, m.steps.f.back())) {
        return std::nullopt;
      }
    }
    const std::size_t kernel_values = m.h.size() / gains_.size();
    for (std::size_t c = 0; c < gains_.size(); ++c) {
      const std::span<float> kernels(&m.h[c * kernel_values], kernel_values);
      double largest = 0;
      for (const float value : kernels) {
        largest = std::max(largest, static_cast<double>(std::abs(value)));
      }
      const double finesse =
          m.form == Form::kReciprocal
              ? kLogKernelFinesse
              : kKernelFinesse * std::sqrt(static_cast<double>(m.WindowSize()));
      const double wanted = delta / (gains_[c] * finesse);
      const double least = 1.0001 * largest / static_cast<double>(kMostCode);
      const double step =
          m.form == Form::kProfiles ? kLogBetaStep : std::max(wanted, least);
      m.steps.h.push_back(static_cast<float>(step));
      if (!(step > kLeastStep) || !Round(kernels, m.steps.h.back())) {
        return std::nullopt;
      }
    }
    return m;
  }

 private:
  // Whole numbers as they are.
  bool IsCount(std::size_t map) const {
    return exact_.form == Form::kTucker &&
           map == static_cast<std::size_t>(TuckerShiftMap(exact_));
  }

  const Material& exact_;
  std::vector<double> gains_;
  std::vector<double> weights_;
  double widest_ = 0;
  double heaviest_ = 0;
};

double Growth(double now, double before) {
  return now > before ? now / before - 1 : 0;  // infinite where there was none
}

}  // namespace

Quantization Quantize(const Job& job, double bits, Material& material) {
  if (!(bits == 0 || bits == kFloatBits || (bits >= kLeastBits && bits <= kMostBits))) {
    throw UsageError(fmt::format(
        "option bits: {} is none of 0 (automatic), {} to {}, and {} (floats)",
        bits,
        kLeastBits,
        kMostBits,
        kFloatBits));
  }
  if (bits == kFloatBits) {
    return {};
  }
  const Material exact = material;
  const Rounding rounding(job, exact);
  const FitError before = SampleError(job, exact);
  const auto attempt = [&](double n) -> std::optional<Quantization> {
    std::optional<Material> rounded = rounding.Apply(n);
    if (!rounded) {
      return std::nullopt;
    }
    material = std::move(*rounded);
    material.steps.row_scale = ScaleStep(before.RelativeL2());
    const FitError after = SampleError(job, material);
    return Quantization{n,
                        Growth(after.RelativeL2(), before.RelativeL2()),
                        Growth(after.LogRms(), before.LogRms())};
  };
  const auto good = [](const std::optional<Quantization>& q) {
    return q && q->added_l2 <= kQuantizationGrowth &&
           q->added_log <= kQuantizationGrowth;
  };
  double least = kLeastBits;
  double most = bits;
  if (bits == 0) {
    most = kMostBits;
    if (!good(attempt(most))) {
      material = exact;
      return {};
    }
    while (most > least) {  // in halves
      const double middle = least + std::floor(most - least) / 2;
      if (good(attempt(middle))) {
        most = middle;
      } else {
        least = middle + 0.5;
      }
    }
  }
  const std::optional<Quantization> result = attempt(most);
  // Floats that repeat exactly may pack better than what they are rounded to.
  if (!result || (bits == 0 && FileBytes(exact) <= FileBytes(material))) {
    material = exact;
    return {};
  }
  return *result;
}

}  // namespace nacre::factor::internal
