#pragma once

#include "core/sanitizers.h"

/// Marks a hot loop to be compiled for several instruction sets, of which one is chosen
/// when the program starts. -ffp-contract=off keeps the results of all of them equal to
/// the last bit.
///
/// They are static: a function that was declared before is compiled by clang 14 for the
/// first set alone, under its plain name, and ends by SIGILL on other processors. What
/// chooses runs before sanitizers are there to be called; NACRE_NO_SIMD_CLONES leaves
/// the clones out, too.
#if defined(__x86_64__) && !NACRE_UNDER_TSAN && !NACRE_UNDER_ASAN && \
    !defined(NACRE_NO_SIMD_CLONES)
#define NACRE_SIMD_CLONES \
  __attribute__((target_clones("avx512f", "avx2", "default"))) static
/// For loops that wider vectors don't make faster.
#define NACRE_AVX2_CLONES __attribute__((target_clones("avx2", "default"))) static
#else
#define NACRE_SIMD_CLONES static
#define NACRE_AVX2_CLONES static
#endif
