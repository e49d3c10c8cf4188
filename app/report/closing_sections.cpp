#include <fmt/format.h>

#include "app/report/charts.hpp"
#include "app/report/html.hpp"
#include "app/report/sections.hpp"

namespace firstlook {

std::string memory_section(const RunRecord& record) {
  if (!record.memory) return {};
  std::string body = "<div class=\"figure\">\n" + memory_chart(*record.memory) + "</div>\n";
  body += paragraph(
      fmt::format("Allocations of the loop after it was sealed: {}.", record.memory->loop_allocations_after_seal));
  body +=
      "<p class=\"hint\">Green rows are counted as they are taken, and shown at their peak. Grey rows are declared: "
      "they "
      "count whole, so that the peak is the same on every machine; what was measured of them stands in the last "
      "section.</p>\n";
  return section("memory", "Memory", body);
}

std::string provenance_section(const RunRecord& record) {
  const Provenance& p = record.provenance;
  HtmlTable table({"", ""}, 2);
  table.row({"firstlook", p.version});
  table.row({"arm", p.arm_model});
  if (record.robot) {
    const RobotRecord& robot = *record.robot;
    table.row({"robot", fmt::format("{}, software {}, serial number {}", robot.model, robot.software,
                                    robot.serial.empty() ? "not told" : robot.serial)});
    std::string sums;
    for (const std::uint32_t sum : robot.kinematics_checksums) sums += fmt::format("{:08x} ", sum);
    table.row({"its kinematics as measured in the factory, checksums", sums});
    table.row({"the same as ROS's ur_calibration names them", robot.calibration_hash});
    if (robot.calibration_file) {
      const RobotRecord::CalibrationFile& file = *robot.calibration_file;
      table.row(
          {"taken from", fmt::format("{}: {}; the flange is where the controller has it, within {:.4f} mm", file.path,
                                     file.hash_agrees ? "the same hash" : "another hash", 1e3 * file.flange_off_m)});
    }
    table.row({"longest from its program's connection to consent, from command to motion, from stop to standstill",
               fmt::format("{:.3f}, {:.3f}, {:.3f} s", robot.consent_s, robot.accept_s, robot.stop_s)});
    const auto longest = [](const std::optional<double>& s) { return s ? fmt::format("{:.3f} s", *s) : "none"; };
    table.row({"longest from a stop or pause of the controller to the command to stop, while a segment was under way",
               longest(robot.react_s)});
    table.row({"the same from the last sign of a lost link", longest(robot.lost_s)});
  }
  table.row({"cell", record.cell});
  table.row({"seed", fmt::format("{}", record.seed)});
  if (!p.sensor.empty()) table.row({"simulated sensors", p.sensor});
  table.row({"decisions", record.decisions_hash});
  if (!p.journal_hash.empty()) table.row({"journal", p.journal_hash});
  std::string body = table.html();
  if (!p.config_yaml.empty()) {
    body += "<details><summary>Configuration of this run</summary>\n<pre>" + escape_html(p.config_yaml) +
            "</pre></details>\n";
  }
  return section("provenance", "Where these figures come from", body);
}

std::string wall_section(const RunRecord& record) {
  const WallRecord& w = record.wall;
  HtmlTable table({"", ""}, 2);
  table.row({"started (UTC)", w.started});
  table.row({"took", duration_text(w.total_s)});
  table.row({"time of the job in which the arm stood and waited for the computer",
             duration_text(w.stall_s) + (w.real_time ? ", measured"
                                                     : ", by the declared durations of the jobs: the clock is virtual "
                                                       "(--real-time measures)")});
  table.row({"resident memory, simulated cell included", mib_text(w.rss_bytes)});
  table.row({"of it program and shared libraries", mib_text(w.library_bytes)});
  table.row({"heap that boot took, all counted rows together, measured", mib_text(w.boot_heap_bytes)});
  table.row({"largest heap of a job, measured", mib_text(w.job_heap_peak_bytes)});
  table.row({"workers", fmt::format("{}", w.workers)});
  table.row({"folder", w.folder});
  HtmlTable jobs({"computing", "times", "mean", "longest"}, 1);
  for (const JobTimesRecord& job : w.jobs) {
    jobs.row({job.name, fmt::format("{}", job.count),
              fmt::format("{:.1f} ms", 1e3 * job.total_s / static_cast<double>(job.count)),
              fmt::format("{:.1f} ms", 1e3 * job.longest_s)});
  }
  return section(
      "machine", "This computer",
      table.html() + (jobs.empty() ? "" : jobs.html()) +
          paragraph(
              "Everything above is the same for every run with this seed and configuration, whatever the number of "
              "workers; these figures are not."));
}

}  // namespace firstlook
