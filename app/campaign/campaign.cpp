#include "app/campaign/campaign.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <set>

#include "app/campaign/judge_cell.hpp"
#include "platform/linux/files.hpp"
#include "platform/linux/process.hpp"
#include "platform/linux/wakeup.hpp"

namespace firstlook {
namespace {

namespace fs = std::filesystem;

constexpr int kWait_ms = 250;  // for the progress line, limits and stop signals; a cell's end is seen at once
constexpr std::size_t kResultBytesMax = std::size_t{64} << 20;
constexpr std::size_t kConsoleTail = 4000;

double now_s() { return 1e-9 * static_cast<double>(monotonic_ns()); }

std::string tail_of(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary | std::ios::ate);
  if (!stream) return {};
  const auto size = static_cast<std::size_t>(std::max<std::streamoff>(0, stream.tellg()));
  std::string text(std::min(size, kConsoleTail), '\0');
  stream.seekg(static_cast<std::streamoff>(size - text.size()));
  stream.read(text.data(), static_cast<std::streamsize>(text.size()));
  return text;
}

std::string cell_text(const CellRecord& cell) {
  std::string text = fmt::format("cell {} seed {}: {}", cell.index, cell.seed, name_of(cell.outcome));
  std::ranges::replace(text, '_', ' ');
  if (cell.outcome != CellOutcome::kDone) text += ": " + cell.reason;
  if (const auto& coverage = cell.figures.coverage_of_observable)
    text += fmt::format(", {:.2f} % of the observable", 100 * *coverage);
  if (const auto& views = cell.figures.views) text += fmt::format(", {:.0f} views", *views);
  if (const auto& robot_s = cell.figures.robot_time_s) text += fmt::format(", {:.0f} s of the robot", *robot_s);
  if (cell.touched()) {
    text += fmt::format(", {:.0f} CONTACTS, {:.0f} ENTRIES into unknown space", cell.figures.contacts.value_or(0),
                        cell.figures.unknown_entries.value_or(0));
  }
  return text + fmt::format(", took {:.1f} s", cell.wall.total_s);
}

/// A cell whose process runs, or has just ended.
struct RunningCell {
  int index = 0;
  fs::path folder;  ///< console.txt, and the run's own folder
  double began_s = 0;
  bool at_limit = false;
  ChildProcess process;
};

class CellQueue {
 public:
  CellQueue(const CampaignOptions& options, StateFile& state, Narrator& narrator)
      : options_(options), state_(state), narrator_(narrator) {}

  /// Runs these cells; false when a stop signal came first.
  Result<bool> run(const std::vector<int>& todo);
  [[nodiscard]] std::vector<CellRecord> take_finished() { return std::move(finished_); }

 private:
  [[nodiscard]] fs::path work_folder(int index) const {
    return options_.folder / "work" / fmt::format("seed-{}", options_.list.seed(index));
  }
  Status start(int index);
  Status collect();
  Status record(RunningCell& cell, const ChildEnd& end);
  /// Keeps the folder, or removes it. Returns whether it was kept.
  [[nodiscard]] bool put_away(const CellRecord& cell, const fs::path& folder) const;
  void show_progress(std::size_t todo);
  void drop_running();

