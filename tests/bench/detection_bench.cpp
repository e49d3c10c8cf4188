/// Time to find a target in an image, and to see that there is none, beside OpenCV's detectors.
#include <fmt/format.h>

#include <functional>
#include <numbers>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>

#include "algorithms/vision/target_detection.hpp"
#include "algorithms/vision/target_names.hpp"
#include "tests/bench/bench.hpp"
#include "tests/unit/vision/draw_board.hpp"
#ifdef BENCH_HAS_ARUCO
#include <opencv2/aruco.hpp>
#endif

namespace firstlook::bench {
namespace {

constexpr double kThereMax_ms = 15, kAbsentMax_ms = 60;

struct Size {
  int width = 0, height = 0;
};
constexpr std::array<Size, 3> kSizes = {{{640, 480}, {1280, 1024}, {1920, 1200}}};

/// The thesis's colour camera with more pixels.
CameraIntrinsics camera_of(const Size& size) {
  const double f = 534.78 * size.width / 640;
  return {size.width, size.height, f,      f, 0.5 * size.width - 10, 0.5 * size.height - 7, .04586,
          -.1301,     .0025,       -.0006, 0};
}

test::DrawnImage plain(const Size& size) {
  return {std::vector<std::uint8_t>(static_cast<std::size_t>(size.width * size.height), 140), size.width, size.height};
}

/// Boxes over each other, with their many corners.
test::DrawnImage clutter(const Size& size) {
  test::DrawnImage image = plain(size);
  Random random(4);
  for (int box = 0; box < 3000; ++box) {
    const int u0 = random.below(size.width), v0 = random.below(size.height);
    const int u1 = std::min(size.width, u0 + 4 + random.below(30)),
              v1 = std::min(size.height, v0 + 4 + random.below(30));
    const auto gray = static_cast<std::uint8_t>(random.below(256));
    for (int v = v0; v < v1; ++v) {
      std::fill(image.pixels.begin() + v * size.width + u0, image.pixels.begin() + v * size.width + u1, gray);
    }
  }
  return image;
}

test::DrawnImage noise(const Size& size) {
  test::DrawnImage image = plain(size);
  Random random(5);
  for (auto& pixel : image.pixels) pixel = static_cast<std::uint8_t>(random.below(256));
  return image;
}

/// A tiled floor: squares from edge to edge.
test::DrawnImage tiles(const Size& size) {
  test::DrawnImage image = plain(size);
  Random random(6);
  for (int v = 0; v < size.height; ++v) {
    for (int u = 0; u < size.width; ++u) {
      const double gray = ((u / 12 + v / 12) % 2 == 0 ? 200 : 40) + 4 * random.normal();
      image.pixels[static_cast<std::size_t>(v) * static_cast<std::size_t>(size.width) + static_cast<std::size_t>(u)] =
          static_cast<std::uint8_t>(std::clamp(std::lround(gray), 0L, 255L));
    }
  }
  return image;
}

/// A fine texture: noise whose grains are some pixels large.
test::DrawnImage texture(const Size& size) {
  test::DrawnImage image = plain(size);
  Random random(7);
  std::vector<double> grey(image.pixels.size());
  for (double& g : grey) g = random.normal();
  constexpr double kGrain_px = 1, kDepth = 60;
  test::blur(grey, size.width, size.height, kGrain_px);
  // Blurred noise of 1 has a sigma of 1 / (2 sqrt(pi) grain).
  const double scale = kDepth * 2 * std::sqrt(std::numbers::pi) * kGrain_px;
  for (std::size_t i = 0; i < grey.size(); ++i) {
    image.pixels[i] = static_cast<std::uint8_t>(std::clamp(std::lround(128 + scale * grey[i]), 0L, 255L));
  }
  return image;
}

/// A perforated plate: small discs from edge to edge.
test::DrawnImage holes(const Size& size) {
  test::DrawnImage image = plain(size);
  Random random(8);
  constexpr int kPitch_px = 10;
  for (int v = 0; v < size.height; ++v) {
    for (int u = 0; u < size.width; ++u) {
      const double x = u % kPitch_px - kPitch_px / 2.0, y = v % kPitch_px - kPitch_px / 2.0;
      const double gray = (std::hypot(x, y) < 0.35 * kPitch_px ? 40 : 210) + 3 * random.normal();
      image.pixels[static_cast<std::size_t>(v) * static_cast<std::size_t>(size.width) + static_cast<std::size_t>(u)] =
          static_cast<std::uint8_t>(std::clamp(std::lround(gray), 0L, 255L));
    }
  }
  return image;
}

struct Peer {
  std::string title;
  std::function<void(const cv::Mat&)> find;  ///< empty: not installed
};

/// Of tiles and holes in large images findCirclesGrid makes minutes (8 s of tiles in 640x480): it is not asked.
bool is_asked(const BoardSpec& board, const std::string& name) {
  return board.type != TargetType::kCircles || !(name.ends_with("tiles") || name.ends_with("holes"));
}

std::vector<Peer> peers_of(const BoardSpec& board) {
  const cv::Size count(board.inner_columns, board.inner_rows);
  if (board.type == TargetType::kCheckerboard) {
    return {{"cv::findChessboardCorners",
             [count](const cv::Mat& image) {
               std::vector<cv::Point2f> corners;
               cv::findChessboardCorners(
                   image, count, corners,
                   cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_FAST_CHECK);
             }},
            {"cv::findChessboardCornersSB", [count](const cv::Mat& image) {
               std::vector<cv::Point2f> corners;
               cv::findChessboardCornersSB(image, count, corners);
             }}};
  }
  if (board.type == TargetType::kCircles) {
    return {{"cv::findCirclesGrid", [count](const cv::Mat& image) {
               std::vector<cv::Point2f> centers;
               cv::findCirclesGrid(image, count, centers);
             }}};
  }
#ifdef BENCH_HAS_ARUCO
  if (board.markers() > 0 && board.dictionary < MarkerDictionary::kArtoolkitPlusBch) {
    // OpenCV numbers its predefined dictionaries in the order of our enumeration.
    const auto dictionary = cv::aruco::getPredefinedDictionary(static_cast<int>(board.dictionary));
    return {{"cv::aruco::detectMarkers", [dictionary](const cv::Mat& image) {
               std::vector<std::vector<cv::Point2f>> corners;
               std::vector<int> ids;
               const auto how = cv::aruco::DetectorParameters::create();
               how->cornerRefinementMethod = cv::aruco::CORNER_REFINE_SUBPIX;
               cv::aruco::detectMarkers(image, dictionary, corners, ids, how);
             }}};
  }
#endif
  return {{"", {}}};
}

/// One row for each peer.
void add_rows(const std::string& name, const test::DrawnImage& image, const BoardSpec& board, bool there,
              const Options& options, Report& report) {
  const cv::Mat mat(image.height, image.width, CV_8UC1, const_cast<std::uint8_t*>(image.pixels.data()));
  const bool found = detect_target(image.view(), board).has_value();
  const Goal goal = Goal::ours_at_most(there ? kThereMax_ms : kAbsentMax_ms);
  for (const Peer& peer : peers_of(board)) {
    // The peers may take seconds where nothing is to be found.
    const int rounds = options.amount(1, 3, 9);
    const bool asked = peer.find && is_asked(board, name);
    bool again = false;
    const auto seconds = medians_taking_turns(
        rounds, [&] { again = detect_target(image.view(), board).has_value(); },
        [&] {
          if (asked) peer.find(mat);
        });
    const auto theirs = asked ? std::optional(1e3 * seconds[1]) : std::nullopt;
    Row row = timed(name, 1e3 * seconds[0], "ms", asked ? peer.title : "", theirs, goal);
    if (found != there || again != there)
      row.void_because = there ? "the board was not found" : "a board was found that is not there";
    report.add(row);
  }
}

}  // namespace

void bench_detection(const Options& options, Report& report) {
  cv::setNumThreads(1);
  const std::vector<TargetWords> targets = {{"checkerboard", 9, 6, 0.03},  {"checkerboard", 25, 18, 0.012},
                                            {"circles", 9, 6, 0.03},       {"charuco", 9, 6, 0.03},
                                            {"charuco", 24, 17, 0.0125},   {"apriltag", 5, 4, 0.05},
                                            {"artoolkitplus", 4, 3, 0.06}, {"artoolkit", 1, 1, 0.15}};
  for (const Size& size : kSizes) {
    if (options.smoke && size.width > 640) continue;
    const std::array<std::pair<const char*, test::DrawnImage>, 5> empty = {{{"clutter", clutter(size)},
                                                                            {"noise", noise(size)},
                                                                            {"texture", texture(size)},
                                                                            {"tiles", tiles(size)},
                                                                            {"holes", holes(size)}}};
    for (const TargetWords& words : targets) {
      const BoardSpec board = target_from_words(words).value();
      const std::string name = fmt::format("detection/{}_{}x{}/{}x{}", words.type, board.inner_columns,
                                           board.inner_rows, size.width, size.height);
      test::DrawOptions how;
      how.blur_px = 0.6;
      const auto image = draw_board(camera_of(size), board, test::look_at_board(board, 0.5, 0.4, 1, 0.5), how);
      add_rows(name, image, board, true, options, report);
      for (const auto& [what, scene] : empty) {
        add_rows(fmt::format("{}/absent_{}", name, what), scene, board, false, options, report);
      }
    }
  }
}

}  // namespace firstlook::bench
