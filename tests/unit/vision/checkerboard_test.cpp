#include "algorithms/vision/checkerboard.hpp"

#include <catch2/catch.hpp>
#include <numbers>

#include "algorithms/vision/checkerboard_lattice.hpp"
#include "algorithms/vision/saddle_points.hpp"
#include "tests/unit/vision/draw_board.hpp"

using namespace firstlook;
using test::draw_board;
using test::look_at_board;

namespace {
constexpr CameraIntrinsics kCamera{640, 480, 534.78, 534.10, 308.63, 226.92, .04586, -.1301, .0025, -.0006, 0};
constexpr double kDegree = std::numbers::pi / 180;

double rms_error_px(const BoardSpec& board, const Pose& camera_T_board, const CornerSet& found) {
  double sum = 0;
  for (int i = 0; i < board.corners(); ++i) {
    const auto truth = project(kCamera, camera_T_board * board.corner(i));
    sum += (*truth - found.corners_px[static_cast<std::size_t>(i)]).squaredNorm();
  }
  return std::sqrt(sum / (2 * board.corners()));
}
}  // namespace

TEST_CASE("corners are found where they are, at every roll, with the right one first", "[vision]") {
  const BoardSpec board{9, 6, 0.03};
  for (int roll = 0; roll < 360; roll += 30) {
    const Pose pose = look_at_board(board, 0.6, 20 * kDegree, roll * 0.02, roll * kDegree);
    const auto found = detect_checkerboard(draw_board(kCamera, board, pose).view(), board);
    REQUIRE(found);
    CAPTURE(roll);
    CHECK(rms_error_px(board, pose, *found) < 0.08);
  }
}

TEST_CASE("steep views keep their accuracy", "[vision]") {
  const BoardSpec board{9, 6, 0.03};
  for (const double tilt : {35.0, 50.0, 60.0}) {
    const Pose pose = look_at_board(board, 0.5, tilt * kDegree, 1.2, 0.3);
    const auto found = detect_checkerboard(draw_board(kCamera, board, pose).view(), board);
    CAPTURE(tilt);
    REQUIRE(found);
    CHECK(rms_error_px(board, pose, *found) < 0.15);
  }
}

TEST_CASE("a small, far board is found in a close-up", "[vision]") {
  const BoardSpec board{9, 6, 0.03};
  int found = 0;
  for (int i = 0; i < 10; ++i) {
    Pose pose = look_at_board(board, 2.0, 0.05 * i, i, 0.6 * i);
    pose.translation().x() += 0.06 * i - 0.3;
    const auto corners = detect_checkerboard(draw_board(kCamera, board, pose).view(), board);
    if (corners && rms_error_px(board, pose, *corners) < 0.2) ++found;
  }
  CHECK(found >= 9);
}

TEST_CASE("a dark, noisy picture still gives the board", "[vision]") {
  const BoardSpec board{9, 6, 0.03};
  const Pose pose = look_at_board(board, 0.7, 0.2, 0, 0.1);
  const auto image = draw_board(kCamera, board, pose, {10, 60, 30, 3, 5});
  const auto found = detect_checkerboard(image.view(), board);
  REQUIRE(found);
  CHECK(rms_error_px(board, pose, *found) < 0.5);
}

TEST_CASE("a board half outside the picture, another board, and no board are refused", "[vision]") {
  const BoardSpec board{9, 6, 0.03};
  Pose pose = look_at_board(board, 0.5, 0.2, 0, 0);
  pose.translation().x() += 0.25;
  CHECK(detect_checkerboard(draw_board(kCamera, board, pose).view(), board).error().fault == Fault::kBoardNotFound);
  const BoardSpec other{7, 6, 0.03};
  const auto image = draw_board(kCamera, other, look_at_board(other, 0.5, 0.2, 0, 0));
  CHECK(detect_checkerboard(image.view(), board).error().fault == Fault::kBoardNotFound);
  const std::vector<std::uint8_t> grey(640 * 480, 128);
  CHECK(detect_checkerboard({grey.data(), 640, 480}, board).error().fault == Fault::kBoardNotFound);
}

TEST_CASE("an unusable board or image is refused", "[vision]") {
  const std::vector<std::uint8_t> grey(640 * 480, 128);
  CHECK(detect_checkerboard({grey.data(), 640, 480}, {2, 6, 0.03}).error().fault == Fault::kConfigBadValue);
  CHECK(detect_checkerboard({grey.data(), 640, 480}, {9, 6, 0.0}).error().fault == Fault::kConfigBadValue);
  CHECK(detect_checkerboard({grey.data(), 640, 480}, {100, 100, 0.03}).error().fault == Fault::kConfigBadValue);
  CHECK(detect_checkerboard({grey.data(), 20, 20}, {9, 6, 0.03}).error().fault == Fault::kDataMalformed);
  CHECK(detect_checkerboard({}, {9, 6, 0.03}).error().fault == Fault::kDataMalformed);
}

