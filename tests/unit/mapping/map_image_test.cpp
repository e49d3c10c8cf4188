#include "algorithms/mapping/map_image.hpp"

#include <array>
#include <catch2/catch.hpp>
#include <vector>

namespace firstlook {
namespace {

struct Picture {
  std::vector<std::uint8_t> bytes;
  RgbImage image;
  Picture(int width, int height)
      : bytes(static_cast<std::size_t>(3 * width * height), 7), image{bytes.data(), width, height} {}
  [[nodiscard]] std::array<int, 3> at(int column, int row) const {
    const auto i = static_cast<std::size_t>(3 * (row * image.width + column));
    return {bytes[i], bytes[i + 1], bytes[i + 2]};
  }
};

int sum(const std::array<int, 3>& c) { return c[0] + c[1] + c[2]; }

}  // namespace

TEST_CASE("a slice shows its layer from above", "[mapping][image]") {
  VoxelMap map(GridGeometry{0.1, {0, 0, 0}, {4, 4, 2}});
  for (std::size_t i = 0; i < map.size(); ++i) map.set(i, VoxelClass::kFree, 0);
  map.set(map.geometry().index({3, 3, 1}), VoxelClass::kOccupied, 0);
  map.set(map.geometry().index({0, 0, 1}), VoxelClass::kUnknown, 0);
  Picture picture(40, 40);
  draw_slice(map, 0.15, picture.image);
  const int free = sum(picture.at(20, 20)), occupied = sum(picture.at(35, 5)), unknown = sum(picture.at(5, 35));
  CHECK(occupied < unknown);
  CHECK(unknown < free);
  draw_slice(map, 0.05, picture.image);
  CHECK(sum(picture.at(35, 5)) == free);
  draw_slice(map, 9.0, picture.image);
  CHECK(sum(picture.at(20, 20)) == unknown);
}

TEST_CASE("the map's picture shows boxes, veil and views", "[mapping][image]") {
  VoxelMap map(GridGeometry{0.1, {-10, -10, 0}, {20, 20, 10}});
  for (std::size_t i = 0; i < map.size(); ++i) map.set(i, VoxelClass::kFree, 0);
  Viewpoint viewpoint;
  viewpoint.target_m = {0, 0, 0.5};
  Picture empty(60, 48), box(60, 48), veiled(60, 48), views(60, 48);
  draw_map(map, viewpoint, {}, {}, empty.image);
  CHECK(empty.at(30, 24) == empty.at(0, 0));
  map.set(map.geometry().index({10, 10, 5}), VoxelClass::kOccupied, 0);
  draw_map(map, viewpoint, {}, {}, box.image);
  CHECK(box.bytes != empty.bytes);
  CHECK(box.at(0, 0) == empty.at(0, 0));
  for (int i = 0; i < 200; ++i) map.set(static_cast<std::size_t>(1800 + i), VoxelClass::kUnknown, 0);
  draw_map(map, viewpoint, std::vector<std::uint8_t>(map.size(), 1), {}, veiled.image);
  CHECK(veiled.bytes != box.bytes);
  const std::vector<Eigen::Vector3d> path = {{0, 0, 0.5}, {0.3, 0.3, 0.6}};
  draw_map(map, viewpoint, {}, path, views.image);
  CHECK(views.at(30, 24)[0] > 200);  // the first view stands on the target, in red
  CHECK(views.at(30, 24)[1] < 60);
}

}  // namespace firstlook
