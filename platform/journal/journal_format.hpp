/// Sizes and marks of the journal's bytes, for its writer and its reader.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

namespace firstlook::journal_format {

inline constexpr std::string_view kMagic = "FLJOURN\n";
inline constexpr std::size_t kRecordHeadBytes = 1 + 2 + 8 + 4;  ///< type, kind, time, size
inline constexpr std::size_t kCrcBytes = 4;
inline constexpr std::size_t kRecordFrameBytes = kRecordHeadBytes + kCrcBytes;
inline constexpr std::size_t kEndPayloadBytes = 16;  ///< records, hash of the decisions
inline constexpr std::size_t kStopPayloadBytes = 8;  ///< of kNoteRecordingStopped
/// Kept free below the cap, so that a journal can always say that it stopped and end properly.
inline constexpr std::size_t kClosingBytes = 2 * kRecordFrameBytes + kEndPayloadBytes + kStopPayloadBytes;

}  // namespace firstlook::journal_format
