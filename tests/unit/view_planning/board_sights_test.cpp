#include "algorithms/view_planning/board_sights.hpp"

#include <catch2/catch.hpp>
#include <vector>

#include "algorithms/view_planning/aim.hpp"

using namespace firstlook;

namespace {

/// A board upright at x = 1 that is looked at from the side of the arm.
ViewDesignModel model() {
  ViewDesignModel m;
  Eigen::Matrix3d rotation;
  rotation << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  m.base_T_board = {Eigen::Quaterniond(rotation), {1, 0, 0.5}};
  return m;
}

/// A flange whose camera stands `distance_m` before the board, `angle_rad` to the side.
Transform<Base, Flange> from(double angle_rad, double distance_m) {
  const ViewDesignModel m = model();
  const Eigen::Vector3d center = m.base_T_board * m.board.center();
  const Eigen::Vector3d direction(-std::cos(angle_rad), std::sin(angle_rad), 0);
  return look_at<Camera>(center, direction, distance_m, 0) * m.flange_T_camera.inverse();
}

double likelihood(const Transform<Base, Flange>& at, const std::vector<BoardLookOutcome>& looks, std::size_t k = 0) {
  return sight_likelihood(model(), k, at, looks);
}

}  // namespace

TEST_CASE("a line of sight is likely free until looks beside it fail") {
  const auto here = from(0.2, 0.6);
  const double unknown = likelihood(here, {});
  CHECK(unknown == Approx(0.8));
  const double failed = likelihood(here, {{from(0.2, 0.6), 1, 0}});
  const double beside = likelihood(here, {{from(0.4, 0.6), 1, 0}});
  const double far_off = likelihood(here, {{from(1.2, 0.6), 1, 0}});
  CHECK(failed < 0.35);
  CHECK(failed < beside);
  CHECK(beside < unknown - 0.1);
  CHECK(far_off == Approx(unknown).margin(1e-3));
  CHECK(likelihood(here, {{from(0.2, 0.6), 1, 1}}) > unknown + 0.05);
  CHECK(likelihood(here, {{from(0.2, 0.6), 1, 0}, {from(0.2, 0.6), 1, 0}}) < failed);
}

TEST_CASE("what hides a board from afar may stand behind an eye that is nearer") {
  CHECK(likelihood(from(0, 0.4), {{from(0, 0.8), 1, 0}}) > likelihood(from(0, 0.8), {{from(0, 0.4), 1, 0}}) + 0.05);
  CHECK(likelihood(from(0, 0.8), {{from(0, 0.4), 1, 1}}) < likelihood(from(0, 0.4), {{from(0, 0.8), 1, 1}}));
}

TEST_CASE("looks tell of the boards that they should have shown") {
  const auto here = from(0, 0.6);
  CHECK(likelihood(here, {{here, 2, 0}}, 0) == Approx(0.8));
  CHECK(likelihood(here, {{here, 2, 0}}, 1) < 0.35);
  CHECK(likelihood(here, {{here, 3, 1}}, 0) > 0.8);
}
