#include "algorithms/vision/gray_sampling.hpp"

#include <catch2/catch.hpp>
#include <vector>

#include "platform/core/processor.hpp"
#include "platform/core/random.hpp"

using namespace firstlook;

TEST_CASE("grey values of many points are those of one at a time, to the last bit", "[vision]") {
  constexpr int kWidth = 37, kHeight = 23;
  Random random(1);
  std::vector<std::uint8_t> pixels(kWidth * kHeight);
  for (auto& pixel : pixels) pixel = static_cast<std::uint8_t>(random.below(256));
  const GrayImage image{pixels.data(), kWidth, kHeight};
  std::vector<double> u{0, kWidth - 1, 0, kWidth - 1, kWidth - 2, -7}, v{0, 0, kHeight - 1, kHeight - 1, 5, 50};
  while (u.size() < 1001) {
    u.push_back(random.uniform(-3, kWidth + 3));
    v.push_back(random.uniform(-3, kHeight + 3));
  }
  std::vector<double> grays(u.size());
  const auto compare = [&] {
    grays_between(image, u, v, grays);
    for (std::size_t k = 0; k < u.size(); ++k) REQUIRE(grays[k] == gray_between(image, {u[k], v[k]}));
  };
  compare();
  const PortableOnly without_avx2;
  compare();
  CHECK(grays[0] == image.at(0, 0));
  CHECK(grays[3] == image.at(kWidth - 1, kHeight - 1));
  CHECK(grays[5] == image.at(0, kHeight - 1));  // outside
}
