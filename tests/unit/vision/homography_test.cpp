#include "algorithms/vision/homography.hpp"

#include <array>
#include <catch2/catch.hpp>

#include "platform/core/random.hpp"

namespace firstlook {

TEST_CASE("a square's map to four corners is the one that least squares find", "[vision]") {
  Random random(1);
  for (int trial = 0; trial < 1000; ++trial) {
    const double side = random.uniform(0.01, 20), x = random.uniform(0, 1900), y = random.uniform(0, 1100);
    const double size = random.uniform(4, 400), bend = 0.3 * size;
    std::array<Eigen::Vector2d, 4> quad = {{{x, y}, {x + size, y}, {x + size, y + size}, {x, y + size}}};
    for (auto& corner : quad) corner += Eigen::Vector2d(random.uniform(-bend, bend), random.uniform(-bend, bend));
    const std::array<Eigen::Vector2d, 4> square = {{{0, 0}, {side, 0}, {side, side}, {0, side}}};
    const auto exact = square_to_quad(side, quad), fitted = fit_homography(square, quad);
    REQUIRE(exact);
    REQUIRE(fitted);
    for (int i = 0; i < 20; ++i) {
      const Eigen::Vector2d at(random.uniform(0, side), random.uniform(0, side));
      REQUIRE((apply_homography(*exact, at) - apply_homography(*fitted, at)).norm() < 1e-6);
    }
    for (std::size_t i = 0; i < 4; ++i) REQUIRE((apply_homography(*exact, square[i]) - quad[i]).norm() < 1e-9);
  }
}

TEST_CASE("three corners on a line, or in one place, have no map", "[vision]") {
  using Quad = std::array<Eigen::Vector2d, 4>;
  for (const Quad& quad : {Quad{{{0, 0}, {1, 0}, {2, 0}, {0, 1}}}, Quad{{{0, 0}, {0, 0}, {1, 1}, {0, 1}}},
                           Quad{{{0, 0}, {1, 0}, {1, 1}, {2, 2}}}, Quad{{{5, 5}, {5, 5}, {5, 5}, {5, 5}}},
                           Quad{{{0, 0}, {1, 0}, {std::numeric_limits<double>::quiet_NaN(), 1}, {0, 1}}}}) {
    CHECK_FALSE(square_to_quad(1, quad));
  }
}

}  // namespace firstlook
