#include "tests/bench/bench.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <nlohmann/json.hpp>

namespace firstlook::bench {
namespace {

std::string number(const std::optional<double>& value) { return value ? fmt::format("{:.4g}", *value) : "-"; }

nlohmann::ordered_json or_null(const std::optional<double>& value) {
  return value ? nlohmann::ordered_json(*value) : nlohmann::ordered_json();
}

Row row_of(std::string name, double ours, std::string unit, std::string peer, std::optional<double> peer_value,
           const Goal& goal) {
  Row row;
  row.name = std::move(name);
  row.ours = ours;
  row.unit = std::move(unit);
  row.peer = std::move(peer);
  row.peer_value = peer_value;
  row.goal = goal;
  return row;
}

double seconds_on(clockid_t clock) {
  timespec now{};
  clock_gettime(clock, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

std::string verdict(const Row& row) {
  if (!row.void_because.empty()) return "void: " + row.void_because;
  if (!row.peer.empty() && !row.peer_value) return "peer missing";
  if (!row.met()) return "";
  return *row.met() ? "met" : "not met";
}

}  // namespace

std::string Goal::text() const {
  if (of == Of::kNothing) return "";
  const char* what = of == Of::kOurs ? "ours" : "ratio";
  if (std::isinf(high)) return fmt::format("{} >= {}", what, low);
  if (std::isinf(low)) return fmt::format("{} <= {}", what, high);
  return fmt::format("{} <= {} <= {}", low, what, high);
}

std::optional<bool> Row::met() const {
  if (goal.of == Goal::Of::kNothing) return std::nullopt;
  if (!void_because.empty() || (!peer.empty() && !peer_value)) return false;
  const std::optional<double> value = goal.of == Goal::Of::kOurs ? std::optional(ours) : ratio;
  return value && *value >= goal.low && *value <= goal.high;
}

Row timed(std::string name, double ours, std::string unit, std::string peer, std::optional<double> peer_value,
          const Goal& goal) {
  Row row = row_of(std::move(name), ours, std::move(unit), std::move(peer), peer_value, goal);
  if (peer_value && ours > 0) row.ratio = *peer_value / ours;
  return row;
}

Row measured(std::string name, double ours, std::string unit, std::string peer, std::optional<double> peer_value,
             const Goal& goal) {
  Row row = row_of(std::move(name), ours, std::move(unit), std::move(peer), peer_value, goal);
  if (peer_value && *peer_value > 0) row.ratio = ours / *peer_value;
  return row;
}

void Report::add(const Row& row) {
  constexpr const char* kLayout = "{:<52} {:>10} {:<7} {:>10} {:<27} {:>8}  {:<20} {}\n";
  if (rows_.empty()) fmt::print(kLayout, "name", "ours", "unit", "peer's", "peer", "ratio", "goal", "");
  fmt::print(kLayout, row.name, number(row.ours), row.unit, number(row.peer_value), row.peer, number(row.ratio),
             row.goal.text(), verdict(row));
  std::fflush(stdout);
  rows_.push_back(row);
}

std::string Report::json() const {
  auto array = nlohmann::ordered_json::array();
  for (const Row& row : rows_) {
    const std::optional<bool> met = row.met();
    array.push_back({{"name", row.name},
                     {"ours", row.ours},
                     {"peer", row.peer.empty() ? nlohmann::ordered_json() : nlohmann::ordered_json(row.peer)},
                     {"peer_value", or_null(row.peer_value)},
                     {"ratio", or_null(row.ratio)},
                     {"unit", row.unit},
                     {"goal", row.goal.of == Goal::Of::kNothing ? nlohmann::ordered_json()
                                                                : nlohmann::ordered_json(row.goal.text())},
                     {"met", met ? nlohmann::ordered_json(*met) : nlohmann::ordered_json()}});
  }
  return array.dump(2) + "\n";
}

double thread_seconds() { return seconds_on(CLOCK_THREAD_CPUTIME_ID); }

double process_seconds() { return seconds_on(CLOCK_PROCESS_CPUTIME_ID); }

double wall_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  const auto rank = static_cast<std::size_t>(std::floor(share * static_cast<double>(values.size())));
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(std::min(rank, values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

}  // namespace firstlook::bench
