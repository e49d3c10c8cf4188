#include "algorithms/vision/standing_picture.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

#include "platform/core/random.hpp"

using namespace firstlook;

namespace {

/// Corners of a board of `columns` x `rows`, 20 px apart, as one frame shows them.
CornerSet frame(Random& random, int columns, int rows, double sigma_px, const Eigen::Vector2d& shift = {0, 0},
                double turn_rad = 0) {
  CornerSet set;
  const Eigen::Rotation2Dd turn(turn_rad);
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      const Eigen::Vector2d p(20 * c - 10.0 * (columns - 1), 20 * r - 10.0 * (rows - 1));
      const Eigen::Vector2d noise(random.normal(), random.normal());
      set.corners_px.emplace_back(Eigen::Vector2d(320, 240) + turn * p + shift + sigma_px * noise);
    }
  }
  return set;
}

}  // namespace

TEST_CASE("frames that only scatter stand still, and their scatter is measured") {
  Random random(1);
  int moving = 0;
  double scatter2 = 0;
  constexpr int kLooks = 4000;
  for (int i = 0; i < kLooks; ++i) {
    std::vector<CornerSet> frames;
    for (int k = 0; k < 3; ++k) frames.push_back(frame(random, 9, 6, 0.1));
    const auto picture = judge_standing(frames);
    REQUIRE(picture);
    moving += picture->still ? 0 : 1;
    scatter2 += picture->scatter_px * picture->scatter_px;
  }
  CHECK(moving <= 5);  // 2 steps each, 1e-4: 0.8 are expected
  CHECK(std::sqrt(scatter2 / kLooks) == Approx(0.1).epsilon(0.01));
}

TEST_CASE("four corners stand still, too, by chance no more often than stated") {
  Random random(2);
  int moving = 0;
  constexpr int kLooks = 4000;
  for (int i = 0; i < kLooks; ++i) {
    const std::vector<CornerSet> frames = {frame(random, 2, 2, 0.1), frame(random, 2, 2, 0.1),
                                           frame(random, 2, 2, 0.1)};
    moving += judge_standing(frames)->still ? 0 : 1;
  }
  CHECK(moving <= 5);
}

TEST_CASE("a shift or a turn of the picture is seen, however it goes on") {
  Random random(3);
  int shifts = 0, turns = 0;
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector2d there(0.15, 0);
    const std::vector<CornerSet> swings = {frame(random, 9, 6, 0.1), frame(random, 9, 6, 0.1, there),
                                           frame(random, 9, 6, 0.1)};
    const auto swinging = judge_standing(swings);
    shifts += swinging->still ? 0 : 1;
    CHECK(swinging->scatter_px == Approx(0.1).epsilon(0.25));
    const std::vector<CornerSet> rolls = {frame(random, 9, 6, 0.1), frame(random, 9, 6, 0.1, {0, 0}, 0.003)};
    turns += judge_standing(rolls)->still ? 0 : 1;
  }
  CHECK(shifts > 190);
  CHECK(turns > 190);
}

TEST_CASE("without noise any motion above what matters is seen, a smaller one is none") {
  Random random(4);
  const std::vector<CornerSet> creeping = {frame(random, 9, 6, 0), frame(random, 9, 6, 0, {0.01, 0})};
  CHECK(judge_standing(creeping)->still);
  CHECK(judge_standing(creeping)->moved_px == Approx(0.01));
  const std::vector<CornerSet> moving = {frame(random, 9, 6, 0), frame(random, 9, 6, 0, {0.03, 0})};
  CHECK_FALSE(judge_standing(moving)->still);
  CHECK_FALSE(judge_standing(std::vector{moving[0], moving[1], moving[0]}, 0.02)->still);
  CHECK(judge_standing(moving, 0.05)->still);
}

TEST_CASE("one frame stands still, frames that share few corners are compared by these") {
  Random random(5);
  CornerSet a = frame(random, 4, 3, 0);
  const auto one = judge_standing(std::vector{a});
  REQUIRE(one);
  CHECK(one->still);
  CHECK(one->scatter_px == 0);
  CHECK(one->mean.corners_px.size() == 12);
  CornerSet b = frame(random, 4, 3, 0, {0.5, 0});
  a.ids = b.ids = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11};
  a.ids.resize(9), a.corners_px.resize(9);  // 0 .. 8
  b.ids.erase(b.ids.begin(), b.ids.begin() + 4), b.corners_px.erase(b.corners_px.begin(), b.corners_px.begin() + 4);
  const auto seen_in_part = judge_standing(std::vector{a, b});
  REQUIRE(seen_in_part);
  CHECK(seen_in_part->moved_px == Approx(0.5));
  CHECK_FALSE(seen_in_part->still);
  CHECK_FALSE(judge_standing({}));
}
