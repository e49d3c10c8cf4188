#include "algorithms/view_planning/board_sights.hpp"

#include <algorithm>
#include <cmath>

namespace firstlook {
namespace {

constexpr double kUnseenLikelihood = 0.8;
constexpr double kUnseenWeight = 0.5;  // of that, against looks in the very direction
constexpr double kAlike_rad = 0.2;     // standard deviation of directions that tell of each other: half a small board

}  // namespace

double sight_likelihood(const ViewDesignModel& model, std::size_t k, const Transform<Base, Flange>& base_T_flange,
                        std::span<const BoardLookOutcome> looks) {
  const Eigen::Vector3d center = model.base_T_board * model.board.center();
  const auto from_center = [&](const Transform<Base, Flange>& flange) {
    return Eigen::Vector3d((flange * model.flange_T_camera).translation() - center);
  };
  const Eigen::Vector3d here = from_center(base_T_flange);
  double seen = kUnseenLikelihood * kUnseenWeight, all = kUnseenWeight;
  for (const BoardLookOutcome& look : looks) {
    if ((look.expected >> k & 1U) == 0) continue;
    const Eigen::Vector3d there = from_center(look.base_T_flange);
    const double angle_rad = std::atan2(here.cross(there).norm(), here.dot(there));
    const double nearness = std::exp(-angle_rad * angle_rad / (2 * kAlike_rad * kAlike_rad));
    const double farther = here.norm() / there.norm();
    const bool was_seen = (look.seen >> k & 1U) != 0;
    const double weight = nearness * std::min(1.0, was_seen ? 1 / farther : farther);
    all += weight;
    if (was_seen) seen += weight;
  }
  return seen / all;
}

}  // namespace firstlook
