#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "algorithms/vision/rotation.hpp"
#include "app/report/html.hpp"
#include "app/report/sections.hpp"

namespace firstlook {

std::string targets_section(const RunRecord& record) {
  if (record.target_names.size() < 2 || !record.hand_eye) return {};
  const HandEyeResult& h = *record.hand_eye;
  HtmlTable table(
      {"target", "from", "views", "x mm", "y mm", "z mm", "± mm, 1σ", "roll °", "pitch °", "yaw °", "± mrad, 1σ"}, 2);
  const auto row = [&](const std::string& name, const std::string& from, std::string views, const Pose& pose,
                       const Matrix6d& covariance) {
    const Eigen::Vector3d t = pose.translation() * 1e3;
    const Eigen::Vector3d rpy = roll_pitch_yaw(pose.linear()) * (180 / std::numbers::pi);
    const auto worst = [&](Eigen::Index first) {
      return std::sqrt(std::max(0.0, covariance.diagonal().segment<3>(first).maxCoeff())) * 1e3;
    };
    table.row({name, from, std::move(views), fmt::format("{:.2f}", t.x()), fmt::format("{:.2f}", t.y()),
               fmt::format("{:.2f}", t.z()), fmt::format("{:.3f}", worst(0)), fmt::format("{:.3f}", rpy.x()),
               fmt::format("{:.3f}", rpy.y()), fmt::format("{:.3f}", rpy.z()), fmt::format("{:.3f}", worst(3))});
  };
  for (std::size_t k = 0; k < h.targets.size(); ++k) {
    const TargetPose& target = h.targets[k];
    if (target.views == 0) {
      table.row({record.target_names[k], "not solved: no usable view", "0", "", "", "", "", "", "", "", ""});
    } else {
      row(record.target_names[k], "base", fmt::format("{}", target.views), target.base_T_board.pose(),
          target.covariance);
    }
  }
  for (std::size_t k = 0; k < h.targets.size(); ++k) {
    for (std::size_t other = k + 1; other < h.targets.size(); ++other) {
      const auto seen = mutual_pose(h.targets, h.joint_covariance, static_cast<int>(k), static_cast<int>(other));
      if (seen) row(record.target_names[other], record.target_names[k], "", seen->pose.pose(), seen->covariance);
    }
  }
  std::string body = "<div class=\"scroll\">" + table.html("dense") + "</div>\n";
  body += paragraph(
      "The sigma is that of the worst axis. A target in one view alone is placed by it and tells nothing of where the "
      "camera sits.");
  return section("targets", "Where the targets are", body);
}

}  // namespace firstlook
