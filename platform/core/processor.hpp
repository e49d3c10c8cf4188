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

/// While one of these lives every has_avx2() says no: for tests that hold both ways against each other.
class PortableOnly {
 public:
  PortableOnly() { ++count_; }
  ~PortableOnly() { --count_; }
  PortableOnly(const PortableOnly&) = delete;
  PortableOnly& operator=(const PortableOnly&) = delete;
  [[nodiscard]] static bool any() { return count_ > 0; }

 private:
  static inline int count_ = 0;
};

/// Whether functions marked FIRSTLOOK_AVX2 may be called.
[[nodiscard]] inline bool has_avx2() {
#if defined(__x86_64__)
  return !PortableOnly::any() && __builtin_cpu_supports("avx2") > 0;
#else
  return false;
#endif
}

}  // namespace firstlook
