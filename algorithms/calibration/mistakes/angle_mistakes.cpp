#include "algorithms/calibration/mistakes/angle_mistakes.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "algorithms/calibration/solvers/algebra.hpp"

namespace firstlook::mistakes {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;
constexpr double kDegrees = 180 / std::numbers::pi;

/// One equation of fit_positions: R a + t + C (u + b) = 0.
struct Place {
  Eigen::Vector3d a;
  Eigen::Matrix3d c;
  Eigen::Vector3d b;
};

std::vector<Place> places_of(std::span<const PosePair> pairs, bool without_flange_rotations) {
  std::vector<Place> places;
  for (const PosePair& pair : pairs) {
    const Pose& flange = pair.base_T_flange.pose();
    const Pose& board = pair.camera_T_board.pose();
    if (without_flange_rotations) {
      places.push_back({flange.translation(), board.linear().transpose(), board.translation()});
    } else {
      places.push_back({board.translation(), flange.linear().transpose(), flange.translation()});
    }
  }
  return places;
}

struct PlaceSolution {
  Eigen::Matrix3d r;
  Eigen::Vector3d t, u;
  [[nodiscard]] Eigen::Vector3d error(const Place& p) const { return r * p.a + t + p.c * (u + p.b); }
};

std::optional<PlaceSolution> linear_solution(std::span<const Place> places) {
  solvers::RowStack<16> stack;
  for (const Place& p : places) {
    Eigen::Matrix<double, 3, 16> rows;
    rows.leftCols<9>() = solvers::kronecker(p.a, Eigen::Matrix3d::Identity());
    rows.middleCols<3>(9).setIdentity();
    rows.middleCols<3>(12) = p.c;
    rows.col(15) = -p.c * p.b;
    stack.add(rows);
  }
  const auto x = solvers::solve_triangle(stack.triangle());
  if (!x || !x->allFinite()) return std::nullopt;
  return PlaceSolution{solvers::nearest_rotation(solvers::unvec(x->head<9>())), x->segment<3>(9), x->segment<3>(12)};
}

double median_error(const PlaceSolution& solution, std::span<const Place> places) {
  std::vector<double> errors;
  for (const Place& p : places) errors.push_back(solution.error(p).norm());
  const auto middle = errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 2);
  std::nth_element(errors.begin(), middle, errors.end());
  return *middle;
}

/// Gauss-Newton on the rotation itself, places that contradict weighted down.
void refine(PlaceSolution& solution, std::span<const Place> places) {
  constexpr int kIterations = 15;
  for (int i = 0; i < kIterations; ++i) {
    const double scale_m = 3 * std::max(1e-5, median_error(solution, places));
    Eigen::Matrix<double, 9, 9> normal = Eigen::Matrix<double, 9, 9>::Zero();
    Eigen::Matrix<double, 9, 1> right = Eigen::Matrix<double, 9, 1>::Zero();
    for (const Place& p : places) {
      const Eigen::Vector3d error = solution.error(p);
      const double weight = 1 / (1 + std::pow(error.norm() / scale_m, 4));
      Eigen::Matrix<double, 3, 9> rows;
      rows << -cross_matrix(solution.r * p.a), Eigen::Matrix3d::Identity(), p.c;
      normal += weight * rows.transpose() * rows;
      right -= weight * rows.transpose() * error;
    }
    const Eigen::Matrix<double, 9, 1> step = normal.ldlt().solve(right);
    if (!step.allFinite()) return;
    solution.r = rotation_exp(step.head<3>()) * solution.r;
    solution.t += step.segment<3>(3);
    solution.u += step.tail<3>();
  }
}

/// Three numbers for a rotation: a rotation vector, or roll, pitch, yaw (R = Rz Ry Rx).
enum class Numbers : std::uint8_t { kVector, kAngles };

