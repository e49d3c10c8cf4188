#include <algorithm>

#include "platform/journal/archive.hpp"
#include "platform/journal/journal.hpp"
#include "platform/journal/journal_format.hpp"
#include "platform/linux/files.hpp"

namespace firstlook {

using namespace journal_format;

namespace {

std::string text_of(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

}  // namespace

Result<JournalReader> JournalReader::open(const std::string& path) {
  Result<std::vector<std::byte>> bytes = read_file(path, 2 * kJournalBytesMax);
  if (!bytes) return std::unexpected(bytes.error());
  return from_bytes(std::move(*bytes));
}

Result<JournalReader> JournalReader::from_bytes(std::vector<std::byte> bytes) {
  JournalReader reader;
  reader.bytes_ = std::move(bytes);
  if (Status status = reader.read_header(); !status) return std::unexpected(status.error());
  return reader;
}

Status JournalReader::read_header() {
  const std::span<const std::byte> all(bytes_);
  constexpr std::size_t kFixedBytes = kMagic.size() + 3 * sizeof(std::uint32_t);
  if (all.size() < kFixedBytes || text_of(all.first(kMagic.size())) != kMagic) {
    return failure(Fault::kJournalBroken, "byte 0: not a journal of firstlook");
  }
  ByteReader numbers(all.subspan(kMagic.size()));
  std::uint32_t format = 0;
  std::uint32_t version_bytes = 0;
  std::uint32_t config_bytes = 0;
  numbers(format, version_bytes, config_bytes);
  if (format != kJournalFormat) {
    return failure(Fault::kJournalBroken, "byte {}: format {}, this program reads format {}", kMagic.size(), format,
                   kJournalFormat);
  }
  const std::size_t size = kFixedBytes + std::size_t{version_bytes} + std::size_t{config_bytes};
  if (all.size() < size + kCrcBytes) {
    return failure(Fault::kJournalBroken, "byte {}: cut short in the head", all.size());
  }
  crc_ = crc32(0, all.first(size));
  std::uint32_t recorded_crc = 0;
  if (!unpack(all.subspan(size, kCrcBytes), recorded_crc) || recorded_crc != crc_) {
    return failure(Fault::kJournalBroken, "byte {}: the head was altered", size);
  }
  header_.program_version = text_of(all.subspan(kFixedBytes, version_bytes));
  header_.config = text_of(all.subspan(kFixedBytes + version_bytes, config_bytes));
  at_ = size + kCrcBytes;
  return {};
}

Result<std::optional<JournalRecord>> JournalReader::next() {
  if (decisions_hash_) return std::nullopt;
  const std::span<const std::byte> rest = std::span<const std::byte>(bytes_).subspan(at_);
  JournalRecord record;
  std::uint32_t size = 0;
  ByteReader head(rest);
  head(record.type, record.kind, record.time, size);
  if (!head.ok() || rest.size() < kRecordFrameBytes + std::size_t{size}) {
    return failure(Fault::kJournalBroken, "byte {}: cut short in record {}", bytes_.size(), records_);
  }
  record.payload = rest.subspan(kRecordHeadBytes, size);
  const std::uint32_t crc = crc32(crc_, rest.first(kRecordHeadBytes + size));
  std::uint32_t recorded_crc = 0;
  if (!unpack(rest.subspan(kRecordHeadBytes + size, kCrcBytes), recorded_crc) || recorded_crc != crc) {
    return failure(Fault::kJournalBroken, "byte {}: record {} was altered, or one before it is missing", at_, records_);
  }
  if (record.type < RecordType::kEvent || record.type > RecordType::kEnd) {
    return failure(Fault::kJournalBroken, "byte {}: record {} has no known type", at_, records_);
  }
  crc_ = crc;
  at_ += kRecordFrameBytes + size;
  if (record.type == RecordType::kEnd) {
    if (Status status = read_end(record); !status) return std::unexpected(status.error());
    return std::nullopt;
  }
  record.number = records_++;
  return record;
}

Status JournalReader::read_end(const JournalRecord& record) {
  std::uint64_t records = 0;
  std::uint64_t hash = 0;
  ByteReader reader(record.payload);
  reader(records, hash);
  if (!reader.ok() || reader.remaining() != 0 || records != records_) {
    return failure(Fault::kJournalBroken, "byte {}: the end says {} records, {} are there", at_, records, records_);
  }
  if (at_ != bytes_.size()) {
    return failure(Fault::kJournalBroken, "byte {}: something stands behind the end, after record {}", at_, records_);
  }
  decisions_hash_ = hash;
  return {};
}

}  // namespace firstlook
