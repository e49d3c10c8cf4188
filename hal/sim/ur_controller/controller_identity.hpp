/// Which robot is simulated: arm, controller generation, software version, serial number, factory correction.
#pragma once

#include <array>
#include <compare>
#include <cstdint>
#include <string>
#include <string_view>

#include "algorithms/kinematics/arm_model.hpp"
#include "platform/core/result.hpp"
#include "platform/core/time.hpp"

namespace firstlook::sim::ur {

inline constexpr std::size_t kJoints = 6;

struct SoftwareVersion {
  int major = 0, minor = 0, bugfix = 0, build = 0;
  auto operator<=>(const SoftwareVersion&) const = default;
};

enum class Series : std::uint8_t { kCb3, kESeries };

struct ControllerIdentity {
  Series series = Series::kCb3;
  SoftwareVersion version;
  std::string_view build_date;  ///< as `PolyscopeVersion` prints it
  ArmModel nominal;             ///< as published
  ArmModel arm;                 ///< as this very arm was measured in the factory: what the controller computes with
  std::array<std::uint32_t, kJoints> kinematics_checksums{};
  std::string_view model;  ///< "UR3", "UR5", "UR10": what `get robot model` answers for both generations
  int robot_type = 0;      ///< its number on the primary interface
  std::string serial;
  Duration cycle{};  ///< of the control loop: 8 ms or 2 ms

  [[nodiscard]] double frequency_hz() const { return series == Series::kCb3 ? 125 : 500; }
  /// "3.15.8.106339"
  [[nodiscard]] std::string version_text() const;
};

/// The robot of that name (`find_arm_model`): CB3 with software 3.15, or e-Series with 5.12. A seed other than 0 draws
/// a factory correction of the DH table, some tenths of a millimetre and of a milliradian; 0 leaves the published one.
/// An empty serial number is made up from the seed. Error: kUsage for a name that is not there.
[[nodiscard]] Result<ControllerIdentity> identify_controller(std::string_view arm_name, std::uint64_t seed,
                                                             std::string_view serial);

}  // namespace firstlook::sim::ur
