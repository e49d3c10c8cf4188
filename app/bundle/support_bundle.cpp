#include "app/bundle/support_bundle.hpp"

#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <fstream>

#include "app/bundle/tar.hpp"
#include "app/cli/small_commands.hpp"
#include "platform/linux/process.hpp"

namespace firstlook {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kSystemFileBytesMax = 256 * 1024;

bool shows_the_cell(const std::string& name) {
  constexpr std::string_view kEndings[] = {".html", ".png", ".jpg", ".ply", ".bt", ".ot", ".svg", ".pdf"};
  return std::ranges::any_of(kEndings, [&](std::string_view ending) { return name.ends_with(ending); });
}

struct Candidate {
  fs::path path;
  std::string name;  ///< below the run's folder
  std::uint64_t size = 0;
  std::int64_t modified_s = 0;
};

/// All below the folder, by name.
void collect(const BundleOptions& options, std::vector<Candidate>& found, std::vector<LeftOut>& left_out) {
  std::error_code error;
  const fs::path out = fs::weakly_canonical(options.out, error);
  fs::recursive_directory_iterator walk(options.folder, fs::directory_options::skip_permission_denied, error);
  for (const fs::recursive_directory_iterator end; !error && walk != end; walk.increment(error)) {
    const std::string name = walk->path().lexically_relative(options.folder).generic_string();
    struct stat status{};
    if (lstat(walk->path().c_str(), &status) != 0) continue;
    if (S_ISDIR(status.st_mode)) {
      if (name == "dataset") {
        left_out.push_back({"dataset/", "recorded views; send them apart when support asks for them"});
        walk.disable_recursion_pending();
      }
      continue;
    }
    const fs::path whole = fs::weakly_canonical(walk->path(), error);
    if (whole == out || name.ends_with(".part")) continue;
    const auto size = static_cast<std::uint64_t>(status.st_size);
    if (!S_ISREG(status.st_mode)) {
      left_out.push_back({name, "not a regular file"});
    } else if (size > options.file_bytes_max) {
      left_out.push_back({name, fmt::format("{} MiB, more than {}", size >> 20, options.file_bytes_max >> 20)});
    } else {
      found.push_back({walk->path(), name, size, static_cast<std::int64_t>(status.st_mtime)});
    }
  }
  std::ranges::sort(found, {}, &Candidate::name);
}

/// Copies a file that may not grow: what it holds beyond its size is left, what it lacks is filled with zeros and told.
Status copy_file(const Candidate& file, const std::string& name, TarGzWriter& tar, std::vector<LeftOut>& left_out) {
  std::ifstream in(file.path, std::ios::binary);
  if (!in) {
    left_out.push_back({file.name, "not readable"});
    return {};
  }
  if (const Status status = tar.begin(name, file.size, file.modified_s); !status) return status;
  std::array<char, 64 * 1024> buffer;
  std::uint64_t left = file.size;
  bool cut = false;
  while (left > 0) {
    const auto wanted = static_cast<std::size_t>(std::min<std::uint64_t>(left, buffer.size()));
    in.read(buffer.data(), static_cast<std::streamsize>(wanted));
    const auto got = static_cast<std::size_t>(in.gcount());
    std::fill(buffer.begin() + static_cast<std::ptrdiff_t>(got), buffer.end(), '\0');
    cut = cut || got < wanted;
    if (const Status status = tar.write(std::as_bytes(std::span(buffer).first(wanted))); !status) return status;
    left -= wanted;
  }
  if (cut) left_out.push_back({file.name, "became shorter while it was read; its end is zeros"});
  return {};
}

/// The begin of a file of /proc or /run, whose size nobody knows before; empty when it is not there.
std::string system_text(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::string text(kSystemFileBytesMax, '\0');
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(std::max<std::streamsize>(0, in.gcount())));
  return text;
}

}  // namespace

Result<BundleSummary> write_support_bundle(const BundleOptions& options) {
  std::error_code error;
  if (!fs::is_directory(options.folder, error)) {
    return failure(Fault::kDataMissing, "{}: no such folder", options.folder.string());
  }
  if (!fs::exists(options.folder / "result.json", error) && !fs::exists(options.folder / "journal.flj", error)) {
    return failure(Fault::kDataMissing, "{}: neither result.json nor journal.flj: there is no run in it",
                   options.folder.string());
  }
  BundleSummary summary;
  std::vector<Candidate> files;
  collect(options, files, summary.left_out);
  Result<TarGzWriter> tar = TarGzWriter::create(options.out.string());
  if (!tar) return std::unexpected(tar.error());
  fs::path whole = fs::weakly_canonical(options.folder, error);
  const std::string top = whole.filename().empty() ? std::string("run") : whole.filename().string();

  for (const Candidate& file : files) {
    const std::string name = fmt::format("{}/{}", top, file.name);
    if (name.size() > kTarNameMax) {
      summary.left_out.push_back({file.name, "its name is too long for the archive"});
      continue;
    }
    if (const Status status = copy_file(file, name, *tar, summary.left_out); !status) {
      return std::unexpected(status.error());
    }
    summary.packed.push_back(name);
    summary.bytes += file.size;
    if (shows_the_cell(file.name)) summary.with_pictures.push_back(name);
  }
  const std::int64_t now_s = std::time(nullptr);
  const auto add = [&](const std::string& name, const std::string& text) -> Status {
    summary.packed.push_back(name);
    summary.bytes += text.size();
    return tar->add(name, text, now_s);
  };
  const std::string versions =
      fmt::format("firstlook {}\npacked {}\ncompiler {}\n", version_text(), utc_date_text(), __VERSION__);
  if (const Status status = add("system/versions.txt", versions); !status) return std::unexpected(status.error());
  if (!options.configuration.empty()) {
    if (const Status status = add("system/firstlook.yaml", options.configuration); !status) {
      return std::unexpected(status.error());
    }
  }
  for (const fs::path& path : options.system_files) {
    const std::string text = system_text(path);
    if (text.empty()) continue;
    if (const Status status = add("system/" + path.filename().string(), text); !status) {
      return std::unexpected(status.error());
    }
  }
  if (const Status status = tar->commit(); !status) return std::unexpected(status.error());
  return summary;
}

}  // namespace firstlook
