#include "platform/linux/files.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <system_error>
#include <utility>

#include "platform/core/ensure.hpp"

namespace firstlook {
namespace {

constexpr std::size_t kBufferBytes = 64 * 1024;

std::unexpected<Error> disk_failure(std::string_view path) {
  return failure(Fault::kDiskWrite, "{}: {}", path, std::strerror(errno));
}

/// Reads all of a regular file into a string or a vector of bytes.
template <typename Bytes>
Result<Bytes> read_whole(const std::string& path, std::size_t bytes_max) {
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (descriptor < 0) return failure(Fault::kDataMissing, "{}: {}", path, std::strerror(errno));
  struct Closer {
    int descriptor;
    ~Closer() { ::close(descriptor); }
  } closer{descriptor};
  struct stat status{};
  if (fstat(descriptor, &status) != 0) return failure(Fault::kDataMissing, "{}: {}", path, std::strerror(errno));
  if (!S_ISREG(status.st_mode)) return failure(Fault::kDataMalformed, "{}: not a regular file", path);
  const auto size = static_cast<std::size_t>(status.st_size);
  if (size > bytes_max) {
    return failure(Fault::kDataMalformed, "{}: {} bytes, more than the {} that are allowed", path, size, bytes_max);
  }
  Bytes bytes;
  bytes.resize(size);
  std::size_t at = 0;
  while (at < size) {
    const ssize_t got = ::read(descriptor, bytes.data() + at, size - at);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return failure(Fault::kDataMissing, "{}: {}", path, std::strerror(errno));
    if (got == 0) return failure(Fault::kDataMalformed, "{}: became shorter while it was read", path);
    at += static_cast<std::size_t>(got);
  }
  return bytes;
}

}  // namespace

void sync_folder_of(const std::string& path) {
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  const int descriptor = ::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return;
  (void)fsync(descriptor);
  ::close(descriptor);
}

Status write_all(int descriptor, std::span<const std::byte> bytes, std::string_view path) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(descriptor, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return disk_failure(path);
    bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
  return {};
}

Result<AtomicFile> AtomicFile::create(const std::string& path) {
  std::string temporary = fmt::format("{}.part", path);
  const int descriptor = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (descriptor < 0) return disk_failure(temporary);
  return AtomicFile(path, std::move(temporary), descriptor);
}

AtomicFile::AtomicFile(std::string path, std::string temporary, int descriptor)
    : path_(std::move(path)), temporary_(std::move(temporary)), descriptor_(descriptor) {
  buffer_.reserve(kBufferBytes);
}

AtomicFile::AtomicFile(AtomicFile&& other) noexcept
    : path_(std::move(other.path_)),
      temporary_(std::move(other.temporary_)),
      descriptor_(std::exchange(other.descriptor_, -1)),
      buffer_(std::move(other.buffer_)),
      status_(std::move(other.status_)) {}

AtomicFile::~AtomicFile() {
  if (descriptor_ < 0) return;
  ::close(descriptor_);
  ::unlink(temporary_.c_str());
}

Status AtomicFile::write(std::span<const std::byte> bytes) {
  ENSURE(1611, descriptor_ >= 0);
  if (buffer_.size() + bytes.size() > kBufferBytes && !flush()) return status_;
  if (bytes.size() > kBufferBytes) {
    if (status_) status_ = write_all(descriptor_, bytes, path_);
  } else {
    buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
  }
  return status_;
}

Status AtomicFile::write(std::string_view text) { return write(std::as_bytes(std::span(text))); }

Status AtomicFile::flush() {
  if (status_) status_ = write_all(descriptor_, buffer_, path_);
  buffer_.clear();
  return status_;
}

Status AtomicFile::commit() {
  ENSURE(1612, descriptor_ >= 0);
  if (!flush()) return status_;
  if (fsync(descriptor_) != 0 || ::rename(temporary_.c_str(), path_.c_str()) != 0) return status_ = disk_failure(path_);
  ::close(std::exchange(descriptor_, -1));
  sync_folder_of(path_);
  return status_;
}

Status write_file_atomically(const std::string& path, std::span<const std::byte> bytes) {
  Result<AtomicFile> file = AtomicFile::create(path);
  if (!file) return std::unexpected(file.error());
  if (Status status = file->write(bytes); !status) return status;
  return file->commit();
}

Status write_file_atomically(const std::string& path, std::string_view text) {
  return write_file_atomically(path, std::as_bytes(std::span(text)));
}

Result<std::vector<std::byte>> read_file(const std::string& path, std::size_t bytes_max) {
  return read_whole<std::vector<std::byte>>(path, bytes_max);
}

Result<std::string> read_text_file(const std::string& path, std::size_t bytes_max) {
  return read_whole<std::string>(path, bytes_max);
}

Status make_directories(const std::string& path) {
  std::error_code error;
  std::filesystem::create_directories(path, error);
  if (error) return failure(Fault::kDiskWrite, "{}: {}", path, error.message());
  return {};
}

Result<bool> folder_is_empty(const std::string& path) {
  std::error_code error;
  if (!std::filesystem::exists(path, error) && !error) return true;
  const std::filesystem::directory_iterator first(path, error);
  if (error) return failure(Fault::kDiskWrite, "{}: {}", path, error.message());
  return first == std::filesystem::directory_iterator();
}

}  // namespace firstlook
