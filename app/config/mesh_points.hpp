/// The vertices of meshes in files.
#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "platform/core/result.hpp"

namespace firstlook {

/// The vertices of an STL (binary or text) or OBJ file, each as often as it stands there, in the file's own units.
/// Errors: kDataMissing; kDataMalformed with the place for what is no such mesh, is cut short, or holds a number that
/// is not finite.
[[nodiscard]] Result<std::vector<Eigen::Vector3d>> read_mesh_points(const std::string& path);

/// The same from bytes; `extension` is ".stl" or ".obj", `name` stands in front of errors.
[[nodiscard]] Result<std::vector<Eigen::Vector3d>> parse_mesh_points(std::string_view bytes, std::string_view extension,
                                                                     std::string_view name);

}  // namespace firstlook
