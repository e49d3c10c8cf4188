/// What all benchmarks share: rows of the table, goals, and medians of runs that take turns.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace firstlook::bench {

/// What the command line asks for.
struct Options {
  bool smoke = false;             ///< seconds instead of minutes: does it run, do results agree? Times mean little
  bool thorough = false;          ///< as many trials and frames as the goals were stated for; half an hour
  std::filesystem::path dataset;  ///< TUM layout: its depth frames instead of rendered ones; empty: none

  /// One of three amounts, by how long the run may take.
  [[nodiscard]] int amount(int when_smoke, int usual, int when_thorough) const {
    return smoke ? when_smoke : thorough ? when_thorough : usual;
  }
};

/// What a row must show. Limits are inclusive.
struct Goal {
  enum class Of : std::uint8_t { kNothing, kOurs, kRatio } of = Of::kNothing;
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();

  [[nodiscard]] static Goal none() { return {}; }
  [[nodiscard]] static Goal ours_at_most(double high) { return {.of = Of::kOurs, .high = high}; }
  [[nodiscard]] static Goal ours_between(double low, double high) { return {Of::kOurs, low, high}; }
  [[nodiscard]] static Goal ratio_at_least(double low) { return {.of = Of::kRatio, .low = low}; }
  [[nodiscard]] static Goal ratio_at_most(double high) { return {.of = Of::kRatio, .high = high}; }
  /// "ratio >= 100"; empty without a goal.
  [[nodiscard]] std::string text() const;
};

/// One figure. For times `ratio` is the peer's over ours, for errors ours over the peer's (the bound's).
struct Row {
  std::string name;  ///< topic/what/at which resolution or noise
  double ours = 0;
  std::string unit;
  std::string peer;                  ///< empty: none; name it even when it is missing
  std::optional<double> peer_value;  ///< in `unit`; empty with a peer: it is not installed
  std::optional<double> ratio;
  Goal goal;
  std::string void_because;  ///< not empty: the figure means nothing, e.g. "results differ" where they must not

  /// Empty without a goal.
  [[nodiscard]] std::optional<bool> met() const;
};

/// A row for a time: ratio = peer over ours.
[[nodiscard]] Row timed(std::string name, double ours, std::string unit, std::string peer,
                        std::optional<double> peer_value, const Goal& goal);
/// A row for an error or a count: ratio = ours over peer.
[[nodiscard]] Row measured(std::string name, double ours, std::string unit, std::string peer,
                           std::optional<double> peer_value, const Goal& goal);

/// Prints each row as it comes, keeps all of them for the file.
class Report {
 public:
  void add(const Row& row);
  [[nodiscard]] const std::vector<Row>& rows() const { return rows_; }
  /// DESIGN 13: an array of {name, ours, peer, peer_value, ratio, unit, goal, met}; null for what is not there.
  [[nodiscard]] std::string json() const;

 private:
  std::vector<Row> rows_;
};

/// Seconds that the calling thread has computed: other programs of a busy machine do not count.
[[nodiscard]] double thread_seconds();
/// The same for all threads together.
[[nodiscard]] double process_seconds();
/// Seconds on the wall, for what waits or uses several threads.
[[nodiscard]] double wall_seconds();

/// Seconds that `work` takes on the calling thread.
template <typename Work>
double seconds_of(Work&& work) {
  const double start = thread_seconds();
  work();
  return thread_seconds() - start;
}

/// The value below which `share` of the values lie (0.5: the median); 0 for none.
[[nodiscard]] double quantile(std::vector<double> values, double share);
[[nodiscard]] inline double median(std::vector<double> values) { return quantile(std::move(values), 0.5); }

/// Median seconds of each contestant over `rounds`; they take turns, so that a machine that slows down slows all.
template <typename... Contestants>
std::array<double, sizeof...(Contestants)> medians_taking_turns(int rounds, Contestants&&... contestants) {
  std::array<std::vector<double>, sizeof...(Contestants)> seconds;
  for (int round = 0; round < rounds; ++round) {
    std::size_t i = 0;
    (seconds[i++].push_back(seconds_of(contestants)), ...);
  }
  std::array<double, sizeof...(Contestants)> result{};
  for (std::size_t i = 0; i < result.size(); ++i) result[i] = median(std::move(seconds[i]));
  return result;
}

// ---- the topics, one file each
void bench_calibration(const Options& options, Report& report);
void bench_intrinsics(const Options& options, Report& report);
void bench_bundle(const Options& options, Report& report);
void bench_view_design(const Options& options, Report& report);
void bench_detection(const Options& options, Report& report);
void bench_map(const Options& options, Report& report);
void bench_gain(const Options& options, Report& report);
void bench_motion(const Options& options, Report& report);
void bench_views(const Options& options, Report& report);
/// Not one of those that run without a name.
void bench_tail(const Options& options, Report& report);
void bench_thesis_tuning(const Options& options, Report& report);
void bench_loop(const Options& options, Report& report);

}  // namespace firstlook::bench
