#include "hal/sim/random_cell.hpp"

#include <algorithm>
#include <catch2/catch.hpp>

#include "hal/sim/cell_file.hpp"

using namespace firstlook;
using namespace firstlook::sim;

TEST_CASE("random cells keep the safe zone clear, the start free and the board in view") {
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    INFO("random:" << seed);
    const Result<Scene> scene = make_random_cell(seed, 1);
    REQUIRE(scene);
    CHECK(check_cell(*scene));
    Scene board_counts = *scene;
    board_counts.boards.clear();
    CHECK(check_cell(board_counts));
    const auto objects =
        std::ranges::count_if(scene->solids, [](const Solid& s) { return s.name == "box" || s.name == "cylinder"; });
    CHECK(objects >= 8);  // some may find no place
    CHECK(objects <= 17);
    const ArmModel arm = scene->arm;
    for (const Capsule& capsule : place(true_body(arm), forward(arm, scene->start_rad))) {
      if (capsule.link > 1) CHECK_FALSE(touches(*scene, capsule));
    }
    CHECK(board_views(*scene, 30000, seed).size() >= static_cast<std::size_t>(kDiverseViewsMin));
  }
}

TEST_CASE("a random cell is the same for the same seeds and another for others") {
  const Result<Scene> one = make_random_cell(5, 1), again = make_random_cell(5, 1), next = make_random_cell(6, 1);
  const Result<Scene> assembled_anew = make_random_cell(5, 2);
  REQUIRE((one && again && next && assembled_anew));
  REQUIRE(one->solids.size() == again->solids.size());
  for (std::size_t i = 0; i < one->solids.size(); ++i) {
    CHECK(one->solids[i].base_T_solid.matrix() == again->solids[i].base_T_solid.matrix());
  }
  CHECK(one->mount.link_T_camera.matrix() == again->mount.link_T_camera.matrix());
  CHECK(one->boards.front().base_T_board.pose().matrix() != next->boards.front().base_T_board.pose().matrix());
  CHECK(one->mount.link_T_camera.matrix() != assembled_anew->mount.link_T_camera.matrix());
}