  const CampaignOptions& options_;
  StateFile& state_;
  Narrator& narrator_;
  std::vector<RunningCell> running_;
  std::vector<CellRecord> finished_;
  double began_s_ = now_s();
};

Result<bool> CellQueue::run(const std::vector<int>& todo) {
  Status status;
  std::size_t next = 0;
  while (status && !stop_signal_received() && (next < todo.size() || !running_.empty())) {
    while (status && next < todo.size() && running_.size() < static_cast<std::size_t>(options_.jobs))
      status = start(todo[next++]);
    if (!status) break;
    show_progress(todo.size());
    std::vector<int> descriptors;
    for (const RunningCell& cell : running_) descriptors.push_back(cell.process.descriptor());
    wait_for_child(descriptors, kWait_ms);
    if (!stop_signal_received()) status = collect();
  }
  const bool complete = next == todo.size() && running_.empty();
  drop_running();
  narrator_.clear_progress();
  if (!status) return std::unexpected(status.error());
  return complete;
}

Status CellQueue::start(int index) {
  const fs::path folder = work_folder(index);
  std::error_code error;
  fs::remove_all(folder, error);  // of a call that was killed
  if (Status made = make_directories(folder.string()); !made) return made;
  Result<ChildProcess> process = ChildProcess::start(
      {kOwnProgram, run_arguments(options_.list.seed(index), options_.list.faults, (folder / "run").string()),
       (folder / "console.txt").string()});
  if (!process) return std::unexpected(process.error());
  running_.push_back({index, folder, now_s(), false, std::move(*process)});
  return {};
}

Status CellQueue::collect() {
  for (auto cell = running_.begin(); cell != running_.end();) {
    std::optional<ChildEnd> end = cell->process.ended();
    if (!end && now_s() - cell->began_s > options_.cell_limit_s) {
      cell->at_limit = true;
      cell->process.kill();
    }
    if (!end) {
      ++cell;
      continue;
    }
    if (Status recorded = record(*cell, *end); !recorded) return recorded;
    cell = running_.erase(cell);
  }
  return {};
}

Status CellQueue::record(RunningCell& running, const ChildEnd& end) {
  CellTraces traces{end, running.at_limit, options_.cell_limit_s, {}, tail_of(running.folder / "console.txt")};
  if (auto text = read_text_file((running.folder / "run/result.json").string(), kResultBytesMax))
    traces.result_json = std::move(*text);
  const std::int64_t seed = options_.list.seed(running.index);
  Result<CellRecord> cell = judge_cell(traces, seed);
  if (!cell) return std::unexpected(cell.error());
  cell->index = running.index;
  cell->seed = seed;
  cell->wall = {now_s() - running.began_s, end.processor_s, static_cast<double>(end.peak_resident_bytes), false};
  cell->wall.kept = put_away(*cell, running.folder);
  if (Status written = state_.append(*cell); !written) return written;
  narrator_.line(cell_text(*cell));
  finished_.push_back(std::move(*cell));
  return {};
}

bool CellQueue::put_away(const CellRecord& cell, const fs::path& folder) const {
  std::error_code error;
  const fs::path kept = options_.folder / "kept", place = kept / folder.filename();
  fs::remove_all(place, error);
  if (notable(cell)) {
    fs::create_directories(kept, error);
    int there = 0;
    for (fs::directory_iterator entry(kept, error), end; !error && entry != end; entry.increment(error)) ++there;
    if (!error && there < options_.kept_max) fs::rename(folder, place, error);
    if (!error && there < options_.kept_max) return true;
  }
  fs::remove_all(folder, error);
  return false;
}

void CellQueue::show_progress(std::size_t todo) {
  if (!narrator_.on_terminal()) return;
  const double minutes = (now_s() - began_s_) / 60;
  std::string text = fmt::format("{} of {} cells, {} running", finished_.size(), todo, running_.size());
  if (!finished_.empty() && minutes > 0) {
    const double rate = static_cast<double>(finished_.size()) / minutes;
    text += fmt::format(", {:.1f} a minute, about {:.0f} min left", rate,
                        std::ceil(static_cast<double>(todo - finished_.size()) / rate));
  }
  narrator_.progress(text);
}

/// Ends what still runs; nothing of it is kept.
void CellQueue::drop_running() {
  for (RunningCell& cell : running_) cell.process.kill();
  std::vector<fs::path> folders;
  for (const RunningCell& cell : running_) folders.push_back(cell.folder);
  running_.clear();  // waits for their end
  std::error_code error;
  for (const fs::path& folder : folders) fs::remove_all(folder, error);
  fs::remove(options_.folder / "work", error);  // when nobody else works there
}

/// Those that were asked for, of all that the folder has.
std::vector<CellRecord> asked_for(const CampaignOptions& options, std::vector<CellRecord> cells) {
  std::erase_if(cells, [&](const CellRecord& cell) {
    return cell.index >= options.list.cells || !options.shard.has(cell.index);
  });
  return cells;
}

std::vector<int> not_finished(const CampaignOptions& options, const std::vector<CellRecord>& finished) {
  std::set<int> known;
  for (const CellRecord& cell : finished) known.insert(cell.index);
  std::vector<int> todo = options.list.indices(options.shard);
  std::erase_if(todo, [&](int index) { return known.contains(index); });
  return todo;
}

}  // namespace

bool notable(const CellRecord& cell) { return cell.outcome != CellOutcome::kDone || cell.touched(); }

Result<CampaignEnd> run_campaign(const CampaignOptions& options, const CampaignIdentity& identity, Narrator& narrator) {
  CampaignEnd end{{options.list, options.shard, identity, {}}, false};
  auto there = read_finished_cells(options.folder, identity);
  if (!there) return std::unexpected(there.error());
  for (const std::string& name : there->torn)
    narrator.line(fmt::format("{}: the last line is not whole and left out", (options.folder / name).string()));
  end.cells.finished = asked_for(options, std::move(there->cells));
  if (options.merge) {
    if (end.cells.finished.empty())
      return failure(Fault::kDataMissing, "{}: no finished cells to merge", options.folder.string());
    return end;
  }

  if (Status made = make_directories(options.folder.string()); !made) return std::unexpected(made.error());
  Result<StateFile> state = StateFile::open(options.folder, options.shard, identity);
  if (!state) return std::unexpected(state.error());
  there = read_finished_cells(options.folder, identity);  // nobody else can add to them now
  if (!there) return std::unexpected(there.error());
  end.cells.finished = asked_for(options, std::move(there->cells));
  const std::vector<int> todo = not_finished(options, end.cells.finished);
  if (!end.cells.finished.empty())
    narrator.line(fmt::format("{} cells are finished, {} to go", end.cells.finished.size(), todo.size()));

  CellQueue queue(options, *state, narrator);
  const Result<bool> complete = queue.run(todo);
  if (!complete) return std::unexpected(complete.error());
  end.interrupted = !*complete;
  for (CellRecord& cell : queue.take_finished()) end.cells.finished.push_back(std::move(cell));
  std::ranges::sort(end.cells.finished, {}, &CellRecord::index);
  return end;
}

}  // namespace firstlook
