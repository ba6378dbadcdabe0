#pragma once

#include <cstdint>

namespace nacre::factor::internal {

/// Sums over pairs of measurement and model, from which the figures of
/// reconstruct::ErrorFigures follow.
struct FitError {
  double error2 = 0;   ///< Σ (model − measured)²
  double signal2 = 0;  ///< Σ measured²
  double signal = 0;   ///< Σ measured
  double model = 0;    ///< Σ model
  double log2 = 0;     ///< Σ ln²(model / measured)
  std::int64_t used = 0;
  std::int64_t log_used = 0;

  /// `floor` bounds both numbers in the logarithm; infinity: none is taken.
  void Add(double measured, double modelled, double floor);
  FitError& operator+=(const FitError& other);
  /// As if all had been added so many times.
  void Repeat(std::int64_t times);

  double RelativeL2() const;    ///< √(Σ error² / Σ measured²); 0 where both are 0
  double Rmse() const;          ///< mm⁻²
  double RmseOverMean() const;  ///< RMSE over the mean measurement
  double LogRms() const;        ///< rms of ln(model / measured)
};

}  // namespace nacre::factor::internal