Eigen::Matrix3d of_angles(const Eigen::Vector3d& rpy) {
  return (Eigen::AngleAxisd(rpy[2], Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(rpy[1], Eigen::Vector3d::UnitY()) *
          Eigen::AngleAxisd(rpy[0], Eigen::Vector3d::UnitX()))
      .toRotationMatrix();
}

/// Pitch within 90 degrees.
Eigen::Vector3d to_angles(const Eigen::Matrix3d& r) {
  return {std::atan2(r(2, 1), r(2, 2)), std::atan2(-r(2, 0), std::hypot(r(2, 1), r(2, 2))),
          std::atan2(r(1, 0), r(0, 0))};
}

/// The other angles of the same rotation.
Eigen::Vector3d other_angles(const Eigen::Vector3d& rpy) {
  return {rpy[0] + std::numbers::pi, std::numbers::pi - rpy[1], rpy[2] + std::numbers::pi};
}

Eigen::Matrix3d rotation_of(Numbers kind, const Eigen::Vector3d& v) {
  return kind == Numbers::kVector ? rotation_exp(v) : of_angles(v);
}
Eigen::Vector3d numbers_of(Numbers kind, const Eigen::Matrix3d& r) {
  return kind == Numbers::kVector ? rotation_log(r) : to_angles(r);
}

/// Of all numbers that make the rotation, those nearest to `target`.
Eigen::Vector3d nearest_numbers(Numbers kind, const Eigen::Matrix3d& r, const Eigen::Vector3d& target) {
  if (kind == Numbers::kVector) {
    const Eigen::Vector3d v = rotation_log(r);
    const double angle = v.norm();
    const Eigen::Vector3d axis = angle > 1e-9 ? Eigen::Vector3d(v / angle) : target.stableNormalized();
    return (angle + kTurn * std::round((axis.dot(target) - angle) / kTurn)) * axis;
  }
  const auto wrapped = [&](Eigen::Vector3d v) {
    for (int i = 0; i < 3; ++i) v[i] += kTurn * std::round((target[i] - v[i]) / kTurn);
    return v;
  };
  const Eigen::Vector3d first = wrapped(to_angles(r)), second = wrapped(other_angles(to_angles(r)));
  return (first - target).norm() < (second - target).norm() ? first : second;
}

/// Numbers of one kind, in one unit, were turned into a rotation as if they were of another.
struct Misreading {
  Numbers meant, read_as;
  double factor;  ///< what was read is so many times what was meant
  const char* text;
};
constexpr std::array<Misreading, 9> kMisreadings = {{
    {Numbers::kVector, Numbers::kVector, kDegrees, "rotation vectors in degrees were read as radians"},
    {Numbers::kVector, Numbers::kVector, 1 / kDegrees, "rotation vectors in radians were read as degrees"},
    {Numbers::kAngles, Numbers::kAngles, kDegrees, "roll, pitch, yaw in degrees were read as radians"},
    {Numbers::kAngles, Numbers::kAngles, 1 / kDegrees, "roll, pitch, yaw in radians were read as degrees"},
    {Numbers::kVector, Numbers::kAngles, 1, "rotation vectors were read as roll, pitch, yaw"},
    {Numbers::kAngles, Numbers::kVector, 1, "roll, pitch, yaw were read as rotation vectors"},
    {Numbers::kVector, Numbers::kAngles, 1 / kDegrees,
     "rotation vectors in radians were read as roll, pitch, yaw in "
     "degrees"},
    {Numbers::kAngles, Numbers::kVector, kDegrees,
     "roll, pitch, yaw in degrees were read as rotation vectors in "
     "radians"},
    {Numbers::kVector, Numbers::kAngles, kDegrees,
     "rotation vectors in degrees were read as roll, pitch, yaw in "
     "radians"},
}};

bool can_be_meant(Numbers kind, const Eigen::Vector3d& v) {
  constexpr double kHalf = std::numbers::pi + 1e-9;
  if (kind == Numbers::kVector) return v.squaredNorm() <= kHalf * kHalf;
  return std::abs(v[0]) <= kHalf && std::abs(v[1]) <= kHalf / 2 && std::abs(v[2]) <= kHalf;
}

/// Every rotation that may have been meant by the one that was read.
std::vector<Eigen::Matrix3d> meanings(const Misreading& m, const Eigen::Matrix3d& read) {
  std::vector<Eigen::Matrix3d> result;
  const int turns = static_cast<int>(std::ceil(m.factor / 2)) + 1;
  const auto add = [&](const Eigen::Vector3d& v) {
    if (can_be_meant(m.meant, v / m.factor)) result.push_back(rotation_of(m.meant, v / m.factor));
  };
  if (m.read_as == Numbers::kVector) {
    const Eigen::Vector3d v = rotation_log(read);
    if (v.norm() < 1e-9) return {Eigen::Matrix3d::Identity()};
    for (int k = -turns; k <= turns; ++k) add(v * (1 + k * kTurn / v.norm()));
    return result;
  }
  for (const Eigen::Vector3d& v : {to_angles(read), other_angles(to_angles(read))}) {
    for (int i = -turns; i <= turns; ++i) {
      for (int j = -turns; j <= turns; ++j) {
        for (int k = -turns; k <= turns; ++k) add(v + kTurn * Eigen::Vector3d(i, j, k));
      }
    }
  }
  return result;
}

/// What was meant, near a prediction of it; empty when what was read lies farther off than noise would put it.
std::optional<Eigen::Matrix3d> meant_near(const Misreading& m, const Eigen::Matrix3d& read,
                                          const Eigen::Matrix3d& predicted) {
  // 30 mrad: rotations of a board seen from afar; 0.6 rad: beyond it every third turn would do.
  const double tolerance_rad = std::min(0.6, 0.03 * m.factor);
  const Eigen::Vector3d target = m.factor * numbers_of(m.meant, predicted);
  const Eigen::Vector3d numbers = nearest_numbers(m.read_as, read, target);
  if (!((numbers - target).norm() < tolerance_rad)) return std::nullopt;
  return rotation_of(m.meant, numbers / m.factor);
}

struct Reading {
  std::size_t explained = 0;
  std::vector<std::optional<Eigen::Matrix3d>> meant;
};

/// The reading under which most views fit, when the meaning of view `anchor` is taken from all that it can have.
Reading best_reading(const Misreading& m, std::span<const Eigen::Matrix3d> read, const PositionsFit& positions,
                     std::size_t anchor, std::size_t needed) {
  const std::size_t n = read.size(), misses_max = n - needed;
  constexpr std::size_t kFirstLook = 3;  // most of the 180,000 meanings end here; another anchor gives a second chance
  Reading best, reading;
  for (const Eigen::Matrix3d& meaning : meanings(m, read[anchor])) {
    const Eigen::Matrix3d common = positions.rotation_for[anchor].transpose() * meaning;
    reading.explained = 0;
    reading.meant.clear();
    std::size_t others = 0;
    for (std::size_t i = 0; i < n && i - reading.explained <= misses_max; ++i) {
      if (i == kFirstLook && others == 0) break;
      reading.meant.push_back(meant_near(m, read[i], positions.rotation_for[i] * common));
      if (!reading.meant.back()) continue;
      ++reading.explained;
      if (i != anchor) ++others;
    }
    if (reading.explained >= needed && reading.explained > best.explained) best = reading;
  }
  return best;
}

PosePair with_rotation(const PosePair& pair, bool of_flange, const Eigen::Matrix3d& rotation) {
  Pose pose = of_flange ? pair.base_T_flange.pose() : pair.camera_T_board.pose();
  pose.linear() = rotation;
  if (of_flange) return {Transform<Base, Flange>(pose), pair.camera_T_board};
  return {pair.base_T_flange, Transform<Camera, Board>(pose)};
}

}  // namespace

