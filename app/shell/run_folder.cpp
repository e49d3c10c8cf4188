#include "app/shell/run_folder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <system_error>

#include "app/report/run_files.hpp"
#include "platform/linux/files.hpp"
#include "platform/linux/process.hpp"

namespace firstlook {

Result<RunFolder> RunFolder::named(const std::string& path) {
  if (const Status fresh = check_run_folder(path); !fresh) return std::unexpected(fresh.error());
  RunFolder folder;
  folder.path_ = path;
  return folder;
}

RunFolder RunFolder::waiting(const std::string& runs, std::int64_t seed) {
  RunFolder folder;
  folder.path_ = fmt::format("{}/waiting", runs);
  folder.begun_ = fmt::format("{}/{}-{}", runs, utc_date_for_name(), seed);
  return folder;
}

Status RunFolder::make() const {
  std::error_code error;
  if (!begun_.empty()) std::filesystem::remove_all(path_, error);
  if (error) return failure(Fault::kDiskWrite, "{}: {}", path_, error.message());
  return make_directories(path_);
}

std::string RunFolder::file(std::string_view name) const { return fmt::format("{}/{}", path_, name); }

Status RunFolder::begin() {
  if (begun_.empty()) return {};
  const std::string date = utc_date_for_name();  // fits into the string itself
  std::ranges::copy(date, begun_.begin() + static_cast<std::ptrdiff_t>(begun_.rfind('/') + 1));
  if (std::rename(path_.c_str(), begun_.c_str()) != 0)
    return failure(Fault::kDiskWrite, "{}: {}", begun_, std::strerror(errno));
  path_.swap(begun_);
  begun_.clear();
  return {};
}

void RunFolder::sync() const { sync_folder_of(path_); }

}  // namespace firstlook
