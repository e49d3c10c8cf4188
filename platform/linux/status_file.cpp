#include "platform/linux/status_file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <span>

#include "platform/linux/files.hpp"

namespace firstlook {
namespace {
constexpr std::string_view kBeside = ".new";
constexpr std::size_t kPathMax = 240;
}  // namespace

StatusFile::StatusFile(std::string_view path) {
  if (path.size() > kPathMax) return;
  const auto end = std::ranges::copy(path, path_.begin()).out;
  std::copy(path_.begin(), end, beside_.begin());
  std::ranges::copy(kBeside, beside_.begin() + (end - path_.begin()));
}

StatusFile::~StatusFile() {
  if (present() && !left_) (void)::unlink(path_.data());
}

bool StatusFile::there() const { return present() && ::access(path_.data(), F_OK) == 0; }

bool StatusFile::write(std::string_view text) const {
  if (!present()) return false;
  const int file = ::open(beside_.data(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (file < 0) return false;
  const bool written = write_all(file, std::as_bytes(std::span(text)), "status").has_value();
  ::close(file);
  return written && std::rename(beside_.data(), path_.data()) == 0;
}

}  // namespace firstlook
