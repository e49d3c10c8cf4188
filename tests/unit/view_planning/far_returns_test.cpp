#include "algorithms/view_planning/far_returns.hpp"

#include <catch2/catch.hpp>
#include <limits>

using namespace firstlook;

namespace {

const CameraIntrinsics kCamera{.width = 160, .height = 120, .fx = 150, .fy = 150, .cx = 79.5, .cy = 59.5};
const GridGeometry kMap = GridGeometry::covering({-1, -1, 0}, {1, 1, 1}, 0.05);
constexpr double kRange_m = 5;

/// A camera in the middle of the map that looks along x; z of its image is x of base.
const Transform<Base, Depth> kAlongX(Eigen::Quaterniond((Eigen::Matrix3d() << 0, 0, 1, -1, 0, 0, 0, -1, 0).finished()),
                                     Eigen::Vector3d(0, 0, 0.5));

/// A wall at x = 3 whose upper edge the camera sees as row `edge`; nothing returns above it.
std::vector<std::uint16_t> wall_below(int edge) {
  std::vector<std::uint16_t> depth(static_cast<std::size_t>(kCamera.width) * static_cast<std::size_t>(kCamera.height));
  for (std::size_t i = 0; i < depth.size(); ++i) {
    depth[i] = static_cast<int>(i) / kCamera.width >= edge ? std::uint16_t{3000} : std::uint16_t{0};
  }
  return depth;
}
DepthImage image_of(const std::vector<std::uint16_t>& depth) {
  return {{depth.data(), kCamera.width, kCamera.height}, 1000};
}

}  // namespace

TEST_CASE("rays to what was seen beyond the map are known to return, others are not", "[far_returns]") {
  FarReturns far(kMap, kRange_m);
  const Eigen::Vector3d eye(0.2, 0.3, 0.6);
  CHECK_FALSE(far.knows_returns());
  CHECK_FALSE(far.lies_between(eye, {4, 0.3, 0.4}));
  const auto depth = wall_below(40);
  far.learn(image_of(depth), kCamera, kAlongX, {});
  CHECK(far.knows_returns());
  CHECK(far.lies_between(eye, {4, 0.3, 0.4}));          // from another place than the camera's
  CHECK_FALSE(far.lies_between(eye, {2, 0.3, 0.5}));    // ends before the wall
  CHECK_FALSE(far.lies_between(eye, {0.9, 0.3, 0.5}));  // stays in the map
  CHECK_FALSE(far.lies_between(eye, {-4, 0.3, 0.4}));   // nobody looked there
  CHECK_FALSE(far.lies_between(eye, {4, 0.3, 4}));      // over it
}

TEST_CASE("what rays passed without a return is open, from elsewhere too, but not beside it", "[far_returns]") {
  FarReturns far(kMap, kRange_m);
  const auto depth = wall_below(40);
  CHECK_FALSE(far.is_open({0, 0, 0.5}, {4, 0, 2.0}));
  far.learn(image_of(depth), kCamera, kAlongX, {});
  CHECK(far.knows_openings());
  CHECK(far.is_open({0, 0, 0.5}, {4, 0, 1.6}));
  CHECK(far.is_open({0.1, 0.1, 0.6}, {4, 0.1, 1.6}));
  CHECK_FALSE(far.is_open({0, 0, 0.5}, {4, 0, 0.5}));    // the wall
  CHECK_FALSE(far.is_open({0, 0, 0.5}, {0, 0, 4}));      // not looked at
  CHECK_FALSE(far.is_open({0, 0, 0.5}, {0.5, 0, 0.5}));  // stays in the map
}

TEST_CASE("the arm's own body and single holes open nothing", "[far_returns]") {
  const auto depth = wall_below(kCamera.height);  // nothing returns
  std::vector<float> body(depth.size(), 0.3F);
  FarReturns hidden(kMap, kRange_m);
  hidden.learn(image_of(depth), kCamera, kAlongX, body);
  CHECK_FALSE(hidden.knows_openings());
  body.assign(body.size(), std::numeric_limits<float>::infinity());
  hidden.learn(image_of(depth), kCamera, kAlongX, body);
  CHECK(hidden.knows_openings());

  auto specks = wall_below(0);
  for (std::size_t i = 0; i < specks.size(); i += 7) specks[i] = 0;
  FarReturns far(kMap, kRange_m);
  far.learn(image_of(specks), kCamera, kAlongX, {});
  CHECK(far.knows_returns());
  CHECK_FALSE(far.knows_openings());
}
