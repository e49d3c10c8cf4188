/// Our markers and boards against OpenCV's aruco module, which the program itself does not link: with it and what it
/// pulls in, 160 MB more would be locked in memory.
#include <catch2/catch.hpp>
#include <opencv2/aruco/charuco.hpp>
#include <opencv2/core.hpp>

#include "algorithms/vision/square_markers.hpp"
#include "algorithms/vision/target_detection.hpp"
#include "tests/unit/vision/draw_board.hpp"

using namespace firstlook;
using test::draw_board;
using test::look_at_board;

namespace {

constexpr CameraIntrinsics kCamera{640, 480, 534.78, 534.10, 308.63, 226.92, .04586, -.1301, .0025, -.0006, 0};

cv::Mat as_mat(const test::DrawnImage& image) {
  return {image.height, image.width, CV_8UC1, const_cast<std::uint8_t*>(image.pixels.data())};
}

}  // namespace

TEST_CASE("every marker of every dictionary has OpenCV's cells", "[oracle][aruco]") {
  // OpenCV numbers its predefined dictionaries in the order of our enumeration.
  for (int d = 0; d < static_cast<int>(MarkerDictionary::kArtoolkitPlusBch); ++d) {
    const auto ours = static_cast<MarkerDictionary>(d);
    const auto theirs = cv::aruco::getPredefinedDictionary(d);
    const MarkerFamily& family = marker_family(ours);
    CAPTURE(family.name);
    REQUIRE(theirs->markerSize == family.bits);
    REQUIRE(theirs->bytesList.rows == family.count);
    for (int id = 0; id < family.count; ++id) {
      const cv::Mat bits =
          cv::aruco::Dictionary::getBitsFromByteList(theirs->bytesList.rowRange(id, id + 1), family.bits);
      std::uint64_t code = 0;
      for (const std::uint8_t bit : cv::Mat_<std::uint8_t>(bits)) code = code << 1U | bit;
      REQUIRE(marker_code(ours, id) == code);
    }
  }
}

TEST_CASE("OpenCV finds our markers with the same numbers and corners", "[oracle][aruco]") {
  const BoardSpec board{4, 3, .06, TargetType::kMarkerGrid, .045, MarkerDictionary::kAprilTag36h11, 7};
  const auto image = draw_board(kCamera, board, look_at_board(board, 0.5, 0.3, 1, 2));
  const auto ours = find_square_markers(image.view(), board);
  REQUIRE(ours);
  REQUIRE(ours->size() == 12);
  std::vector<std::vector<cv::Point2f>> corners;
  std::vector<int> ids;
  const cv::Ptr<cv::aruco::Dictionary> dictionary = cv::aruco::getPredefinedDictionary(cv::aruco::DICT_APRILTAG_36h11);
  cv::aruco::detectMarkers(as_mat(image), dictionary, corners, ids);
  REQUIRE(ids.size() == 12);
  for (std::size_t m = 0; m < ids.size(); ++m) {
    const SquareMarker& same = (*ours)[static_cast<std::size_t>(ids[m] - board.first_id)];
    for (std::size_t k = 0; k < 4; ++k) {
      CHECK((Eigen::Vector2d(corners[m][k].x, corners[m][k].y) - same.corners_px[k]).norm() < 1.5);
    }
  }
}

TEST_CASE("our ChArUco boards are OpenCV's, without its half pixel", "[oracle][aruco]") {
  for (const int inner_rows : {4, 5}) {
    const BoardSpec board{6, inner_rows, .04, TargetType::kCharuco, .03, MarkerDictionary::k5x5_100};
    const int columns = board.inner_columns + 1, rows = board.inner_rows + 1;
    const Pose pose = look_at_board(board, 0.45, 0.2, 1, 0.3);
    const auto image = draw_board(kCamera, board, pose);
    const cv::Ptr<cv::aruco::Dictionary> dictionary = cv::aruco::getPredefinedDictionary(cv::aruco::DICT_5X5_100);
    const auto theirs = cv::aruco::CharucoBoard::create(columns, rows, .04F, .03F, dictionary);
    std::vector<std::vector<cv::Point2f>> corners;
    std::vector<int> ids;
    cv::aruco::detectMarkers(as_mat(image), dictionary, corners, ids);
    REQUIRE(static_cast<int>(ids.size()) == board.markers());
    std::vector<cv::Point2f> charuco;
    std::vector<int> charuco_ids;
    cv::aruco::interpolateCornersCharuco(corners, ids, as_mat(image), theirs, charuco, charuco_ids);
    const auto ours = detect_target(image.view(), board);
    REQUIRE(ours);
    REQUIRE(ours->ids.empty());
    REQUIRE(static_cast<int>(charuco_ids.size()) == board.corners());
    Eigen::Vector2d our_bias = Eigen::Vector2d::Zero(), their_bias = our_bias;
    for (std::size_t i = 0; i < charuco.size(); ++i) {
      const int id = charuco_ids[i];
      const Eigen::Vector2d truth = *project(kCamera, pose * board.corner(id));
      our_bias += (ours->corners_px[static_cast<std::size_t>(id)] - truth) / board.corners();
      their_bias += (Eigen::Vector2d(charuco[i].x, charuco[i].y) - truth) / board.corners();
    }
    CHECK(our_bias.norm() < 0.03);
    CAPTURE(inner_rows);
    CHECK(their_bias.norm() < 1.5);  // the same corners
    CHECK(their_bias.norm() > 0.3);  // opencv#25539
  }
}
