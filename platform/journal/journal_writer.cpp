#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

#include "platform/core/ensure.hpp"
#include "platform/journal/archive.hpp"
#include "platform/journal/journal.hpp"
#include "platform/journal/journal_format.hpp"
#include "platform/linux/files.hpp"
#include "platform/memory/pool_buffer.hpp"

namespace firstlook {

using namespace journal_format;

namespace {

std::span<const std::byte> as_bytes(std::string_view text) { return std::as_bytes(std::span(text)); }

// 256 KiB: at 125 arm reports a second of about 150 bytes the disk is written to every ten seconds or so.
constexpr std::size_t kBufferBytes = 256 * memory::kKiB;

class FileJournal final : public JournalWriter {
 public:
  FileJournal(std::string path, int descriptor, memory::PoolBuffer<std::byte> buffer, std::size_t bytes_max)
      : JournalWriter(buffer.items(), bytes_max),
        path_(std::move(path)),
        descriptor_(descriptor),
        storage_(std::move(buffer)) {}
  ~FileJournal() override {
    (void)flush();
    ::close(descriptor_);
  }
  FileJournal(const FileJournal&) = delete;
  FileJournal& operator=(const FileJournal&) = delete;
  using JournalWriter::write_header;

 private:
  Status drain(std::span<const std::byte> bytes) override { return write_all(descriptor_, bytes, path_); }
  Status sync() override {
    if (fsync(descriptor_) == 0 || errno == EINVAL) return {};  // EINVAL: a pipe or a device has nothing to sync
    return failure(Fault::kDiskWrite, "{}: {}", path_, std::strerror(errno));
  }

  std::string path_;
  int descriptor_;
  memory::PoolBuffer<std::byte> storage_;
};

class MemoryJournal final : public JournalWriter {
 public:
  explicit MemoryJournal(std::size_t bytes_max) : JournalWriter(buffer_, bytes_max) { bytes_.reserve(bytes_max); }
  [[nodiscard]] std::span<const std::byte> memory() const override { return bytes_; }
  using JournalWriter::write_header;

 private:
  Status drain(std::span<const std::byte> bytes) override {
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
    return {};
  }
  Status sync() override { return {}; }

