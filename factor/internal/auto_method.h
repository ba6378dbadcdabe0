#pragma once

#include "factor/factor.h"

#include <functional>
#include <string>

namespace nacre::factor::internal {

inline constexpr const char* kAutoMethod = "auto";

/// Terms that a method takes where none are asked for: beyond them, its time grows
/// faster than its error falls.
int OwnTerms(const std::string& method);

/// Factors by each method that is the best at some size of some dataset (bench/factor),
/// and returns the one that
///   with `error`, takes the fewest bytes of those that keep it, else has the least
///   error; with `bytes` or neither, has the least product of relative L2 and log error
///   of those that fit the bytes, else takes the fewest.
/// Notes tell what each of them came to. Bilinear is left out if its pairs don't fit.
Factorization FactorByBest(
    const FactorOptions& options,
    bool bilinear_fits,
    const std::function<Factorization(const FactorOptions&)>& factor);

}  // namespace nacre::factor::internal
