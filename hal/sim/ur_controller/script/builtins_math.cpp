// Numbers, lists and poses.
#include <fmt/format.h>

#include <cmath>

#include "hal/sim/ur_controller/script/builtins.hpp"
#include "hal/sim/ur_controller/script/matrices.hpp"

namespace firstlook::sim::ur::script {
namespace {

template <double (*F)(double)>
void function(Call& c) {
  const double result = F(c.number(0));
  if (std::isnan(result)) c.fail("Argument outside the function's domain");
  c.answer(result);
}

double radians(double degrees) { return degrees * M_PI / 180; }
double degrees(double radians) { return radians * 180 / M_PI; }

template <double (*F)(double)>
void whole(Call& c) {
  c.answer(static_cast<std::int64_t>(std::clamp(F(c.number(0)), -2147483648.0, 2147483647.0)));
}

void power(Call& c) { c.answer(std::pow(c.number(0), c.number(1))); }

void logarithm(Call& c) {
  const double base = c.number(0), value = c.number(1);
  if (base <= 0 || base == 1 || value <= 0) c.fail("Argument outside the function's domain");
  c.answer(std::log(value) / std::log(base));
}

void list_length(Call& c) {
  if (const List* list = c.value(0).as<List>()) return c.answer(static_cast<std::int64_t>(list->size()));
  if (c.value(0).as<PoseValue>() != nullptr) return c.answer(std::int64_t{6});
  if (const auto* text = c.value(0).as<std::string>()) return c.answer(static_cast<std::int64_t>(text->size()));
  c.fail_type(0, "a list");
}

double length_of(const List& list) {
  double sum = 0;
  for (const Value& value : list) sum += value.number() * value.number();
  return std::sqrt(sum);
}
/// Of a number, a list or a pose.
void norm(Call& c) {
  if (const PoseValue* pose = c.value(0).as<PoseValue>()) return c.answer(length_of(list_of(pose->pose)));
  const List* list = c.value(0).as<List>();
  if (list == nullptr) return c.answer(std::abs(c.number(0)));
  c.answer(length_of(*list));
}
void normalize(Call& c) {
  const List* list = c.value(0).as<List>();
  if (list == nullptr) return c.fail_type(0, "a list");
  const double length = length_of(*list);
  if (length <= 0) return c.fail("A vector without length");
  List unit;
  for (const Value& value : *list) unit.emplace_back(value.number() / length);
  c.answer(std::move(unit));
}

/// Of a matrix its rows and columns.
void size_of(Call& c) {
  const std::size_t columns = columns_of(c.value(0));
  if (columns == 0) return list_length(c);
  const std::size_t rows = c.value(0).as<List>()->size();
  c.answer(List{Value(static_cast<std::int64_t>(rows)), Value(static_cast<std::int64_t>(columns))});
}

void transpose(Call& c) { c.answer_or_fail(transpose_of(c.value(0))); }
/// Of a pose or a square matrix.
void inverse(Call& c) {
  const List* rows = c.value(0).as<List>();
  if (rows == nullptr || rows->empty() || rows->front().as<List>() == nullptr) {
    return c.answer(PoseValue{vector_of(c.pose(0).inverse(Eigen::Isometry))});
  }
  c.machine().charge(rows->size() * rows->size() * rows->size() / 2);
  c.answer_or_fail(inverse_of_matrix(c.value(0)));
}

void pose_trans(Call& c) { c.answer(PoseValue{vector_of(c.pose(0) * c.pose(1))}); }
void pose_inv(Call& c) { c.answer(PoseValue{vector_of(c.pose(0).inverse(Eigen::Isometry))}); }

/// Positions are added, rotations are made one after the other.
void pose_add(Call& c) {
  const Pose a = c.pose(0), b = c.pose(1);
  Pose sum = Pose::Identity();
  sum.translation() = a.translation() + b.translation();
  sum.linear() = a.linear() * b.linear();
  c.answer(PoseValue{vector_of(sum)});
}
void pose_sub(Call& c) {
  const Pose a = c.pose(0), b = c.pose(1);
  Pose difference = Pose::Identity();
  difference.translation() = a.translation() - b.translation();
  difference.linear() = a.linear() * b.linear().transpose();
  c.answer(PoseValue{vector_of(difference)});
}

/// A wrench in the frame that `T_from_to` has its frame in.
void wrench_trans(Call& c) {
  const Pose from_T_to = c.pose(0);
  const Vector6 w = c.six(1);
  if (!c.ok()) return;
  const Eigen::Matrix3d to_R_from = from_T_to.linear().transpose();
  const Eigen::Vector3d force(w[0], w[1], w[2]), torque(w[3], w[4], w[5]);
  const Eigen::Vector3d at_to = to_R_from * force;
  const Eigen::Vector3d turned = to_R_from * (torque - from_T_to.translation().cross(force));
  c.answer(list_of({at_to.x(), at_to.y(), at_to.z(), turned.x(), turned.y(), turned.z()}));
}

double distance(Call& c) { return (c.pose(0).translation() - c.pose(1).translation()).norm(); }
void point_dist(Call& c) { c.answer(distance(c)); }
/// A radian counts as a metre.
void pose_dist(Call& c) {
  const double turn_rad = rotation_vector_of(c.pose(0).linear().transpose() * c.pose(1).linear()).norm();
  c.answer(std::hypot(distance(c), turn_rad));
}

void interpolate_pose(Call& c) {
  const Pose a = c.pose(0), b = c.pose(1);
  const double share = c.number(2);
  Pose at = Pose::Identity();
  at.translation() = a.translation() + share * (b.translation() - a.translation());
  const Eigen::Vector3d turn = rotation_vector_of(a.linear().transpose() * b.linear()) * share;
  if (turn.norm() > 0) at.linear() = Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix();
  at.linear() = a.linear() * at.linear();
  c.answer(PoseValue{vector_of(at)});
}

List three(const Eigen::Vector3d& v) { return {Value(v.x()), Value(v.y()), Value(v.z())}; }

void rotvec2rpy(Call& c) {
  const Vector3 v = c.three(0);
  const Eigen::Matrix3d r = pose_of({0, 0, 0, v[0], v[1], v[2]}).linear();
  const double pitch = std::atan2(-r(2, 0), std::hypot(r(0, 0), r(1, 0)));
  c.answer(three({std::atan2(r(2, 1), r(2, 2)), pitch, std::atan2(r(1, 0), r(0, 0))}));
}
void rpy2rotvec(Call& c) {
  const Vector3 v = c.three(0);
  const Eigen::Matrix3d r =
      (Eigen::AngleAxisd(v[2], Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(v[1], Eigen::Vector3d::UnitY()) *
       Eigen::AngleAxisd(v[0], Eigen::Vector3d::UnitX()))
          .toRotationMatrix();
  c.answer(three(rotation_vector_of(r)));
}

void to_bits(Call& c) {
  const auto number = static_cast<std::uint32_t>(c.integer(0));
  List bits;
  for (int i = 0; i < 32; ++i) bits.emplace_back((number >> i & 1) != 0);
  c.answer(std::move(bits));
}
void from_bits(Call& c) {
  const List* bits = c.value(0).as<List>();
  if (bits == nullptr || bits->size() > 32) return c.fail_type(0, "a list of up to 32 bools");
  std::uint32_t number = 0;
  for (std::size_t i = 0; i < bits->size(); ++i) {
    const bool* bit = (*bits)[i].as<bool>();
    if (bit == nullptr) return c.fail_type(0, "a list of bools");
    number |= *bit ? 1U << i : 0U;
  }
  c.answer(static_cast<std::int64_t>(static_cast<std::int32_t>(number)));
}

/// The same numbers for each program: a simulation repeats itself.
void random_number(Call& c) {
  CallState& state = c.state();
  std::uint64_t x = static_cast<std::uint64_t>(c.robot().control_step) * 2654435761U + state.ticket + 1;
  x ^= x >> 31;
  x *= 0x9e3779b97f4a7c15U;
  c.answer(static_cast<double>(x >> 11) / 9007199254740992.0);
}

/// With room for more elements where a capacity is given.
void make_list(Call& c) {
  const int length = c.integer(0, 0, 1000), capacity = c.integer(2, 0, static_cast<int>(kWeightMax));
  if (capacity != 0 && capacity < length) c.fail("A list longer than its capacity");
  if (c.value(1).weight * static_cast<std::size_t>(length) > kWeightMax) c.fail("Out of memory: a list is too large");
  if (c.value(1).empty()) c.fail_type(1, "a value");
  if (!c.ok()) return;
  c.answer(with_capacity(List(static_cast<std::size_t>(length), c.value(1)), static_cast<std::size_t>(capacity)));
}

constexpr Builtin kTable[] = {
    {"acos", "f", function<std::acos>},
    {"asin", "f", function<std::asin>},
    {"atan", "f", function<std::atan>},
    {"atan2", "x,y", [](Call& c) { c.answer(std::atan2(c.number(0), c.number(1))); }},
    {"binary_list_to_integer", "l", from_bits},
    {"ceil", "f", whole<std::ceil>},
    {"cos", "f", function<std::cos>},
    {"d2r", "d", function<radians>},
    {"floor", "f", whole<std::floor>},
    {"get_list_length", "v", list_length},
    {"integer_to_binary_list", "x", to_bits},
    {"inv", "m", inverse},
    {"interpolate_pose", "p_from,p_to,alpha", interpolate_pose},
    {"length", "v", list_length},
    {"log", "b,f", logarithm},
    {"make_list", "length,initial_value,capacity=0", make_list},
    {"norm", "a", norm},
    {"normalize", "v", normalize},
    {"point_dist", "p_from,p_to", point_dist},
    {"pose_add", "p_1,p_2", pose_add},
    {"pose_dist", "p_from,p_to", pose_dist},
    {"pose_inv", "p_from", pose_inv},
    {"pose_sub", "p_to,p_from", pose_sub},
    {"pose_trans", "p_from,p_from_to", pose_trans},
    {"pow", "base,exponent", power},
    {"r2d", "r", function<degrees>},
    {"random", "", random_number},
    {"rotvec2rpy", "rotation_vector", rotvec2rpy},
    {"rpy2rotvec", "rpy_vector", rpy2rotvec},
    {"sin", "f", function<std::sin>},
    {"size", "v", size_of},
    {"sqrt", "f", function<std::sqrt>},
    {"tan", "f", function<std::tan>},
    {"transpose", "m", transpose},
    {"wrench_trans", "T_from_to,w_from", wrench_trans},
};

}  // namespace

std::span<const Builtin> math_builtins() { return kTable; }

}  // namespace firstlook::sim::ur::script
