/// `firstlook map`: a map from recorded depth frames or from a file, and questions about it, offline.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace firstlook {

struct MapCommandOptions {
  std::vector<std::filesystem::path> datasets;  ///< recorded frames, of one sensor each, or
  std::filesystem::path from;                   ///< a stored map, .bt or .ot
  double resolution_m = 0.05;                   ///< of a dataset's map
  double range_max_m = 5.0;
  bool sort = false;            ///< the lines of depth.txt by their stamps
  int depth = 16;               ///< where the trees of `out` are cut
  std::filesystem::path prior;  ///< an earlier map to compare with
  bool objects = false;
  std::string planes = "none";     ///< words of planes_from_words, of a dataset's map
  std::vector<std::string> moves;  ///< each "ID,dx,dy,dz"
  std::string at;                  ///< "X,Y,Z": a place to ask about
  std::filesystem::path out;       ///< empty: no files
  bool json = false;
};

/// Maps the dataset or reads the map, moves objects, prints counts, objects and what is known of the place on stdout
/// (JSON when asked) and narrates on stderr; with `out` writes collision_map.bt, map.ot and map.ply there, of a dataset
/// frames.csv, with objects objects.png, with colours color_map.ot and color.png. Planes of a stored map are those of
/// a map.ply beside it.
/// @return the process's exit code: 0 done, 2 usage, 3 data
int run_map_command(const MapCommandOptions& options);

}  // namespace firstlook
