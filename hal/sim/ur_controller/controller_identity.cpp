#include "hal/sim/ur_controller/controller_identity.hpp"

#include <bit>

#include "hal/sim/random_streams.hpp"
#include "platform/core/random.hpp"

namespace firstlook::sim::ur {
namespace {

// Published for the family: a factory correction is "a few tenths"; far inside what `inverse` accepts.
constexpr double kCorrection_m = 2e-4;
constexpr double kCorrection_rad = 3e-4;

constexpr SoftwareVersion kCb3Version{3, 15, 8, 106339};
constexpr SoftwareVersion kESeriesVersion{5, 12, 2, 1101534};

struct ModelRow {
  std::string_view arm, model;
  int robot_type;
};
constexpr ModelRow kModels[] = {{"ur3", "UR3", 3},  {"ur5", "UR5", 1},  {"ur10", "UR10", 2},
                                {"ur3e", "UR3", 3}, {"ur5e", "UR5", 1}, {"ur10e", "UR10", 2}};

void correct(ArmModel& arm, std::uint64_t seed) {
  Random random(seed, kFactoryCorrectionStream);
  for (std::size_t j = 0; j < kJoints; ++j) {
    DhRow& row = arm.dh[j];
    row.theta_offset_rad += kCorrection_rad * random.normal();
    row.d_m += kCorrection_m * random.normal();
    const double a_m = kCorrection_m * random.normal(), alpha_rad = kCorrection_rad * random.normal();
    if (j + 1 == kJoints) continue;  // the flange has no axis behind it: factories leave its a and alpha at 0
    row.a_m += a_m;
    row.alpha_rad += alpha_rad;
  }
}

std::uint32_t checksum(const DhRow& row) {
  std::uint64_t sum = 0;
  for (const double value : {row.theta_offset_rad, row.d_m, row.a_m, row.alpha_rad}) {
    sum = mix64(sum ^ std::bit_cast<std::uint64_t>(value));
  }
  return static_cast<std::uint32_t>(sum);
}

}  // namespace

std::string ControllerIdentity::version_text() const {
  return fmt::format("{}.{}.{}.{}", version.major, version.minor, version.bugfix, version.build);
}

Result<ControllerIdentity> identify_controller(std::string_view arm_name, std::uint64_t seed, std::string_view serial) {
  const ModelRow* row = nullptr;
  for (const ModelRow& known : kModels) {
    if (known.arm == arm_name) row = &known;
  }
  if (row == nullptr) {
    return failure(Fault::kUsage, "no robot '{}'; there are ur3, ur5, ur10, ur3e, ur5e, ur10e", arm_name);
  }
  ControllerIdentity robot;
  robot.series = arm_name.ends_with('e') ? Series::kESeries : Series::kCb3;
  const bool cb3 = robot.series == Series::kCb3;
  robot.version = cb3 ? kCb3Version : kESeriesVersion;
  robot.build_date = cb3 ? "Feb 14 2022" : "Aug 29 2022";
  robot.nominal = *find_arm_model(arm_name);
  robot.arm = robot.nominal;
  if (seed != 0) correct(robot.arm, seed);
  for (std::size_t j = 0; j < kJoints; ++j) robot.kinematics_checksums[j] = checksum(robot.arm.dh[j]);
  robot.model = row->model;
  robot.robot_type = row->robot_type;
  robot.serial = serial.empty() ? fmt::format("20{}{:05}", cb3 ? "1633" : "2255", mix64(seed) % 100'000) : serial;
  robot.cycle = cb3 ? milliseconds(8) : milliseconds(2);
  return robot;
}

}  // namespace firstlook::sim::ur
