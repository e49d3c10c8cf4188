/// An arm from a file: a URDF, or a YAML table of Denavit-Hartenberg rows with capsules.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "algorithms/kinematics/arm_model.hpp"
#include "app/config/config.hpp"
#include "platform/core/result.hpp"

namespace firstlook {

/// What the configuration says of the file.
struct ArmFileOptions {
  std::string base_link;                        ///< of a URDF; empty: its root
  std::string tip_link;                         ///< empty: the end of the only chain with joints that move
  std::vector<std::string> links_without_body;  ///< names, or numbers of links
};
[[nodiscard]] ArmFileOptions arm_file_options(const Config::Arm& config);

struct ArmFromFile {
  ArmModel arm;
  std::string summary;  ///< one line for people: joints, links, where Base is, what was assumed
};

/// Reads .urdf, .yaml or .yml by its extension; meshes (STL, OBJ) stand beside the file or, for package://NAME/..., in
/// a folder NAME at or above it. The name is the file's `name`, without one that of the file; it must not be that of a
/// built-in arm. The body contains every vertex of the file's geometry (checked), and 10 mm. Errors with the place in
/// the file: kDataMissing for a file that cannot be read, kConfigBadValue for everything that is no arm of 2 to 7
/// rotary joints with limits.
[[nodiscard]] Result<ArmFromFile> read_arm_file(const std::string& path, const ArmFileOptions& options = {});

/// The same from text. `folder` is where meshes are looked for; `name` stands in front of errors.
[[nodiscard]] Result<ArmFromFile> parse_arm_yaml(std::string_view yaml, const std::string& name,
                                                 const ArmFileOptions& options = {});
[[nodiscard]] Result<ArmFromFile> parse_arm_urdf(std::string_view urdf, const std::string& name,
                                                 const std::string& folder, const ArmFileOptions& options = {});

}  // namespace firstlook
