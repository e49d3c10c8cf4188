/// What the processor offers beyond the baseline that everything is compiled for.
#pragma once

/// Before a function: it may use AVX2. Call it only where has_avx2() says so, beside a function with the same body and
/// so with the same bits.
#if defined(__x86_64__)
#define FIRSTLOOK_AVX2 [[gnu::target("avx2")]]
#else
#define FIRSTLOOK_AVX2
#endif

namespace firstlook {

/// Whether functions marked FIRSTLOOK_AVX2 may be called.
[[nodiscard]] inline bool has_avx2() {
#if defined(__x86_64__)
  return __builtin_cpu_supports("avx2") > 0;
#else
  return false;
#endif
}

}  // namespace firstlook