TEST_CASE("boards without a unique orientation start at the upper left of the picture", "[vision]") {
  const BoardSpec board{8, 6, 0.03};
  CHECK_FALSE(board.is_orientation_unique());
  const auto found =
      detect_checkerboard(draw_board(kCamera, board, look_at_board(board, 0.6, 0.3, 0, 3.0)).view(), board);
  REQUIRE(found);
  CHECK(found->corners_px.front().sum() < found->corners_px.back().sum());
}

TEST_CASE("a clean wall has no saddle points, a board has one for each corner", "[vision]") {
  const BoardSpec board{9, 6, 0.03};
  const auto image = draw_board(kCamera, board, look_at_board(board, 0.6, 0.3, 0, 0.4));
  CHECK(find_saddle_points(image.view()).size() >= static_cast<std::size_t>(board.corners()) * 9 / 10);
  const auto wall = draw_board(kCamera, board, look_at_board(board, 50, 0, 0, 0), {30, 220, 130, 3, 1});
  CHECK(find_saddle_points(wall.view()).size() < saddle_points_min(board.corners()));
}

TEST_CASE("a picture with too many saddle points is known by the first of them", "[vision]") {
  Random random(2);
  std::vector<std::uint8_t> noise(320 * 240);
  for (auto& pixel : noise) pixel = static_cast<std::uint8_t>(random.below(256));
  const GrayImage image{noise.data(), 320, 240};
  const SaddlePoints all = find_saddle_points(image);
  REQUIRE(all.size() > 500);
  for (const std::size_t count_max : {std::size_t{0}, std::size_t{100}, all.size() - 1, all.size(), all.size() + 1}) {
    const SaddlePoints some = find_saddle_points(image, count_max);
    CAPTURE(count_max);
    REQUIRE(some.size() == std::min(all.size(), count_max + 1));
    CHECK(std::equal(some.begin(), some.end(), all.begin(), [](const SaddlePoint& a, const SaddlePoint& b) {
      return a.u == b.u && a.v == b.v && a.xy == b.xy;
    }));
  }
}

TEST_CASE("corners that stand three times as far one way as the other are put in order", "[vision]") {
  const BoardSpec board{9, 6, 0.03};
  const std::vector<std::uint8_t> grey(640 * 480, 128);
  for (const double small_px : {4.0, 7.0, 9.0, 14.0, 20.0}) {
    for (const double ratio : {1.0, 2.0, 3.3}) {
      SaddlePoints saddles;
      for (int i = 0; i < board.corners(); ++i) {
        const int column = i % board.inner_columns, row = i / board.inner_columns;
        SaddlePoint s{static_cast<float>(40 + small_px * column), static_cast<float>(40 + ratio * small_px * row)};
        s.xy = (column + row) % 2 == 0 ? 100.0F : -100.0F;
        saddles.push_back(s);
      }
      const auto corners = find_checkerboard_lattice({grey.data(), 640, 480}, saddles, board);
      CAPTURE(small_px, ratio);
      REQUIRE(corners.size() == saddles.size());
      const bool turned = corners[0].y() > 50;  // by half a turn: the caller settles that
      for (std::size_t i = 0; i < saddles.size(); ++i) {
        const SaddlePoint& s = saddles[turned ? saddles.size() - 1 - i : i];
        CHECK(corners[i] == Eigen::Vector2d(s.u, s.v));
      }
    }
  }
}

TEST_CASE("frames are averaged, a frame that disagrees is left out", "[vision]") {
  const CornerSet a{{{1, 1}, {2, 2}}, 0.1}, b{{{1.2, 1}, {2.2, 2}}, 0.1}, moved{{{9, 9}, {12, 12}}, 0.1};
  const std::vector<CornerSet> frames{a, moved, b};
  const auto mean = average_corners(frames);
  REQUIRE(mean);
  CHECK(mean->corners_px[0].isApprox(Eigen::Vector2d(1.1, 1)));
  const std::vector<CornerSet> apart{a, moved, {{{-9, -9}, {-12, -12}}, 0.1}};
  CHECK_FALSE(average_corners(apart));
  CHECK_FALSE(average_corners({}));
}
