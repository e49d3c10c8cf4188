#include <catch2/catch.hpp>
#include <string>

#include "hal/sim/faults.hpp"
#include "hal/sim/simulated_operator.hpp"

using namespace firstlook;
using namespace firstlook::sim;

TEST_CASE("a fault specification is read", "[sim][faults]") {
  const auto faults =
      parse_faults("depth.drop=0.05,operator.pause_at=20:5,board.absent=1,link.lost_at=40,depth.clock=-0.1");
  REQUIRE(faults.has_value());
  CHECK(faults->depth_drop == 0.05);
  CHECK(faults->pause_s == 20);
  CHECK(faults->pause_duration_s == 5);
  CHECK(faults->board_absent);
  CHECK(faults->link_lost_s == 40);
  CHECK(faults->depth_clock_offset_s == -0.1);
  const auto camera = parse_faults("color.focal=-0.002,color.center=1.5");
  REQUIRE(camera.has_value());
  CHECK(camera->color_focal_error == -0.002);
  CHECK(camera->color_center_error_px == 1.5);
  CHECK(faults->play_s == 0.5);
  CHECK(faults->stop_s == kNever);
}

TEST_CASE("no specification is no fault", "[sim][faults]") {
  const auto faults = parse_faults("");
  REQUIRE(faults.has_value());
  CHECK(faults->depth_drop == 0);
  CHECK(faults->start_s == 1.0);
}

TEST_CASE("an unknown fault names the nearest known one", "[sim][faults]") {
  const auto faults = parse_faults("depht.drop=0.05");
  REQUIRE_FALSE(faults.has_value());
  CHECK(faults.error().fault == Fault::kUsage);
  CHECK(std::string(faults.error().detail()).find("depth.drop") != std::string::npos);
}

TEST_CASE("values out of range are refused", "[sim][faults]") {
  for (const char* bad : {"depth.drop=1.5", "depth.drop", "depth.drop=", "link.lost_at=-1", "link.lost_at=soon",
                          "board.absent=yes", "operator.pause_at=5:0", "depth.clock=nan", "color.focal=2",
                          "color.center=500", "depth.drop=0.1x", ",", "=1"}) {
    INFO(bad);
    CHECK_FALSE(parse_faults(bad).has_value());
  }
}

TEST_CASE("the operator's keys and the controller agree", "[sim][faults]") {
  const auto faults = parse_faults("operator.pause_at=20:5,operator.stop_at=30");
  REQUIRE(faults.has_value());
  SimulatedPendant pendant(pendant_script(*faults));
  CHECK(pendant.next_due() == Instant{500'000'000});
  CHECK_FALSE(pendant.poll(Instant{499'000'000}).has_value());
  const Instant end{seconds(100).ns};
  const ControllerScript controller = controller_script(*faults);
  REQUIRE(controller.size() == 4);
  for (const ControllerEvent& felt : controller) {
    const auto key = pendant.poll(end);
    REQUIRE(key.has_value());
    CHECK(key->stamp == felt.stamp);
  }
  CHECK_FALSE(pendant.poll(end).has_value());
  CHECK(pendant.next_due() == kNeverDue);
  const auto nobody = parse_faults("operator.play_at=never");
  REQUIRE(nobody.has_value());
  CHECK(SimulatedPendant(pendant_script(*nobody)).next_due() == kNeverDue);
}
