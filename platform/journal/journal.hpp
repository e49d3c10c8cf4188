/// The record of a run: every event and every decision, in order, so that the run can be repeated and compared.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "platform/core/fixed_vector.hpp"
#include "platform/core/result.hpp"
#include "platform/core/time.hpp"

namespace firstlook {

inline constexpr std::uint32_t kJournalFormat = 1;
inline constexpr std::size_t kJournalBytesMax = std::size_t{64} << 20;
inline constexpr std::size_t kHeldBytesMax = 512;          ///< payload of an event that can be held
inline constexpr std::uint16_t kNoteRecordingStopped = 1;  ///< the cap is reached; payload: u64 cap in bytes

enum class RecordType : std::uint8_t { kEvent = 1, kDecision = 2, kNote = 3, kEnd = 4 };

/// What the run was made with; checked and used by replay.
struct JournalHeader {
  std::string program_version;
  std::string config;  ///< everything that a replay needs to make the same machine, as text
};

/// 64-bit FNV-1a (Fowler, Noll, Vo) over what is fed to it in order.
class Fnv1a {
 public:
  void add(std::span<const std::byte> bytes) {
    for (const std::byte b : bytes) value_ = (value_ ^ static_cast<std::uint64_t>(b)) * 0x100000001b3ULL;
  }
  [[nodiscard]] std::uint64_t value() const { return value_; }

 private:
  std::uint64_t value_ = 0xcbf29ce484222325ULL;
};

/// The hash of decisions: the same for the recording and the replaying program, whether it is written anywhere or not.
class DecisionsHash {
 public:
  void add(std::uint16_t kind, Instant time, std::span<const std::byte> payload);
  [[nodiscard]] std::uint64_t value() const { return hash_.value(); }

 private:
  Fnv1a hash_;
};
/// 16 hexadecimal digits.
[[nodiscard]] std::string hash_text(std::uint64_t hash);

/// CRC-32 of IEEE 802.3, continued from `crc` (0 at the start).
[[nodiscard]] std::uint32_t crc32(std::uint32_t crc, std::span<const std::byte> bytes);

/// An event that JournalWriter::hold keeps back.
struct HeldEvent {
  std::uint16_t kind = 0;
  Instant time{};
  std::size_t size = 0;
  std::array<std::byte, kHeldBytesMax> payload{};
};

/// Writes a journal to a file or to memory. The loop thread alone; event(), decision() and note() never allocate. An
/// error of the disk stops the recording, not the job: it stays in status().
///
/// Format, little-endian: "FLJOURN\n", u32 format, u32 + bytes of the program version, u32 + bytes of the
/// configuration, u32 CRC of all this; then records {u8 type, u16 kind, i64 time_ns, u32 size, payload, u32 CRC}, where
/// each CRC goes on from the one before, so that a missing record is noticed, too; last a record kEnd {u64 records, u64
/// decisions_hash}.
class JournalWriter {
 public:
  /// Creates the file (replacing one that is there). Errors: kDiskWrite, kOutOfMemory.
  [[nodiscard]] static Result<std::unique_ptr<JournalWriter>> create_file(const std::string& path,
                                                                          const JournalHeader& header,
                                                                          std::size_t bytes_max = kJournalBytesMax);
  /// Records to memory of fixed size, for tests. Error: kOutOfMemory when the header does not fit.
  [[nodiscard]] static Result<std::unique_ptr<JournalWriter>> create_memory(const JournalHeader& header,
                                                                            std::size_t bytes_max);
  virtual ~JournalWriter() = default;

  void event(std::uint16_t kind, Instant time, std::span<const std::byte> payload);
  /// An event that is worth recording only if something is decided because of it, or after it: it is kept back, and
  /// recorded before the next decision, note or other event. A `basis` takes the place of all that is kept back; of
  /// events upon it only the newest is kept.
  void hold(std::uint16_t kind, Instant time, std::span<const std::byte> payload, bool basis);
  void decision(std::uint16_t kind, Instant time, std::span<const std::byte> payload);
  void note(std::uint16_t kind, Instant time, std::span<const std::byte> payload);
  /// Writes what is buffered to the disk; also happens whenever the buffer is full.
  Status flush();
  /// Writes the end record and everything that is buffered; nothing is recorded after it. Returns status().
  Status close(Instant time);

  /// The first error of the disk, if there was one.
  [[nodiscard]] const Status& status() const { return status_; }
  /// False once the cap was reached, the disk failed, or close() was called.
  [[nodiscard]] bool recording() const { return recording_; }
  [[nodiscard]] std::uint64_t records() const { return records_; }
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }
  /// Covers all decisions, recorded or not.
  [[nodiscard]] std::uint64_t decisions_hash() const { return decisions_.value(); }
  /// The bytes recorded to memory up to the last flush() or close(); empty for a file.
  [[nodiscard]] virtual std::span<const std::byte> memory() const { return {}; }

 protected:
  JournalWriter(std::span<std::byte> buffer, std::size_t bytes_max) : buffer_(buffer), bytes_max_(bytes_max) {}
  /// Empties the buffer to where it belongs.
  virtual Status drain(std::span<const std::byte> bytes) = 0;
  /// Makes sure that what was drained outlives a power cut.
  virtual Status sync() = 0;
  [[nodiscard]] Status write_header(const JournalHeader& header);

 private:
  void record(RecordType type, std::uint16_t kind, Instant time, std::span<const std::byte> payload);
  void record_held();
  void write_record(RecordType type, std::uint16_t kind, Instant time, std::span<const std::byte> payload);
  void append_record(RecordType type, std::uint16_t kind, Instant time, std::span<const std::byte> payload);
  void append(std::span<const std::byte> bytes);

  std::span<std::byte> buffer_;
  std::size_t buffered_ = 0;
  std::size_t bytes_max_;
  std::uint64_t bytes_ = 0;
  std::uint64_t records_ = 0;
  std::uint32_t crc_ = 0;
  DecisionsHash decisions_;
  FixedVector<HeldEvent, 2> held_;
  Status status_;
  bool recording_ = true;
  bool closed_ = false;
};

/// One record; the payload lives as long as the reader.
struct JournalRecord {
  RecordType type = RecordType::kNote;
  std::uint16_t kind = 0;
  Instant time{};
  std::uint64_t number = 0;  ///< counts from 0
  std::span<const std::byte> payload;
};

/// Reads a journal and checks every byte of it.
class JournalReader {
 public:
  /// Reads a file of at most twice the cap. Errors: kDataMissing, kJournalBroken (not a journal, another format, header
  /// altered).
  [[nodiscard]] static Result<JournalReader> open(const std::string& path);
  [[nodiscard]] static Result<JournalReader> from_bytes(std::vector<std::byte> bytes);

  [[nodiscard]] const JournalHeader& header() const { return header_; }
  /// The next record; empty after the last one. Error: kJournalBroken with the byte offset and the record number when
  /// the journal is cut short or altered there, or was never closed.
  [[nodiscard]] Result<std::optional<JournalRecord>> next();
  /// Of the end record; empty before next() has come to it.
  [[nodiscard]] std::optional<std::uint64_t> decisions_hash() const { return decisions_hash_; }

 private:
  [[nodiscard]] Status read_header();
  [[nodiscard]] Status read_end(const JournalRecord& record);

  std::vector<std::byte> bytes_;
  JournalHeader header_;
  std::size_t at_ = 0;
  std::uint64_t records_ = 0;
  std::uint32_t crc_ = 0;
  std::optional<std::uint64_t> decisions_hash_;
};

}  // namespace firstlook
