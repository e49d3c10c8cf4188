#include "algorithms/mapping/map_image.hpp"

#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <utility>
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
  map.set(map.geometry().index({1, 0, 1}), VoxelClass::kUnknown, 0);
  std::vector<std::uint8_t> zone(map.size(), 1);
  zone[map.geometry().index({1, 0, 1})] = 0;
  const SliceWindow whole = SliceWindow::of(map.geometry());
  Picture picture(40, 40);
  draw_slice(map, 0.15, whole, zone, picture.image);
  const int free = sum(picture.at(20, 20)), occupied = sum(picture.at(35, 5)), unknown = sum(picture.at(5, 35));
  const int out_of_reach = sum(picture.at(15, 35));
  CHECK(occupied < unknown);
  CHECK(unknown < out_of_reach);
  CHECK(out_of_reach < free);
  draw_slice(map, 0.05, whole, {}, picture.image);
  CHECK(sum(picture.at(35, 5)) == free);
  draw_slice(map, 9.0, whole, {}, picture.image);
  CHECK(sum(picture.at(20, 20)) == out_of_reach);
}

TEST_CASE("a slice's window says where points are in the picture", "[mapping][image]") {
  VoxelMap map(GridGeometry{0.1, {0, 0, 0}, {10, 10, 2}});
  for (std::size_t i = 0; i < map.size(); ++i) map.set(i, VoxelClass::kFree, 0);
  map.set(map.geometry().index({7, 2, 0}), VoxelClass::kOccupied, 0);
  const SliceWindow window{{0.6, 0.1}, {0.9, 0.4}};
  Picture picture(30, 30);
  draw_slice(map, 0.05, window, {}, picture.image);
  const Eigen::Vector2d at = window.pixel({0.75, 0.25}, 30, 30);
  CHECK(at.isApprox(Eigen::Vector2d(14.5, 14.5)));
  for (int row = 0; row < 30; ++row) {
    for (int column = 0; column < 30; ++column) {
      const bool inside = column >= 10 && column < 20 && row >= 10 && row < 20;
      CHECK((sum(picture.at(column, row)) < 300) == inside);
    }
  }
}

TEST_CASE("a picture of the whole grid crops nothing, from any side", "[mapping][image]") {
  const GridGeometry g = GridGeometry::covering({-1.5, -1.2, -0.3}, {1.5, 2.4, 1.5}, 0.1);
  const Eigen::Vector3d low = g.first.cast<double>() * g.resolution_m;
  const Eigen::Vector3d high = (g.first + g.size).cast<double>() * g.resolution_m;
  for (double azimuth = -3.1; azimuth < 3.2; azimuth += 0.37) {
    for (const double elevation : {0.0, 0.4, 0.6, 1.2, 1.5707963}) {
      for (const auto& [width, height] : {std::pair{300, 200}, {200, 300}}) {
        const auto viewpoint = Viewpoint::seeing(low, high, azimuth, elevation, width, height, 20);
        const MapProjection projection(viewpoint, width, height);
        double least_px = 1e9;
        for (int corner = 0; corner < 8; ++corner) {
          const Eigen::Vector3d p(corner & 1 ? low.x() : high.x(), corner & 2 ? low.y() : high.y(),
                                  corner & 4 ? low.z() : high.z());
          const Eigen::Vector2d at = projection.pixel(p) + Eigen::Vector2d(0.5, 0.5);
          least_px = std::min({least_px, at.x(), at.y(), width - at.x(), height - at.y()});
        }
        CHECK(least_px == Approx(20).margin(1e-6));  // no room is lost, either
      }
    }
  }
}

