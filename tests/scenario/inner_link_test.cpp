/// Cameras that sit on links before the last: located, told which link it is, and refused with what views cannot tell.
#include "tests/support/job_run.hpp"

namespace firstlook {
using test::JobFolder;
using test::Json;

namespace {

struct Mounted {
  int link;
  std::string camera;  ///< position_m and rpy_deg on the link
  std::string board;   ///< center_m and faces
  std::string reason;  ///< what the refusal says of it
};

/// Link 1 looks level along its own x axis, from beside the shoulder; the board stands low, behind the arm. Link 2
/// looks across the upper arm, which leans forward at the start: the board stands above its view. Links 3 and 5 look
/// along their z axes.
const std::vector<Mounted> kMounted = {
    {1, "position_m: [0.12, 0, 0], rpy_deg: [180, -90, 0]", "center_m: [-0.45, 0.78, 0.20], faces: [0.45, -0.78, 0]",
     "it is on link 1; on link 1 joint 1 alone moves it"},
    {2, "position_m: [0, 0.1, 0], rpy_deg: [-90, -90, 0]", "center_m: [0.42, 0.73, 0.40], faces: [-0.42, -0.73, 0.10]",
     "it is on link 2; on link 2 joints 1 to 2 move it"},
    {3, "position_m: [0, -0.15, 0]", "center_m: [0.85, 0.2, 0.62], faces: [-0.85, -0.2, 0]",
     "it is on link 3; on link 3 joints 1 to 3 move it"},
    {5, "position_m: [0, 0.1, 0.05]", "center_m: [0.8, 0.3, 0.5], faces: [-0.8, -0.3, 0.2]",
     "it is on link 5; on link 5 joints 1 to 5 move it"},
};

}  // namespace

TEST_CASE("a camera on an inner link is found, named and refused with what would help", "[scenario]") {
  for (const Mounted& m : kMounted) {
    const JobFolder folder;
    folder.write("cell.yaml",
                 "walls: {low_m: [-2, -2], high_m: [2, 2], height_m: 2.6}\n"
                 "camera: {link: " +
                     std::to_string(m.link) + ", " + m.camera +
                     "}\n"
                     "board: {" +
                     m.board + "}\n");
    const auto run = folder.run({"run", "--cell", "cell.yaml", "--seed", "1", "--sensor", "fast", "--out", "out"});
    INFO("link " << m.link << ": " << run.err);
    CHECK(run.exit_code == 5);
    const Json result = folder.read_json("out/result.json");
    const std::string reason = result["reason"];
    CHECK_THAT(reason, Catch::StartsWith("E2009") && Catch::Contains(m.reason) && Catch::Contains("flange"));
    CHECK((reason.find("along that axis and its turn about it open") != std::string::npos) == (m.link == 1));
    CHECK(result["truth"]["contacts"] == 0);
    CHECK(result["truth"]["unknown_entries"] == 0);
    CHECK(folder.run({"replay", "out/journal.flj"}).exit_code == 0);
  }
}

}  // namespace firstlook