  std::array<std::byte, 1024> buffer_;
  std::vector<std::byte> bytes_;
};

}  // namespace

Result<std::unique_ptr<JournalWriter>> JournalWriter::create_file(const std::string& path, const JournalHeader& header,
                                                                  std::size_t bytes_max) {
  auto buffer = memory::PoolBuffer<std::byte>::make(memory::Pool::kJournal, kBufferBytes);
  if (!buffer) return std::unexpected(buffer.error());
  const int descriptor = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (descriptor < 0) return failure(Fault::kDiskWrite, "{}: {}", path, std::strerror(errno));
  auto writer = std::make_unique<FileJournal>(path, descriptor, std::move(*buffer), bytes_max);
  if (Status status = writer->write_header(header); !status) return std::unexpected(status.error());
  return writer;
}

Result<std::unique_ptr<JournalWriter>> JournalWriter::create_memory(const JournalHeader& header,
                                                                    std::size_t bytes_max) {
  auto writer = std::make_unique<MemoryJournal>(bytes_max);
  if (Status status = writer->write_header(header); !status) return std::unexpected(status.error());
  return writer;
}

Status JournalWriter::write_header(const JournalHeader& header) {
  std::array<std::byte, 3 * sizeof(std::uint32_t)> numbers;
  ByteWriter writer(numbers);
  writer(kJournalFormat, static_cast<std::uint32_t>(header.program_version.size()),
         static_cast<std::uint32_t>(header.config.size()));
  const std::size_t size =
      kMagic.size() + numbers.size() + header.program_version.size() + header.config.size() + kCrcBytes;
  if (size + kClosingBytes > bytes_max_) {
    return failure(Fault::kOutOfMemory, "journal: its head of {} bytes does not fit into {} bytes", size, bytes_max_);
  }
  for (const auto part : {as_bytes(kMagic), std::span<const std::byte>(numbers), as_bytes(header.program_version),
                          as_bytes(header.config)}) {
    append(part);
    crc_ = crc32(crc_, part);
  }
  append(std::as_bytes(std::span(&crc_, 1)));
  return flush();
}

void JournalWriter::event(std::uint16_t kind, Instant time, std::span<const std::byte> payload) {
  record(RecordType::kEvent, kind, time, payload);
}

void JournalWriter::decision(std::uint16_t kind, Instant time, std::span<const std::byte> payload) {
  decisions_.add(kind, time, payload);
  record(RecordType::kDecision, kind, time, payload);
}

void JournalWriter::note(std::uint16_t kind, Instant time, std::span<const std::byte> payload) {
  record(RecordType::kNote, kind, time, payload);
}

void JournalWriter::hold(std::uint16_t kind, Instant time, std::span<const std::byte> payload, bool basis) {
  ENSURE(1502, payload.size() <= kHeldBytesMax);
  if (basis) held_.clear();
  if (held_.full()) held_.pop_back();
  held_.push_back({kind, time, payload.size(), {}});
  std::ranges::copy(payload, held_.back().payload.begin());
}

void JournalWriter::record_held() {
  for (const HeldEvent& held : held_) {
    write_record(RecordType::kEvent, held.kind, held.time, std::span(held.payload).first(held.size));
  }
  held_.clear();
}

void JournalWriter::record(RecordType type, std::uint16_t kind, Instant time, std::span<const std::byte> payload) {
  record_held();
  write_record(type, kind, time, payload);
}

void JournalWriter::write_record(RecordType type, std::uint16_t kind, Instant time,
                                 std::span<const std::byte> payload) {
  if (!recording_) return;
  if (bytes_ + kRecordFrameBytes + payload.size() + kClosingBytes > bytes_max_) {
    const std::uint64_t cap = bytes_max_;
    append_record(RecordType::kNote, kNoteRecordingStopped, time, std::as_bytes(std::span(&cap, 1)));
    recording_ = false;
    return;
  }
  append_record(type, kind, time, payload);
}

void JournalWriter::append_record(RecordType type, std::uint16_t kind, Instant time,
                                  std::span<const std::byte> payload) {
  std::array<std::byte, kRecordHeadBytes> head;
  ByteWriter writer(head);
  writer(type, kind, time, static_cast<std::uint32_t>(payload.size()));
  ENSURE(1501, writer.ok());
  crc_ = crc32(crc32(crc_, head), payload);
  append(head);
  append(payload);
  append(std::as_bytes(std::span(&crc_, 1)));
  ++records_;
}

void JournalWriter::append(std::span<const std::byte> bytes) {
  while (!bytes.empty() && status_) {
    const std::size_t part = std::min(bytes.size(), buffer_.size() - buffered_);
    std::ranges::copy(bytes.first(part), buffer_.begin() + static_cast<std::ptrdiff_t>(buffered_));
    buffered_ += part;
    bytes_ += part;
    bytes = bytes.subspan(part);
    if (buffered_ == buffer_.size()) (void)flush();
  }
}

Status JournalWriter::flush() {
  if (status_ && buffered_ != 0) {
    status_ = drain(buffer_.first(buffered_));
    buffered_ = 0;
    if (!status_) recording_ = false;
  }
  return status_;
}

Status JournalWriter::close(Instant time) {
  if (closed_) return status_;
  closed_ = true;
  recording_ = false;
  std::array<std::byte, kEndPayloadBytes> payload;
  ByteWriter writer(payload);
  writer(records_, decisions_.value());
  append_record(RecordType::kEnd, 0, time, payload);
  if (flush()) status_ = sync();
  return status_;
}

}  // namespace firstlook