TEST_CASE("pixels and points of a picture agree", "[mapping][image]") {
  const auto viewpoint = Viewpoint::seeing({-1, -1, 0}, {1, 1, 1}, 0.9, 0.6, 80, 60, 4);
  const MapProjection projection(viewpoint, 80, 60);
  for (const auto& [column, row] : {std::pair{0, 0}, {79, 59}, {13, 40}}) {
    const Eigen::Vector3d point = projection.through(column, row) + 0.7 * projection.into();
    CHECK((projection.pixel(point) - Eigen::Vector2d(column, row)).norm() < 1e-9);
  }
}

TEST_CASE("the map's picture shows boxes, veil and a floor with lines", "[mapping][image]") {
  const Eigen::Vector3d low(-1, -1, 0), high(1, 1, 1);
  VoxelMap map(GridGeometry::covering(low, high, 0.1));
  for (std::size_t i = 0; i < map.size(); ++i) map.set(i, VoxelClass::kFree, 0);
  const auto viewpoint = Viewpoint::seeing(low, high, -2.2, 0.6, 240, 192, 8);
  const MapProjection projection(viewpoint, 240, 192);
  const auto at = [&](const Picture& picture, const Eigen::Vector3d& point) {
    const Eigen::Vector2d p = projection.pixel(point);
    return picture.at(static_cast<int>(std::lround(p.x())), static_cast<int>(std::lround(p.y())));
  };
  Picture empty(240, 192), box(240, 192), veiled(240, 192);
  draw_map(map, viewpoint, {}, empty.image);
  CHECK(sum(at(empty, {0.5, 0.2, 0})) < sum(at(empty, {0.25, 0.2, 0})));  // a line at every half metre
  CHECK(sum(at(empty, {0.25, 0.2, 0})) < sum(empty.at(0, 0)));
  map.set(map.geometry().index({10, 10, 5}), VoxelClass::kOccupied, 0);
  draw_map(map, viewpoint, {}, box.image);
  CHECK(at(box, {0.05, 0.05, 0.55}) != at(empty, {0.05, 0.05, 0.55}));
  CHECK(box.at(0, 0) == empty.at(0, 0));
  for (int i = 0; i < 400; ++i) map.set(static_cast<std::size_t>(1800 + i), VoxelClass::kUnknown, 0);
  draw_map(map, viewpoint, std::vector<std::uint8_t>(map.size(), 1), veiled.image);
  CHECK(veiled.bytes != box.bytes);
  draw_map(map, viewpoint, std::vector<std::uint8_t>(map.size(), 0), veiled.image);
  CHECK(veiled.bytes == box.bytes);  // out of reach: no veil
}

TEST_CASE("voxels take the colours that they are given, or are looked through", "[mapping][image]") {
  const Eigen::Vector3d low(-1, -1, 0), high(1, 1, 1);
  VoxelMap map(GridGeometry::covering(low, high, 0.1));
  for (std::size_t i = 0; i < map.size(); ++i) map.set(i, VoxelClass::kFree, 0);
  const auto viewpoint = Viewpoint::seeing(low, high, -2.2, 0.6, 240, 192, 8);
  Picture empty(240, 192), hidden(240, 192), red(240, 192);
  draw_map(map, viewpoint, {}, empty.image);
  const std::size_t box = map.geometry().index({10, 10, 5});
  map.set(box, VoxelClass::kOccupied, 0);
  using Color = std::optional<std::array<std::uint8_t, 3>>;
  draw_map(map, viewpoint, {}, [](std::size_t) { return Color(); }, hidden.image);
  CHECK(hidden.bytes == empty.bytes);
  const auto paint = [box](std::size_t index) { return index == box ? Color({200, 0, 0}) : Color({0, 200, 0}); };
  draw_map(map, viewpoint, {}, paint, red.image);
  const Eigen::Vector2d top = MapProjection(viewpoint, 240, 192).pixel({0.05, 0.05, 0.6});
  const auto color = red.at(static_cast<int>(std::lround(top.x())), static_cast<int>(std::lround(top.y())));
  CHECK(color[0] > 100);
  CHECK(color[1] == 0);
  CHECK(color[2] == 0);
}

}  // namespace firstlook
