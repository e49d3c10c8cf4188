/// What support needs of a run, in one archive.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "platform/core/result.hpp"

namespace firstlook {

struct BundleOptions {
  std::filesystem::path folder;  ///< of a run
  std::filesystem::path out;     ///< a .tar.gz
  std::string configuration;     ///< as it is on this computer now
  /// Larger files are left out.
  std::uint64_t file_bytes_max = 128 << 20;
  /// Files besides the run's: what the service wrote about its state, and what the system is. Those that are not there
  /// do not matter.
  std::vector<std::filesystem::path> system_files = {"/run/firstlook/status.json", "/etc/os-release", "/proc/version",
                                                     "/proc/cpuinfo", "/proc/meminfo"};
};

struct LeftOut {
  std::string name;  ///< below the folder
  std::string why;
};

struct BundleSummary {
  std::vector<std::string> packed;  ///< names in the archive
  std::vector<LeftOut> left_out;
  std::vector<std::string> with_pictures;  ///< of `packed`: they show the cell
  std::uint64_t bytes = 0;                 ///< before compression
};

/// Packs the files of a run's folder, the configuration, versions and status; recorded views (dataset/) are left out:
/// they are large, and `firstlook calibrate` is what reads them. An archive that is there is replaced, only by a whole
/// one. Errors: kDataMissing when there is no run in the folder (neither result.json nor journal.flj), kDiskWrite.
[[nodiscard]] Result<BundleSummary> write_support_bundle(const BundleOptions& options);

}  // namespace firstlook
