#include "app/report/checkpoint.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <system_error>

#include "platform/journal/journal.hpp"
#include "platform/linux/files.hpp"

namespace firstlook {
namespace {

constexpr std::string_view kFirstWords = "# checkpoint, fnv1a ";
constexpr std::size_t kBytesMax = 1 << 16;

std::string first_line_for(std::string_view text) {
  Fnv1a sum;
  sum.add(std::as_bytes(std::span(text)));
  return fmt::format("{}{:016x}\n", kFirstWords, sum.value());
}

std::string path_in(const std::string& folder, std::string_view name) { return fmt::format("{}/{}", folder, name); }

}  // namespace

Status write_checkpoint(const std::string& folder, const StoredCalibration& calibration) {
  const std::string text = hand_eye_yaml(calibration);
  return write_file_atomically(path_in(folder, kCheckpointName), first_line_for(text) + text);
}

Result<StoredCalibration> read_checkpoint(const std::string& file) {
  const Result<std::string> whole = read_text_file(file, kBytesMax);
  if (!whole) return std::unexpected(whole.error());
  const std::size_t end = whole->find('\n');
  if (end == std::string::npos || whole->substr(0, end + 1) != first_line_for(std::string_view(*whole).substr(end + 1)))
    return failure(Fault::kDataMalformed, "{}:1: the checksum is not that of the file: it is cut short or altered",
                   file);
  return read_hand_eye(file);
}

std::optional<CutOffRun> newest_cut_off_run(const std::string& runs) {
  namespace fs = std::filesystem;
  std::optional<CutOffRun> newest;
  fs::file_time_type newest_time;
  std::error_code error;
  for (fs::directory_iterator it(runs, error), last; !error && it != last; it.increment(error)) {
    const std::string folder = it->path().string();
    std::error_code none;
    if (fs::exists(path_in(folder, "result.json"), none)) continue;
    std::string file = path_in(folder, kCheckpointName);
    const auto time = fs::last_write_time(file, none);
    if (none) continue;
    if (newest && (time < newest_time || (time == newest_time && folder < newest->folder))) continue;
    if (Result<StoredCalibration> calibration = read_checkpoint(file)) {
      newest = CutOffRun{folder, std::move(file), std::move(*calibration)};
      newest_time = time;
    }
  }
  return newest;
}

void remove_checkpoint(const std::string& folder) {
  std::error_code none;
  std::filesystem::remove(path_in(folder, kCheckpointName), none);
}

}  // namespace firstlook