std::optional<PositionsFit> fit_positions(std::span<const PosePair> pairs, bool without_flange_rotations) {
  if (pairs.size() < 6) return std::nullopt;
  const std::vector<Place> places = places_of(pairs, without_flange_rotations);
  auto solution = linear_solution(places);
  if (!solution) return std::nullopt;
  refine(*solution, places);
  PositionsFit fit{median_error(*solution, places), {}};
  for (const Place& p : places) fit.rotation_for.emplace_back(solution->r.transpose() * p.c);
  return fit;
}

std::vector<Trial> angle_trials(std::span<const PosePair> pairs, const PositionsFit& positions, bool of_flange) {
  std::vector<Eigen::Matrix3d> read;
  for (const PosePair& pair : pairs) {
    read.push_back(of_flange ? pair.base_T_flange.rotation() : pair.camera_T_board.rotation());
  }
  const std::size_t needed = (7 * pairs.size() + 9) / 10;
  std::vector<Trial> trials;
  for (const Misreading& m : kMisreadings) {
    Reading reading = best_reading(m, read, positions, 0, needed);
    if (reading.explained == 0) reading = best_reading(m, read, positions, pairs.size() / 2, needed);
    if (reading.explained == 0) continue;
    Trial trial{of_flange ? Mistake::kFlangeRotations : Mistake::kBoardRotations,
                fmt::format("the {} {}", of_flange ? "arm's" : "board's", m.text),
                {}};
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      if (reading.meant[i]) trial.pairs.push_back(with_rotation(pairs[i], of_flange, *reading.meant[i]));
    }
    trials.push_back(std::move(trial));
  }
  return trials;
}

}  // namespace firstlook::mistakes
