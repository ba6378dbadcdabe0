#include "factor/internal/fit_error.h"

#include <algorithm>
#include <cmath>

namespace nacre::factor::internal {
namespace {

// 0 / 0 is a perfect fit of nothing.
double Ratio(double numerator, double denominator) {
  return numerator == 0 ? 0 : numerator / denominator;
}

}  // namespace

void FitError::Add(double measured, double modelled, double floor) {
  const double difference = modelled - measured;
  error2 += difference * difference;
  signal2 += measured * measured;
  signal += measured;
  model += modelled;
  ++used;
  if (measured > floor) {
    const double ratio = std::log(std::max(modelled, floor) / measured);
    log2 += ratio * ratio;
    ++log_used;
  }
}

FitError& FitError::operator+=(const FitError& other) {
  error2 += other.error2;
  signal2 += other.signal2;
  signal += other.signal;
  model += other.model;
  log2 += other.log2;
  used += other.used;
  log_used += other.log_used;
  return *this;
}

void FitError::Repeat(std::int64_t times) {
  for (double* sum : {&error2, &signal2, &signal, &model, &log2}) {
    *sum *= static_cast<double>(times);
  }
  used *= times;
  log_used *= times;
}

double FitError::RelativeL2() const {
  return std::sqrt(Ratio(error2, signal2));
}

double FitError::Rmse() const {
  return std::sqrt(Ratio(error2, static_cast<double>(used)));
}

double FitError::RmseOverMean() const {
  return Ratio(Rmse(), std::abs(signal) / static_cast<double>(used));
}

double FitError::LogRms() const {
  return std::sqrt(Ratio(log2, static_cast<double>(log_used)));
}

}  // namespace nacre::factor::internal
