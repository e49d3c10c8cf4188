#include "algorithms/mapping/range_image.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <vector>

#include "platform/core/random.hpp"

namespace firstlook {
namespace {

// What lies beside the image has no ray.
float reach_at(const RangeImage& image, int u, int v) {
  const bool inside = u >= 0 && v >= 0 && u < image.width() && v < image.height();
  return inside ? image.at(u, v) : RangeImage::kNoRay;
}

struct Bounds {
  float nearest, farthest;  // nearest: of cells of 2 x 2 pixels as far as their farthest pixel
};
// Cell by cell, pixel by pixel; both ends even.
Bounds plain_bounds(const RangeImage& image, int u_low, int v_low, int u_end, int v_end) {
  Bounds bounds{1e9F, RangeImage::kNoRay};
  for (int v = v_low; v < v_end; v += 2) {
    for (int u = u_low; u < u_end; u += 2) {
      const float cell_m = std::max(
          {reach_at(image, u, v), reach_at(image, u + 1, v), reach_at(image, u, v + 1), reach_at(image, u + 1, v + 1)});
      bounds = {std::min(bounds.nearest, cell_m), std::max(bounds.farthest, cell_m)};
    }
  }
  return bounds;
}

}  // namespace

TEST_CASE("cells and their surroundings have the bounds of their pixels", "[mapping]") {
  Random random(4);
  for (const auto& [width, height] : {std::pair{1, 1}, {7, 5}, {64, 48}, {33, 80}, {200, 3}}) {
    RangeImage image(width, height);
    for (int frame = 0; frame < 2; ++frame) {  // nothing of the first one stays
      for (int v = 0; v < height; ++v) {
        std::vector<float> row(static_cast<std::size_t>(width));
        for (float& reach_m : row)
          reach_m = random.uniform() < 0.02 ? RangeImage::kNoRay : static_cast<float>(random.uniform(0.1, 5));
        image.set_row(v, row);
      }
      image.build_levels();
      for (int level = 1; level <= image.level_max(); ++level) {
        const int size = 1 << level;
        for (int y = 0; y * size < height; ++y) {
          for (int x = 0; x * size < width; ++x) {
            const int u = x * size, v = y * size;
            REQUIRE(image.cell_farthest().at(level, x, y) == plain_bounds(image, u, v, u + size, v + size).farthest);
            const Bounds around = plain_bounds(image, u - size, v - size, u + 2 * size, v + 2 * size);
            REQUIRE(image.around_farthest().at(level, x, y) == around.farthest);
            REQUIRE(image.around_nearest().at(level, x, y) == around.nearest);
          }
        }
      }
      const Bounds all = plain_bounds(image, 0, 0, width, height);
      CHECK(image.farthest() == all.farthest);
    }
  }
}

TEST_CASE("eight cells may be read from any one on", "[mapping]") {
  const RangeImage image(64, 48);
  CHECK(image.cell_farthest().row(0, 47)[63 + 8] == RangeImage::kNoRay);
  CHECK(RangeImage::required_bytes(64, 48) >= 64 * 48 * sizeof(float) * 7 / 4);
}

}  // namespace firstlook
