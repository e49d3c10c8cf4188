#include "algorithms/calibration/mistakes/whole_set_mistakes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <numeric>

namespace firstlook::mistakes {
namespace {

using PoseChange = Pose (*)(const Pose&);

Pose same(const Pose& pose) { return pose; }
Pose inverted(const Pose& pose) { return pose.inverse(Eigen::Isometry); }

Pose with_rotation(const Pose& pose, const Eigen::Matrix3d& rotation) {
  Pose changed = pose;
  changed.linear() = rotation;
  return changed;
}

/// The four numbers x y z w as they were read, one of their signs being as good as the other: that of w >= 0.
Eigen::Vector4d numbers_of(const Pose& pose) {
  const Eigen::Quaterniond q(pose.linear());
  return q.w() < 0 ? Eigen::Vector4d(-q.coeffs()) : q.coeffs();
}

Pose of_numbers(const Pose& pose, double x, double y, double z, double w) {
  return with_rotation(pose, Eigen::Quaterniond(w, x, y, z).toRotationMatrix());
}

/// w x y z were read as x y z w: the first number is the real part.
Pose real_part_first(const Pose& pose) {
  const Eigen::Vector4d q = numbers_of(pose);
  return of_numbers(pose, q[1], q[2], q[3], q[0]);
}

/// x y z w were written where w x y z is expected, and turned round once more on the way.
Pose real_part_second(const Pose& pose) {
  const Eigen::Vector4d q = numbers_of(pose);
  return of_numbers(pose, q[3], q[0], q[1], q[2]);
}

Pose transposed(const Pose& pose) { return with_rotation(pose, pose.linear().transpose()); }

/// The angles of R = Rx Ry Rz put together as Rz Ry Rx, and back. Which of its two sets of angles Eigen takes does not
/// matter: both give the same rotation in the other order, too.
Pose angles_in_other_order(const Pose& pose) {
  const Eigen::Vector3d a = pose.linear().eulerAngles(0, 1, 2);
  return with_rotation(
      pose, (Eigen::AngleAxisd(a[2], Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(a[1], Eigen::Vector3d::UnitY()) *
             Eigen::AngleAxisd(a[0], Eigen::Vector3d::UnitX()))
                .toRotationMatrix());
}
Pose angles_in_usual_order(const Pose& pose) {
  const Eigen::Vector3d a = pose.linear().eulerAngles(2, 1, 0);
  return with_rotation(
      pose, (Eigen::AngleAxisd(a[2], Eigen::Vector3d::UnitX()) * Eigen::AngleAxisd(a[1], Eigen::Vector3d::UnitY()) *
             Eigen::AngleAxisd(a[0], Eigen::Vector3d::UnitZ()))
                .toRotationMatrix());
}

struct RotationReading {
  PoseChange change;
  const char* text;
};
constexpr std::array<RotationReading, 5> kRotationReadings = {{
    {real_part_first, "quaternions stand as w x y z where x y z w is expected"},
    {real_part_second, "quaternions have their numbers moved by one place (z first instead of w last)"},
    {transposed, "rotations are inverted (transposed), their positions are not"},
    {angles_in_other_order, "rotations were made as Rx Ry Rz from angles that mean Rz Ry Rx"},
    {angles_in_usual_order, "rotations were made as Rz Ry Rx from angles that mean Rx Ry Rz"},
}};

std::vector<PosePair> changed(std::span<const PosePair> pairs, PoseChange flange, PoseChange board) {
  std::vector<PosePair> result;
  for (const PosePair& pair : pairs) {
    result.push_back({Transform<Base, Flange>(flange(pair.base_T_flange.pose())),
                      Transform<Camera, Board>(board(pair.camera_T_board.pose()))});
  }
  return result;
}

/// Numbers from `first` on, sorted as text: 1, 10, 11, 2 ...
std::vector<std::size_t> sorted_as_text(std::size_t count, std::size_t first) {
  std::vector<std::size_t> order(count);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return std::to_string(a + first) < std::to_string(b + first); });
  return order;
}

/// Row i of the poses goes with the image of row order[i].
std::vector<PosePair> reordered(std::span<const PosePair> pairs, std::span<const std::size_t> order) {
  std::vector<PosePair> result;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    result.push_back({pairs[i].base_T_flange, pairs[order[i]].camera_T_board});
  }
  return result;
}

std::vector<std::size_t> inverse_of(std::span<const std::size_t> order) {
  std::vector<std::size_t> inverse(order.size());
  for (std::size_t i = 0; i < order.size(); ++i) inverse[order[i]] = i;
  return inverse;
}

}  // namespace

std::vector<Trial> whole_set_trials(std::span<const PosePair> pairs, bool board_poses_given) {
  std::vector<Trial> trials;
  trials.push_back({Mistake::kFlangePosesInverted,
                    "the arm's poses are flange_T_base instead of base_T_flange (or the camera stands in the cell and "
                    "the arm carries the board)",
                    changed(pairs, inverted, same)});
  for (const RotationReading& reading : kRotationReadings) {
    trials.push_back(
        {Mistake::kFlangeRotations, fmt::format("the arm's {}", reading.text), changed(pairs, reading.change, same)});
  }
  if (!board_poses_given) return trials;
  trials.push_back({Mistake::kBoardPosesInverted, "the board's poses are board_T_camera instead of camera_T_board",
                    changed(pairs, same, inverted)});
  for (const RotationReading& reading : kRotationReadings) {
    trials.push_back(
        {Mistake::kBoardRotations, fmt::format("the board's {}", reading.text), changed(pairs, same, reading.change)});
    if (reading.change == transposed) continue;
    trials.push_back({Mistake::kFlangeRotations, fmt::format("the arm's and the board's {}", reading.text),
                      changed(pairs, reading.change, reading.change)});
  }
  return trials;
}

std::vector<Trial> order_trials(std::span<const PosePair> pairs) {
  std::vector<Trial> trials;
  const auto add = [&](std::string text, std::vector<PosePair> undone) {
    trials.push_back({Mistake::kOrder, std::move(text), std::move(undone)});
  };
  for (const std::size_t places : {1U, 2U}) {
    if (pairs.size() < places + 4) continue;
    std::vector<PosePair> later, earlier;
    for (std::size_t i = 0; i + places < pairs.size(); ++i) {
      later.push_back({pairs[i + places].base_T_flange, pairs[i].camera_T_board});
      earlier.push_back({pairs[i].base_T_flange, pairs[i + places].camera_T_board});
    }
    const char* plural = places == 1 ? "" : "s";
    add(fmt::format("each image was taken at the pose that stands {} row{} further down", places, plural),
        std::move(later));
    add(fmt::format("each image was taken at the pose that stands {} row{} further up", places, plural),
        std::move(earlier));
  }
  std::vector<PosePair> reversed(pairs.begin(), pairs.end());
  for (std::size_t i = 0; i < pairs.size(); ++i) reversed[i].base_T_flange = pairs[pairs.size() - 1 - i].base_T_flange;
  add("the poses stand in the reverse order of the images", std::move(reversed));
  if (pairs.size() <= 10) return trials;  // fewer numbers have one digit each
  for (const std::size_t first : {0U, 1U}) {
    const std::vector<std::size_t> order = sorted_as_text(pairs.size(), first);
    add("the images were taken in the order of their numbers sorted as text (1, 10, 11, 2), the poses by value",
        reordered(pairs, inverse_of(order)));
    add("the poses stand in the order of their numbers sorted as text (1, 10, 11, 2), the images by value",
        reordered(pairs, order));
  }
  return trials;
}

}  // namespace firstlook::mistakes
