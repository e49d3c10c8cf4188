/// firstlook_bench: every figure beside its peer's. `make bench` builds and runs it.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <string>

#include "platform/linux/files.hpp"
#include "tests/bench/bench.hpp"

namespace {

using firstlook::bench::Options;
using firstlook::bench::Report;

struct Topic {
  const char* name;
  void (*run)(const Options&, Report&);
  bool only_by_name = false;
};
constexpr Topic kTopics[] = {
    {"calibration", firstlook::bench::bench_calibration},
    {"intrinsics", firstlook::bench::bench_intrinsics},
    {"bundle", firstlook::bench::bench_bundle},
    {"view_design", firstlook::bench::bench_view_design},
    {"detection", firstlook::bench::bench_detection},
    {"map", firstlook::bench::bench_map},
    {"gain", firstlook::bench::bench_gain},
    {"motion", firstlook::bench::bench_motion},
    {"views", firstlook::bench::bench_views},
    {"loop", firstlook::bench::bench_loop},
    {"tail", firstlook::bench::bench_tail, true},
    {"thesis_tuning", firstlook::bench::bench_thesis_tuning, true},
};

void print_summary(const Report& report) {
  int goals = 0, met = 0;
  for (const auto& row : report.rows()) {
    if (!row.met()) continue;
    ++goals;
    met += *row.met() ? 1 : 0;
  }
  std::printf("%d of %d goals met\n", met, goals);
}

// A goal that is not met is a figure, not a failure; a figure that means nothing is one.
bool all_valid(const Report& report) {
  for (const auto& row : report.rows()) {
    if (!row.void_because.empty()) return false;
  }
  return true;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Measures firstlook against its peers. Exit code 1 when a row is void.");
  Options options;
  std::string only, json;
  std::vector<std::string> names;
  for (const Topic& topic : kTopics) names.emplace_back(topic.name);
  app.add_option("--only", only, "one topic")->check(CLI::IsMember(names));
  app.add_option("--json", json, "write the rows to this file");
  app.add_option("--dataset", options.dataset, "depth frames in the TUM layout, instead of rendered ones")
      ->check(CLI::ExistingDirectory);
  app.add_flag("--smoke", options.smoke, "one repetition of everything: seconds; times mean little");
  app.add_flag("--thorough", options.thorough, "as many trials as the goals were stated for: half an hour");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }

  Report report;
  for (const Topic& topic : kTopics) {
    if (only.empty() ? !topic.only_by_name : only == topic.name) topic.run(options, report);
  }
  print_summary(report);
  if (!json.empty()) {
    if (const auto written = firstlook::write_file_atomically(json, report.json()); !written) {
      std::fprintf(stderr, "firstlook_bench: %s\n", firstlook::describe(written.error()).c_str());
      return 3;
    }
    std::printf("rows in %s\n", json.c_str());
  }
  return all_valid(report) ? 0 : 1;
}
