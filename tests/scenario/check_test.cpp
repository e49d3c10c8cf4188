/// `firstlook check` and `firstlook bundle` as a user types them.
#include "tests/support/job_run.hpp"
#include "tests/support/recorded_data.hpp"

namespace firstlook {
using Catch::Matchers::Contains;
using test::JobFolder;
using test::Json;
using test::ProgramResult;

TEST_CASE("the devices of a simulated cell are ready", "[scenario][check]") {
  const JobFolder folder;
  const ProgramResult text = folder.run({"check"});
  CHECK(text.exit_code == 0);
  CHECK_THAT(text.err, Contains("simulated cell workshop"));
  for (const char* role : {"arm ", "colour camera ", "depth camera ", "pendant ", "panel "})
    CHECK_THAT(text.out, Contains(role));
  CHECK_THAT(text.out, !Contains("to do"));
  const ProgramResult json = folder.run({"check", "--cell", "empty", "--json"});
  CHECK(json.exit_code == 0);
  const Json found = Json::parse(json.out);
  CHECK(found["ok"] == true);
  CHECK(found["devices"].size() == 5);
  CHECK(found["devices"][0]["numbers"]["rate_hz"].get<double>() == Approx(125).epsilon(0.02));
  CHECK(folder.run({"check", "--cell", "empty", "--json"}).out == json.out);  // nothing of it is chance
}

TEST_CASE("devices that are configured and not there are named with what to do", "[scenario][check]") {
  const JobFolder folder;
  folder.write(
      "cart.yaml",
      "camera: {device: /dev/v4l/by-id/usb-nothing-index0}\npanel: {can_interface: can77}\nstart_source: panel\n");
  const ProgramResult run = folder.run({"check", "--config", "cart.yaml"});
  CHECK(run.exit_code == 4);
  CHECK_THAT(run.out, Contains("usb-nothing-index0: there is no such device") && Contains("to do:") &&
                          Contains("panel          missing") && Contains("warning") && Contains("glass") &&
                          Contains("usb"));
  folder.write("cart.yaml", "panel: {start_input: 1}\n");
  const ProgramResult doubled = folder.run({"check", "--config", "cart.yaml"});
  CHECK(doubled.exit_code == 3);
  CHECK_THAT(doubled.err, Contains("same bit"));
  folder.write("cart.yaml", "panel: {node_id: 127}\n");
  CHECK(folder.run({"check", "--config", "cart.yaml"}).exit_code == 3);
  folder.write("cart.yaml", "camera: {devise: /dev/video0}\n");
  CHECK_THAT(folder.run({"check", "--config", "cart.yaml"}).err, Contains("camera.device"));
}

TEST_CASE("depth pictures that memory has no room for are refused before a job", "[scenario][check]") {
  const JobFolder folder;
  folder.write("depth.yaml", test::camera_yaml({1280, 960, 1150, 1150, 639.5, 479.5}));
  folder.write("cart.yaml", "depth: {device: openni, info: depth.yaml}\n");
  const ProgramResult run = folder.run({"check", "--config", "cart.yaml"});
  CHECK(run.exit_code == 3);
  CHECK_THAT(run.err, Contains("depth.yaml") && Contains("1280 x 960") && Contains("640 x 480"));
  folder.write("depth.yaml", test::camera_yaml({640, 480, 575, 575, 319.5, 239.5}));
  CHECK(folder.run({"check", "--config", "cart.yaml"}).exit_code == 4);  // no such camera here
}

TEST_CASE("no job starts without the panel that is configured", "[scenario][check]") {
  const JobFolder folder;
  folder.write("cart.yaml", "panel: {can_interface: nocan9}\n");
  const ProgramResult run = folder.run_job("out", {"--config", "cart.yaml"});
  INFO(run.err);
  CHECK(run.exit_code == 4);
  CHECK_THAT(run.err, Contains("E5001") && Contains("panel nocan9"));
  CHECK_FALSE(std::filesystem::exists(folder / "out"));
}

TEST_CASE("a folder without a run makes no bundle", "[scenario][bundle]") {
  const JobFolder folder;
  const ProgramResult run = folder.run({"bundle", "."});
  CHECK(run.exit_code == 3);
  CHECK_THAT(run.err, Contains("no run in it"));
  CHECK(folder.names().empty());
  folder.write("result.json", "{}");
  folder.write("report.html", "<html>");
  const ProgramResult packed = folder.run({"bundle", ".", "--out", "b.tar.gz"});
  CHECK(packed.exit_code == 0);
  CHECK(packed.out == "b.tar.gz\n");
  CHECK_THAT(packed.err, Contains("warning   1 of them show the cell"));
}

}  // namespace firstlook
