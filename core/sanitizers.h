#pragma once

/// NACRE_UNDER_TSAN, NACRE_UNDER_ASAN: 1 in what that sanitizer looks at, else 0.
#ifdef __has_feature
#define NACRE_UNDER_TSAN __has_feature(thread_sanitizer)
#define NACRE_UNDER_ASAN __has_feature(address_sanitizer)
#elif defined(__SANITIZE_THREAD__)
#define NACRE_UNDER_TSAN 1
#define NACRE_UNDER_ASAN 0
#elif defined(__SANITIZE_ADDRESS__)
#define NACRE_UNDER_TSAN 0
#define NACRE_UNDER_ASAN 1
#else
#define NACRE_UNDER_TSAN 0
#define NACRE_UNDER_ASAN 0
#endif
