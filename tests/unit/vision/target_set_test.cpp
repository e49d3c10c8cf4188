#include "algorithms/vision/target_set.hpp"

#include <catch2/catch.hpp>

#include "tests/unit/vision/draw_board.hpp"

using namespace firstlook;
using Catch::Matchers::Contains;
using D = MarkerDictionary;
using T = TargetType;

namespace {

constexpr CameraIntrinsics kCamera{640, 480, 534.78, 534.10, 308.63, 226.92, .04586, -.1301, .0025, -.0006, 0};

const BoardSpec kCheckers{9, 6, .03};
const BoardSpec kCharuco{7, 5, .03, T::kCharuco, .022, D::k4x4_50};
const BoardSpec kGrid{4, 3, .05, T::kMarkerGrid, .04, D::k4x4_50, 20};

std::string why(const BoardSpec& a, const BoardSpec& b) {
  const std::vector<NamedTarget> both = {{"door", a}, {"table", b}};
  const Status status = check_distinct(both);
  return status ? std::string() : std::string(status.error().detail());
}

/// Both boards in one picture: left half from one, right half from the other.
test::DrawnImage side_by_side(const BoardSpec& left, const BoardSpec& right) {
  const auto placed = [](const BoardSpec& board, double x) {
    Pose pose = test::look_at_board(board, 0.9, 0.3, 0.5, 0.1);
    pose.translation().x() += x;
    return pose;
  };
  test::DrawnImage image = test::draw_board(kCamera, left, placed(left, -0.24));
  const test::DrawnImage other = test::draw_board(kCamera, right, placed(right, 0.24));
  for (int v = 0; v < image.height; ++v) {
    const auto row = static_cast<std::ptrdiff_t>(v) * image.width;
    std::copy(other.pixels.begin() + row + image.width / 2, other.pixels.begin() + row + image.width,
              image.pixels.begin() + row + image.width / 2);
  }
  return image;
}

}  // namespace

TEST_CASE("targets that a detector could confuse are refused with the remedy", "[targets]") {
  CHECK(why(kCheckers, kCharuco).empty());
  CHECK(why(kCheckers, {6, 9, .02}).find("9x6 points") != std::string::npos);
  CHECK_THAT(why(kCheckers, {9, 6, .05}), Contains("door") && Contains("table") && Contains("other counts"));
  CHECK_THAT(why(kCheckers, {9, 6, .03, T::kCharuco, .022, D::k4x4_50}), Contains("other counts"));
  CHECK(why(kCheckers, {9, 6, .03, T::kCircles, .02}).empty());
  CHECK_FALSE(why({9, 6, .03, T::kCircles, .02}, {9, 6, .05, T::kCircles, .03}).empty());

  // ChArUco 7x5 has 24 markers: 0 to 23.
  CHECK_THAT(why(kCharuco, kGrid), Contains("marker 20 of 4x4_50") && Contains("first_id from 32"));
  BoardSpec apart = kGrid;
  apart.first_id = 24;
  CHECK(why(kCharuco, apart).empty());
  // Another dictionary whose first codes are the same, and one whose codes are its own.
  BoardSpec same_codes = kGrid;
  same_codes.dictionary = D::k4x4_250;
  CHECK_FALSE(why(kCharuco, same_codes).empty());
  same_codes.dictionary = D::k5x5_50;
  CHECK(why(kCharuco, same_codes).empty());
  const BoardSpec pattern{1, 1, .1, T::kPatternMarker, .1};
  CHECK_THAT(why(pattern, pattern), Contains("same picture"));
}

TEST_CASE("names of targets are there and differ", "[targets]") {
  const auto text = [](const std::vector<NamedTarget>& targets) {
    const Status status = check_distinct(targets);
    return status ? std::string() : std::string(status.error().detail());
  };
  CHECK_THAT(text({{"a", kCheckers}, {"a", kCharuco}}), Contains("two targets are named 'a'"));
  CHECK_THAT(text({{"a", kCheckers}, {"", kCharuco}}), Contains("number 2 has no name"));
  CHECK_THAT(text({}), Contains("no target"));
  CHECK(text({{"a", kCheckers}, {"b", kCharuco}}).empty());
}

TEST_CASE("an image gives whichever of the targets it shows", "[targets]") {
  const BoardSpec small{5, 4, .035};
  const std::vector<BoardSpec> boards = {small, kGrid, {6, 5, .03}, {4, 3, .04, T::kCharuco, .03, D::k6x6_250}};
  const auto numbers = [&](const test::DrawnImage& image) {
    std::vector<int> seen;
    const auto sightings = detect_targets(image.view(), boards);
    REQUIRE(sightings);
    for (const TargetSighting& s : *sightings) {
      seen.push_back(s.target);
      CHECK(check_points(boards[static_cast<std::size_t>(s.target)], s.points));
    }
    return seen;
  };
  CHECK(numbers(side_by_side(small, kGrid)) == std::vector<int>{0, 1});
  CHECK(numbers(side_by_side(boards[2], boards[3])) == std::vector<int>{2, 3});
  CHECK(numbers(side_by_side(kGrid, boards[3])) == std::vector<int>{1, 3});
  CHECK(numbers(side_by_side(small, boards[2])) == std::vector<int>{0, 2});
  CHECK(numbers(test::draw_board(kCamera, kGrid, test::look_at_board(kGrid, .6, .3, 0, 0))) == std::vector<int>{1});
  CHECK(detect_targets({nullptr, 8, 8}, boards).error().fault == Fault::kDataMalformed);
}
