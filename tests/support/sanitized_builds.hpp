/// What sanitizers change for tests: fewer random trials, with the bounds that fit the fewer, and more time for a run.
#pragma once

#include <algorithm>
#include <cmath>

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define FIRSTLOOK_SANITIZED 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define FIRSTLOOK_SANITIZED 1
#endif
#endif

namespace firstlook::test {

/// The whole job takes 8 times as long with AddressSanitizer; a quarter of the trials keeps the bounds on them useful.
#ifdef FIRSTLOOK_SANITIZED
inline constexpr int kSlowdown = 8;
inline constexpr int kTrialDivisor = 4;
#else
inline constexpr int kSlowdown = 1;
inline constexpr int kTrialDivisor = 1;
#endif

/// How many of `count` trials this build makes; at least one.
[[nodiscard]] constexpr int trials(int count) { return std::max(1, count / kTrialDivisor); }

/// How much wider the bound on a mean or a rate over trials() is: a standard error grows with the root of the trials
/// left out. 1 without sanitizers.
[[nodiscard]] inline double margin_factor() { return std::sqrt(static_cast<double>(kTrialDivisor)); }

}  // namespace firstlook::test
