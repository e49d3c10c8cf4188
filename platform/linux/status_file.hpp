/// A small file that others read while the program runs: always whole, always the latest.
#pragma once

#include <array>
#include <string_view>

namespace firstlook {

/// Replaces a file by writing beside it and renaming. For a file system in memory (/run): nothing is synced, so a write
/// does not wait for a disk. Does not allocate. The file is removed at the end, unless it is left.
class StatusFile {
 public:
  /// An empty path, or one of more than 240 bytes: no file.
  explicit StatusFile(std::string_view path);
  ~StatusFile();
  StatusFile(const StatusFile&) = delete;
  StatusFile& operator=(const StatusFile&) = delete;

  /// False when it could not be written, or there is no file; the old one stays.
  bool write(std::string_view text) const;
  void leave() { left_ = true; }
  /// Whether a file is there, this one's or one that was left.
  [[nodiscard]] bool there() const;
  [[nodiscard]] bool present() const { return path_[0] != '\0'; }

 private:
  std::array<char, 256> path_{};
  std::array<char, 256> beside_{};
  bool left_ = false;
};

}  // namespace firstlook
