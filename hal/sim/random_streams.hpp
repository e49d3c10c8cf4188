/// Stream numbers of the random draws around arm, devices and grading, so that no use shifts another's.
#pragma once

#include <cstdint>

namespace firstlook::sim {

inline constexpr std::uint64_t kDeviationStream = 5101;
inline constexpr std::uint64_t kEncoderStream = 5102;
inline constexpr std::uint64_t kColorDropStream = 5103;
inline constexpr std::uint64_t kDepthDropStream = 5104;
inline constexpr std::uint64_t kObservableStream = 5105;
inline constexpr std::uint64_t kColorNoiseStream = 5106;
inline constexpr std::uint64_t kDepthNoiseStream = 5107;
inline constexpr std::uint64_t kTouchStream = 5108;
inline constexpr std::uint64_t kTipStream = 5109;
inline constexpr std::uint64_t kFactoryCorrectionStream = 5110;

}  // namespace firstlook::sim
