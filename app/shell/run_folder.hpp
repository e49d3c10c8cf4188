/// Where the files of a run go.
#pragma once

#include <cstdint>
#include <string>

#include "platform/core/result.hpp"

namespace firstlook {

/// The folder of a run. That of a service which waits for its job is `waiting`, the same at every start, and takes a
/// name of its own when the job begins: who only waits, for days or until the power is cut, leaves nothing behind.
class RunFolder {
 public:
  /// One that must be empty or not there. Errors: kOutputNotEmpty, kDiskWrite.
  [[nodiscard]] static Result<RunFolder> named(const std::string& path);
  /// runs/waiting, in place of one that is left from before.
  [[nodiscard]] static RunFolder waiting(const std::string& runs, std::int64_t seed);
  /// Makes it. Error: kDiskWrite.
  [[nodiscard]] Status make() const;

  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] std::string file(std::string_view name) const;
  /// The job begins: a folder that waited is called runs/DATE-SEED from now on. Does not allocate. Error: kDiskWrite.
  [[nodiscard]] Status begin();
  /// Makes sure that the name outlives a power cut. Not from the loop thread.
  void sync() const;

 private:
  RunFolder() = default;

  std::string path_;
  std::string begun_;  ///< what path_ becomes, but for the date; empty: it has its name
};

}  // namespace firstlook
