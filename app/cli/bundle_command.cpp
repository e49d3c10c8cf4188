#include "app/cli/bundle_command.hpp"

#include <fmt/format.h>

#include <cstdio>
#include <filesystem>

#include "app/bundle/support_bundle.hpp"
#include "app/cli/exit_codes.hpp"

namespace firstlook {
namespace {

constexpr std::size_t kShownMax = 20;

}  // namespace

int run_bundle_command(const BundleCommandOptions& options) {
  // A configuration that is wrong is what support wants to see, too: as an error in its place.
  const Result<LoadedConfig> loaded = load_config(options.sources);
  BundleOptions bundle;
  bundle.folder = options.folder;
  bundle.configuration = loaded ? print_config(loaded->config) : "# not readable: " + describe(loaded.error()) + "\n";
  std::error_code ignored;
  const std::string name = std::filesystem::weakly_canonical(options.folder, ignored).filename().string();
  bundle.out = options.out.empty() ? fmt::format("{}.tar.gz", name.empty() ? "run" : name) : options.out;
  const Result<BundleSummary> packed = write_support_bundle(bundle);
  if (!packed) return fail(packed.error());
  fmt::print(stderr, "packed    {} files, {:.1f} MB\n", packed->packed.size(),
             static_cast<double>(packed->bytes) * 1e-6);
  for (std::size_t i = 0; i < packed->left_out.size() && i < kShownMax; ++i) {
    fmt::print(stderr, "left out  {}: {}\n", packed->left_out[i].name, packed->left_out[i].why);
  }
  if (packed->left_out.size() > kShownMax)
    fmt::print(stderr, "left out  {} more\n", packed->left_out.size() - kShownMax);
  if (!packed->with_pictures.empty()) {
    fmt::print(stderr,
               "warning   {} of them show the cell, in pictures or as a map: ask who may see it before you send it\n",
               packed->with_pictures.size());
  }
  fmt::print("{}\n", bundle.out.string());
  return kExitDone;
}

}  // namespace firstlook
