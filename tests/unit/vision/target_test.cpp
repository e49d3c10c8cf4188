#include "algorithms/vision/target.hpp"

#include <bit>
#include <catch2/catch.hpp>
#include <set>

#include "algorithms/vision/target_names.hpp"
#include "algorithms/vision/target_pattern.hpp"
#include "platform/core/random.hpp"

using namespace firstlook;

namespace {

std::vector<BoardSpec> one_of_each() {
  std::vector<BoardSpec> boards;
  for (const std::string_view type : target_type_names()) {
    TargetWords words{std::string(type), 5, 4, 0.04};
    boards.push_back(target_from_words(words).value());
  }
  boards.push_back({5, 4, 0.04, TargetType::kCharuco, 0.03, MarkerDictionary::k5x5_50, 3});
  boards.push_back({4, 5, 0.04, TargetType::kCharuco, 0.03, MarkerDictionary::k5x5_50, 3, true});
  boards.push_back({5, 5, 0.04, TargetType::kCharuco, 0.03, MarkerDictionary::k5x5_50, 3, true});
  return boards;
}

}  // namespace

TEST_CASE("every target's ink is where its shapes are", "[vision][target]") {
  Random random(1);
  for (const BoardSpec& board : one_of_each()) {
    CAPTURE(describe(board));
    const auto shapes = ink_shapes(board);
    const InkExtent extent = ink_extent(board);
    for (int trial = 0; trial < 4000; ++trial) {
      const Eigen::Vector2d at = extent.center_m + 0.6 * Eigen::Vector2d(random.uniform(-1, 1) * extent.size_m.x(),
                                                                         random.uniform(-1, 1) * extent.size_m.y());
      const bool inked = std::any_of(shapes.begin(), shapes.end(), [&](const InkShape& s) {
        if (s.kind == InkShape::Kind::kRectangle)
          return (at - s.low_m).minCoeff() >= 0 && (s.high_m - at).minCoeff() > 0;
        return (at - (s.low_m + s.high_m) / 2).norm() < (s.high_m - s.low_m).x() / 2;
      });
      REQUIRE(is_dark(board, at.x(), at.y()) == inked);
      if (inked) REQUIRE(((at - extent.center_m).cwiseAbs() - extent.size_m / 2).maxCoeff() < 1e-12);
    }
  }
}

TEST_CASE("points of a target", "[vision][target]") {
  for (const BoardSpec& board : one_of_each()) {
    CAPTURE(describe(board));
    Eigen::Vector3d sum = Eigen::Vector3d::Zero(), low = board.corner(0), high = low;
    for (int i = 0; i < board.corners(); ++i) {
      sum += board.corner(i);
      low = low.cwiseMin(board.corner(i)), high = high.cwiseMax(board.corner(i));
    }
    CHECK(((low + high) / 2 - board.center()).norm() < 1e-12);
    std::set<int> outer;
    for (const int corner : board.outer_corners()) {
      REQUIRE(corner < board.corners());
      outer.insert(corner);
      for (const int beside : board.neighbours_of_outer(corner)) {
        REQUIRE(beside < board.corners());
        CHECK((board.corner(beside) - board.corner(corner)).norm() < 2.3 * board.square_size_m);
        CHECK((board.corner(beside) - board.corner(corner)).norm() > 0);
      }
    }
    CHECK(outer.size() == 4);
    // A turn by 180 degrees maps the ink of just the ambiguous targets onto itself.
    Random random(2);
    const InkExtent ink = ink_extent(board);
    bool same = true;
    for (int trial = 0; trial < 2000; ++trial) {
      const Eigen::Vector2d d(random.uniform(-.5, .5) * ink.size_m.x(), random.uniform(-.5, .5) * ink.size_m.y());
      const Eigen::Vector2d a = ink.center_m + d, b = ink.center_m - d;
      same = same && is_dark(board, a.x(), a.y()) == is_dark(board, b.x(), b.y());
    }
    CHECK(same != board.is_orientation_unique());
  }
}

TEST_CASE("words and targets go back and forth", "[vision][target]") {
  for (const BoardSpec& board : one_of_each()) {
    const auto again = target_from_words(words_of(board));
    CAPTURE(describe(board));
    REQUIRE(again);
    CHECK(*again == board);
  }
  CHECK(target_from_words({"charuco", 9, 6, 0.03, 0.04}).error().fault == Fault::kConfigBadValue);
  CHECK(target_from_words({"aruco", 9, 6, 0.03, 0, "4x4_50"}).error().fault == Fault::kConfigBadValue);  // 54 markers
  CHECK(target_from_words({"apriltag", 3, 3, 0.03, 0, "4x4_50"}).error().fault == Fault::kConfigBadValue);
  CHECK(target_from_words({"circles", 6, 6, 0.03}).error().fault == Fault::kConfigBadValue);
  CHECK(target_from_words({"cheese", 6, 6, 0.03}).error().fault == Fault::kConfigBadValue);
  CHECK(target_from_words({"checkerboard", 25, 18, 0.02}));
}

TEST_CASE("codes turn in four steps and differ from each other", "[vision][target]") {
  for (const MarkerDictionary d : {MarkerDictionary::k4x4_50, MarkerDictionary::kAprilTag36h11}) {
    const int bits = marker_family(d).bits;
    for (int id = 0; id < 20; ++id) {
      const std::uint64_t code = marker_code(d, id);
      std::uint64_t turned = code;
      for (int t = 0; t < 3; ++t) {
        turned = turned_code(turned, bits);
        CHECK(turned != code);
      }
      CHECK(turned_code(turned, bits) == code);
    }
  }
  // The upper left cell of 2x2 goes to the upper right.
  CHECK(turned_code(0b1000, 2) == 0b0100);
}

TEST_CASE("ARToolKitPlus's code keeps its markers nine cells apart", "[vision][target]") {
  // Its distance is that of the linear code: the least weight of a difference from marker 0.
  const std::uint64_t zero = marker_code(MarkerDictionary::kArtoolkitPlusBch, 0);
  CHECK(zero == 0x8f80b8750);  // the mask: the code word of 0 is 0
  int least = 36;
  for (int id = 1; id < 4096; ++id) {
    const std::uint64_t word = marker_code(MarkerDictionary::kArtoolkitPlusBch, id) ^ zero;
    least = std::min(least, std::popcount(word));
    REQUIRE((word >> 24) == static_cast<std::uint64_t>(id));
  }
  CHECK(least >= 9);
}

TEST_CASE("partial frames are averaged point by point", "[vision][target]") {
  const CornerSet a{{{1, 1}, {2, 2}, {3, 3}}, 0.1, {0, 4, 5}}, b{{{1.2, 1}, {3.2, 3}}, 0.1, {0, 5}};
  const auto mean = average_corners(std::vector{a, b, b});
  REQUIRE(mean);
  CHECK(mean->ids == std::vector{0, 5});
  CHECK(mean->corners_px[1].isApprox(Eigen::Vector2d(9.4 / 3, 3)));
  const CornerSet whole{{{1, 1}}, 0.1};
  CHECK_FALSE(average_corners(std::vector{a, whole}));
}
