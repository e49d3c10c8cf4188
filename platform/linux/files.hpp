/// Files: whole or not at all, with errors that name the path and the cause.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "platform/core/result.hpp"

namespace firstlook {

/// A file that appears under its name only when it is complete: written beside it, synced, renamed. Not committed: the
/// old file stays and the new one is removed. Not from the loop thread after seal().
class AtomicFile {
 public:
  /// Error: kDiskWrite.
  [[nodiscard]] static Result<AtomicFile> create(const std::string& path);
  AtomicFile(AtomicFile&& other) noexcept;
  AtomicFile& operator=(AtomicFile&&) = delete;
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;
  ~AtomicFile();

  /// Appends, buffered by 64 KiB. After an error every further call gives the same error. Error: kDiskWrite.
  Status write(std::span<const std::byte> bytes);
  Status write(std::string_view text);
  /// Syncs and renames. Error: kDiskWrite; then the old file is as it was.
  [[nodiscard]] Status commit();

 private:
  AtomicFile(std::string path, std::string temporary, int descriptor);
  Status flush();

  std::string path_;
  std::string temporary_;
  int descriptor_ = -1;
  std::vector<std::byte> buffer_;
  Status status_;
};

/// Writes a whole file by AtomicFile. Error: kDiskWrite.
[[nodiscard]] Status write_file_atomically(const std::string& path, std::span<const std::byte> bytes);
[[nodiscard]] Status write_file_atomically(const std::string& path, std::string_view text);

/// Reads a whole regular file. Errors: kDataMissing (absent or not readable), kDataMalformed (not a regular file, or
/// larger than `bytes_max`).
[[nodiscard]] Result<std::vector<std::byte>> read_file(const std::string& path, std::size_t bytes_max);
[[nodiscard]] Result<std::string> read_text_file(const std::string& path, std::size_t bytes_max);

/// Makes a folder and those above it; one that is there is fine. Error: kDiskWrite.
[[nodiscard]] Status make_directories(const std::string& path);
/// True when the folder is empty or not there. Error: kDiskWrite when it is something else or cannot be read.
[[nodiscard]] Result<bool> folder_is_empty(const std::string& path);

/// Makes sure that the name of a file or folder survives a power cut. Not every file system can do it; then there is
/// nothing to be done.
void sync_folder_of(const std::string& path);

/// Writes all bytes to a descriptor, going on after short writes and interrupts. `path` is for the error's text. Does
/// not allocate. Error: kDiskWrite.
[[nodiscard]] Status write_all(int descriptor, std::span<const std::byte> bytes, std::string_view path);

}  // namespace firstlook
