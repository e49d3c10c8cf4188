#include "algorithms/calibration/touch_test.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <array>
#include <cmath>
#include <string_view>

#include "algorithms/calibration/board_ambiguity.hpp"
#include "algorithms/calibration/chi_square.hpp"
#include "algorithms/calibration/moved_by.hpp"

namespace firstlook {
namespace {

constexpr double kSamePlace_m = 5e-5;  // half of what a UR arm repeats
constexpr double kSamePlace_rad = 1e-4;

/// Thesis eq. 8-4 (by the touched board), 8-5 (by the arm and the hand-eye transform) and 8-6.
CameraError camera_error(const TouchedBoard& touched, const CalibratedBoard& calibrated, const PosePair& view) {
  const auto by_touch = touched.base_T_board * view.camera_T_board.inverse();
  const auto by_hand_eye = view.base_T_flange * calibrated.flange_T_camera;
  const auto error = by_hand_eye.inverse() * by_touch;
  CameraError e;
  e << error.translation(), rotation_log(error.rotation());
  return e;
}

/// For each view the first one that was taken from the same place.
std::vector<std::size_t> places_of(std::span<const PosePair> views) {
  std::vector<std::size_t> places;
  for (std::size_t i = 0; i < views.size(); ++i) {
    std::size_t same = 0;
    for (; same < i; ++same) {
      const Vector6d d = pose_difference(views[i].base_T_flange.pose(), views[same].base_T_flange.pose());
      if (d.head<3>().norm() < kSamePlace_m && d.tail<3>().norm() < kSamePlace_rad) break;
    }
    places.push_back(same < i ? places[same] : i);
  }
  return places;
}

CameraError mean_of(std::span<const CameraError> errors) {
  CameraError sum = CameraError::Zero();
  for (const CameraError& e : errors) sum += e;
  return sum / static_cast<double>(errors.size());
}

CameraError squares_about(const CameraError& mean, std::span<const CameraError> errors) {
  CameraError sum = CameraError::Zero();
  for (const CameraError& e : errors) sum += (e - mean).cwiseAbs2();
  return sum;
}

/// How a shift of the board moves the mean error of the cameras.
Matrix6d mean_moved_by_board(const CalibratedBoard& calibrated, std::span<const PosePair> views) {
  Matrix6d sum = Matrix6d::Zero();
  for (const PosePair& view : views) {
    const auto camera = view.base_T_flange * calibrated.flange_T_camera;
    sum += moved_by(camera.rotation().transpose(), camera.translation() - calibrated.base_T_board.translation());
  }
  return sum / static_cast<double>(views.size());
}

void measure_errors(const CalibratedBoard& calibrated, std::span<const PosePair> views, TouchTest& test) {
  const std::vector<std::size_t> places = places_of(views);
  std::vector<CameraError> place_means;
  std::vector<PosePair> place_views;
  CameraError static_squares = CameraError::Zero();
  int static_places = 0;
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (places[i] != i) continue;
    std::vector<CameraError> looks;
    for (std::size_t k = i; k < views.size(); ++k) {
      if (places[k] == i) looks.push_back(test.errors[k]);
    }
    place_means.push_back(mean_of(looks));
    place_views.push_back(views[i]);
    if (looks.size() < 2) continue;
    static_squares += squares_about(place_means.back(), looks);
    test.static_looks += static_cast<int>(looks.size());
    ++static_places;
  }
  test.places = static_cast<int>(place_means.size());
  if (test.places == 0) return;
  test.mean = mean_of(place_means);
  if (test.places > 1) {
    test.view_deviation = (squares_about(test.mean, place_means) / (test.places - 1)).cwiseSqrt();
  }
  if (static_places > 0) {
    test.static_deviation = (static_squares / (test.static_looks - static_places)).cwiseSqrt();
  }
  const Matrix6d j = mean_moved_by_board(calibrated, place_views);
  const Matrix6d covariance = j * (test.board.covariance + calibrated.covariance) * j.transpose();
  const CameraError of_views = test.view_deviation.cwiseAbs2() / test.places;
  test.mean_sigma = (covariance.diagonal().cwiseMax(0) + of_views).cwiseSqrt();
}

/// A board as it lies when its frame is turned, with the covariance that this gives it.
CalibratedBoard turned(const TouchedBoard& touched, const Pose& turn) {
  CalibratedBoard board;
  board.base_T_board = Transform<Base, Board>(touched.base_T_board.pose() * turn);
  const Matrix6d j = moved_by(Eigen::Matrix3d::Identity(), touched.base_T_board.rotation() * turn.translation());
  board.covariance = j * touched.covariance * j.transpose();
  return board;
}

/// Chi-square between two boards by both covariances.
double disagreement(const CalibratedBoard& touched, const CalibratedBoard& calibrated) {
  const Vector6d shift = pose_difference(touched.base_T_board.pose(), calibrated.base_T_board.pose());
  const Matrix6d covariance = touched.covariance + calibrated.covariance;
  return shift.dot(covariance.ldlt().solve(shift));
}

/// A board whose corners were counted from another corner lies turned about its middle.
struct CountedFrom {
  Eigen::Vector3d axis;
  std::string_view text;
};
const std::array<CountedFrom, 3>& other_corners() {
  static const std::array<CountedFrom, 3> kOthers = {CountedFrom{{0, 0, 1}, "columns and rows both from the other end"},
                                                     CountedFrom{{0, 1, 0}, "columns from the other end"},
                                                     CountedFrom{{1, 0, 0}, "rows from the other end"}};
  return kOthers;
}

/// How the corners were counted, when that explains a board that lies elsewhere.
std::string_view counted_otherwise(const BoardSpec& board, const TouchTest& test, const CalibratedBoard& calibrated) {
  const Eigen::Vector3d middle = board.center();
  for (const CountedFrom& other : other_corners()) {
    Pose turn = Pose::Identity();
    turn.linear() = 2 * other.axis * other.axis.transpose() - Eigen::Matrix3d::Identity();  // half a turn
    turn.translation() = middle - turn.linear() * middle;
    constexpr double kExplains = 0.01;  // of the misfit is left
    if (disagreement(turned(test.board, turn), calibrated) < kExplains * test.chi2) return other.text;
  }
  return {};
}

void name_mistakes(const BoardSpec& board, const CalibratedBoard& calibrated, TouchTest& test) {
  const TouchedBoard& touched = test.board;
  if (test.chi2 > test.chi2_limit) {
    const auto counted = counted_otherwise(board, test, calibrated);
    if (!counted.empty())
      test.reasons.push_back(fmt::format("likely mistake: the touched corners were counted with {}", counted));
  }
  constexpr double kClear = 4;         // sigmas
  constexpr double kScaleMin = 0.003;  // paper grows by less
  const double off = touched.scale - 1;
  if (std::abs(off) > std::max(kClear * touched.scale_sigma, kScaleMin)) {
    test.reasons.push_back(
        fmt::format("likely mistake: the touched corners are {:.2f} ± {:.2f} % {} than the board's size says: measure "
                    "the squares",
                    std::abs(off) * 100, touched.scale_sigma * 100, off > 0 ? "farther apart" : "nearer together"));
  }
  if (const double limit = chi_square_quantile(0.999, 3); touched.tip_chi2 > limit) {
    test.reasons.push_back(
        fmt::format("likely mistake: the tip is not where it was said to be on the flange (chi-square {:.1f}, allowed "
                    "{:.1f})",
                    touched.tip_chi2, limit));
  }
}

void judge(const TouchTestLimits& limits, TouchTest& test) {
  if (!(test.chi2 <= test.chi2_limit)) {
    test.reasons.push_back(
        fmt::format("the touch test contradicts the calibration: it puts the board's origin {:.2f} mm and {:.2f} mrad "
                    "from where the camera does, chi-square {:.1f} with 6 degrees of freedom, allowed {:.1f}",
                    test.shift.head<3>().norm() * 1e3, test.shift.tail<3>().norm() * 1e3, test.chi2, test.chi2_limit));
  }
  const auto above = [&](const char* what, Eigen::Index first, double limit, const char* unit) {
    const double error = test.mean.segment<3>(first).norm(), sigma = test.mean_sigma.segment<3>(first).maxCoeff();
    if (!(error <= limit)) {
      test.reasons.push_back(fmt::format("the touch test finds the camera {} by {:.2f} ± {:.2f} {}, allowed {:.3g} {}",
                                         what, error * 1e3, sigma * 1e3, unit, limit * 1e3, unit));
    } else if (!(3 * sigma <= limit)) {
      test.reasons.push_back(
          fmt::format("the touches are too few, too near to each other or too coarse for a test: 3 sigma of the "
                      "camera {} are {:.2f} {}, allowed {:.3g} {}",
                      what, 3 * sigma * 1e3, unit, limit * 1e3, unit));
    }
  };
  above("moved", 0, limits.error_max_m, "mm");
  above("turned", 3, limits.error_max_rad, "mrad");
}

}  // namespace

TouchTest test_by_touch(const BoardSpec& board, TouchedBoard touched, const CalibratedBoard& calibrated,
                        std::span<const PosePair> views, const TouchTestLimits& limits) {
  TouchTest test;
  test.board = std::move(touched);
  if (!board.is_orientation_unique()) {  // either end may be where a person begins to count
    const CalibratedBoard other = turned(test.board, half_turn(board).pose());
    if (disagreement(other, calibrated) < disagreement(turned(test.board, Pose::Identity()), calibrated)) {
      test.board.base_T_board = other.base_T_board;
      test.board.covariance = other.covariance;
    }
  }
  for (const PosePair& view : views) test.errors.push_back(camera_error(test.board, calibrated, view));
  measure_errors(calibrated, views, test);
  test.shift = pose_difference(test.board.base_T_board.pose(), calibrated.base_T_board.pose());
  test.chi2 = disagreement(turned(test.board, Pose::Identity()), calibrated);
  test.chi2_limit = chi_square_quantile(1 - limits.significance, 6);
  judge(limits, test);
  name_mistakes(board, calibrated, test);
  return test;
}

}  // namespace firstlook
