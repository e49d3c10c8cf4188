#include "platform/linux/append_file.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <span>
#include <utility>

#include "platform/linux/files.hpp"

namespace firstlook {

Result<AppendFile> AppendFile::open(const std::string& path) {
  const int descriptor = ::open(path.c_str(), O_RDWR | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  if (descriptor < 0) return failure(Fault::kDiskWrite, "{}: {}", path, std::strerror(errno));
  AppendFile file(path, descriptor);
  if (flock(descriptor, LOCK_EX | LOCK_NB) == 0) return file;
  if (errno == EWOULDBLOCK) return failure(Fault::kOutputNotEmpty, "{}: another process is writing it now", path);
  return failure(Fault::kDiskWrite, "{}: cannot be locked: {}", path, std::strerror(errno));
}

AppendFile::AppendFile(AppendFile&& other) noexcept
    : path_(std::move(other.path_)), descriptor_(std::exchange(other.descriptor_, -1)) {}

AppendFile::~AppendFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

Status AppendFile::truncate(std::size_t bytes) {
  if (ftruncate(descriptor_, static_cast<off_t>(bytes)) == 0) return {};
  return failure(Fault::kDiskWrite, "{}: {}", path_, std::strerror(errno));
}

Status AppendFile::append_line(std::string_view text) {
  const off_t before = lseek(descriptor_, 0, SEEK_END);
  const std::string line = std::string(text) + "\n";
  Status status = write_all(descriptor_, std::as_bytes(std::span(line)), path_);
  if (status && fdatasync(descriptor_) != 0) status = failure(Fault::kDiskWrite, "{}: {}", path_, std::strerror(errno));
  if (!status && before >= 0) (void)truncate(static_cast<std::size_t>(before));
  return status;
}

bool is_being_appended(const std::string& path) {
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) return false;
  const bool locked = flock(descriptor, LOCK_SH | LOCK_NB) != 0 && errno == EWOULDBLOCK;
  ::close(descriptor);
  return locked;
}

}  // namespace firstlook
