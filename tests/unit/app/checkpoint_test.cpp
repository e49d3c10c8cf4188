/// Checkpoints: what a power cut leaves of them is either whole or not taken.
#include "app/report/checkpoint.hpp"

#include <catch2/catch.hpp>
#include <filesystem>

#include "platform/linux/files.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/app/sample_calibration.hpp"

namespace firstlook {
namespace {
namespace fs = std::filesystem;

StoredCalibration sample(double x_m) {
  StoredCalibration c = sample_calibration();
  c.flange_T_camera = Transform<Flange, Camera>(c.flange_T_camera.quaternion(), {x_m, 0, 0.06});
  return c;
}

/// A run's folder below `runs`, its checkpoint as old as said.
std::string cut_off(const test::TemporaryFolder& runs, const std::string& name, double x_m, int age_s) {
  const std::string folder = (runs.path() / name).string();
  REQUIRE(make_directories(folder));
  REQUIRE(write_checkpoint(folder, sample(x_m)));
  fs::last_write_time(folder + "/checkpoint.yaml", fs::file_time_type::clock::now() - std::chrono::seconds(age_s));
  return folder;
}

}  // namespace

TEST_CASE("the newest run that was cut off is offered, finished ones are not") {
  const test::TemporaryFolder runs("firstlook-runs");
  CHECK_FALSE(newest_cut_off_run((runs.path() / "none").string()));
  CHECK_FALSE(newest_cut_off_run(runs.path().string()));
  cut_off(runs, "old", 0.001, 300);
  const std::string middle = cut_off(runs, "middle", 0.002, 200);
  const std::string newest = cut_off(runs, "a-newest", 0.003, 100);
  const auto found = newest_cut_off_run(runs.path().string());
  REQUIRE(found);
  CHECK(found->folder == newest);
  CHECK(found->calibration.flange_T_camera.translation().x() == 0.003);
  REQUIRE(write_file_atomically(newest + "/result.json", std::string_view("{}")));
  CHECK(newest_cut_off_run(runs.path().string())->folder == middle);
  remove_checkpoint(middle);
  remove_checkpoint(middle);
  CHECK(newest_cut_off_run(runs.path().string())->calibration.flange_T_camera.translation().x() == 0.001);
}

TEST_CASE("a checkpoint that is cut short or altered anywhere is not taken, the one before it is") {
  const test::TemporaryFolder runs("firstlook-runs");
  const std::string older = cut_off(runs, "older", 0.001, 200);
  const std::string newer = cut_off(runs, "newer", 0.002, 100);
  const std::string file = newer + "/checkpoint.yaml";
  const std::string text = read_text_file(file, 100'000).value();
  REQUIRE(newest_cut_off_run(runs.path().string())->folder == newer);
  for (std::size_t size = 0; size < text.size(); size += 37) {
    REQUIRE(write_file_atomically(file, std::string_view(text).substr(0, size)));
    INFO(size);
    CHECK_FALSE(read_checkpoint(file));
  }
  for (std::size_t at = 0; at < text.size(); at += 41) {
    std::string altered = text;
    altered[at] = altered[at] == '1' ? '2' : '1';
    REQUIRE(write_file_atomically(file, altered));
    INFO(at);
    CHECK_FALSE(read_checkpoint(file));
  }
  CHECK(newest_cut_off_run(runs.path().string())->folder == older);
}

}  // namespace firstlook
