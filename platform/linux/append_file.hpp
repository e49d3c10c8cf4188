/// A file of lines that only grows, by one writer: what was appended before a power cut is there after it.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "platform/core/result.hpp"

namespace firstlook {

/// While it lives nobody else can open the file this way (flock(2)).
class AppendFile {
 public:
  /// Opens a file, or makes it. Errors: kDiskWrite; kOutputNotEmpty when somebody else has it open.
  [[nodiscard]] static Result<AppendFile> open(const std::string& path);
  AppendFile(AppendFile&& other) noexcept;
  AppendFile& operator=(AppendFile&&) = delete;
  AppendFile(const AppendFile&) = delete;
  AppendFile& operator=(const AppendFile&) = delete;
  ~AppendFile();

  /// Cuts everything off behind the first `bytes`. Error: kDiskWrite.
  [[nodiscard]] Status truncate(std::size_t bytes);
  /// Appends the text and a newline, and syncs. Error: kDiskWrite; then the file is as it was, as far as the disk lets
  /// it.
  [[nodiscard]] Status append_line(std::string_view text);

 private:
  AppendFile(std::string path, int descriptor) : path_(std::move(path)), descriptor_(descriptor) {}

  std::string path_;
  int descriptor_ = -1;
};

/// Whether somebody has the file open as AppendFile; false when it is not there.
[[nodiscard]] bool is_being_appended(const std::string& path);

}  // namespace firstlook
