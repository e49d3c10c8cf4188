/// `firstlook map`: a map from recorded depth frames, offline.
#pragma once

#include <filesystem>

namespace firstlook {

struct MapCommandOptions {
  std::filesystem::path dataset;
  double resolution_m = 0.05;
  double range_max_m = 5.0;
  std::filesystem::path out;  ///< empty: no files
  bool json = false;
};

/// Maps the dataset, prints the counts on stdout (JSON when asked) and narrates on stderr; with `out` writes
/// collision_map.bt, map.ot and map.ply there.
/// @return the process's exit code: 0 done, 2 usage, 3 data
int run_map_command(const MapCommandOptions& options);

}  // namespace firstlook
