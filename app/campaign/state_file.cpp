#include "app/campaign/state_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>

#include "platform/linux/files.hpp"

namespace firstlook {
namespace {

using Json = nlohmann::ordered_json;
namespace fs = std::filesystem;

constexpr int kFormat = 1;
constexpr std::size_t kStateBytesMax = std::size_t{4} << 30;

std::string identity_line(const CampaignIdentity& identity) {
  const Json json = {{"campaign", kFormat},         {"first_seed", identity.first_seed},
                     {"sensor", identity.sensor},   {"faults", identity.faults},
                     {"program", identity.program}, {"configuration", identity.configuration}};
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::optional<CampaignIdentity> parse_identity(std::string_view line) {
  const Json json = Json::parse(line, nullptr, false);
  if (!json.is_object() || !json.contains("campaign") || json["campaign"] != kFormat) return std::nullopt;
  if (!json.contains("first_seed") || !json["first_seed"].is_number_integer()) return std::nullopt;
  CampaignIdentity identity;
  identity.first_seed = json["first_seed"].get<std::int64_t>();
  for (const auto& [key, text] :
       {std::pair{"sensor", &identity.sensor}, std::pair{"faults", &identity.faults},
        std::pair{"program", &identity.program}, std::pair{"configuration", &identity.configuration}}) {
    if (!json.contains(key) || !json.at(key).is_string()) return std::nullopt;
    *text = json.at(key).get<std::string>();
  }
  return identity;
}

/// What differs, in words; empty when nothing does.
std::string difference(const CampaignIdentity& there, const CampaignIdentity& here) {
  const auto words = [](std::string_view what, const auto& was, const auto& is) {
    return fmt::format("{} '{}', not '{}'", what, was, is);
  };
  if (there.first_seed != here.first_seed) return words("--seed", there.first_seed, here.first_seed);
  if (there.sensor != here.sensor) return words("--sensor", there.sensor, here.sensor);
  if (there.faults != here.faults) return words("--faults", there.faults, here.faults);
  if (there.program != here.program) return words("program", there.program, here.program);
  if (there.configuration != here.configuration) {
    return words("configuration (FIRSTLOOK_ variables, /etc/firstlook)", there.configuration, here.configuration);
  }
  return {};
}

bool is_state_file(const std::string& name) { return name.starts_with("cells") && name.ends_with(".jsonl"); }

/// Names of the state files, sorted; none when the folder is not there.
Result<std::vector<std::string>> state_files(const fs::path& folder) {
  std::vector<std::string> names;
  std::error_code error;
  if (!fs::exists(folder, error)) return names;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    if (is_state_file(entry->path().filename().string())) names.push_back(entry->path().filename().string());
  }
  if (error) return failure(Fault::kDiskWrite, "{}: {}", folder.string(), error.message());
  std::ranges::sort(names);
  return names;
}

Result<StateText> read_state(const fs::path& file, const CampaignIdentity& identity) {
  const Result<std::string> text = read_text_file(file.string(), kStateBytesMax);
  if (!text) return std::unexpected(text.error());
  Result<StateText> state = parse_state(*text, file.string());
  if (state && state->identity && *state->identity != identity) {
    return failure(Fault::kOutputNotEmpty, "{} is of another campaign: {}", file.string(),
                   difference(*state->identity, identity));
  }
  return state;
}

/// Two cells of one seed and one program agree, or something is wrong with one of the two computers.
bool agree(const CellRecord& a, const CellRecord& b) {
  return a.decisions_hash.empty() || b.decisions_hash.empty() || a.decisions_hash == b.decisions_hash;
}

/// Shards of one division have no cell in common; all others may.
bool may_overlap(const std::string& name, const Shard& shard) {
  return shard.whole() || !name.ends_with(fmt::format("-of-{}.jsonl", shard.count));
}

}  // namespace

std::string state_file_name(const Shard& shard) {
  return shard.whole() ? "cells.jsonl" : fmt::format("cells-{}-of-{}.jsonl", shard.number, shard.count);
}

Result<StateText> parse_state(std::string_view text, std::string_view name) {
  StateText state;
  for (int line_number = 1; !text.empty(); ++line_number) {
    const std::size_t end = text.find('\n');
    const bool last = end == std::string_view::npos || end + 1 == text.size();
    const std::string_view line = text.substr(0, end);
    bool whole = end != std::string_view::npos;
    if (whole && line_number == 1) {
      state.identity = parse_identity(line);
      whole = state.identity.has_value();
    } else if (whole) {
      Result<CellRecord> cell = parse_cell_line(line);
      whole = cell.has_value();
      if (whole) state.cells.push_back(std::move(*cell));
    }
    if (!whole && (!last || (line_number == 1 && end != std::string_view::npos))) {
      return line_number == 1
                 ? failure(
                       Fault::kDataMalformed,
                       "{}:1: not the first line of a campaign of this version; take another --out, or move it away",
                       name)
                 : failure(Fault::kDataMalformed, "{}:{}: not the line of a cell; remove it, and a cell runs again",
                           name, line_number);
    }
    state.torn = !whole;
    if (!whole) break;
    state.whole_bytes += end + 1;
    text.remove_prefix(end + 1);
  }
  return state;
}

Result<FinishedCells> read_finished_cells(const fs::path& folder, const CampaignIdentity& identity) {
  const auto names = state_files(folder);
  if (!names) return std::unexpected(names.error());
  FinishedCells finished;
  std::map<int, CellRecord> by_index;
  for (const std::string& name : *names) {
    Result<StateText> state = read_state(folder / name, identity);
    if (!state) return std::unexpected(state.error());
    if (state->torn) finished.torn.push_back(name);
    for (CellRecord& cell : state->cells) {
      if (cell.index < 0 || cell.index >= kCellsMax || cell.seed != identity.first_seed + cell.index) {
        return failure(Fault::kDataMalformed, "{}: cell {} cannot have the seed {}", (folder / name).string(),
                       cell.index, cell.seed);
      }
      const auto [known, added] = by_index.emplace(cell.index, cell);
      if (!added && !agree(known->second, cell)) {
        return failure(
            Fault::kOutputNotEmpty,
            "{}: cell {} has another result than in the files before it, though program and configuration are "
            "the same: one of two computers is wrong. Remove the cell's line in one of them",
            (folder / name).string(), cell.index);
      }
    }
  }
  for (auto& [index, cell] : by_index) finished.cells.push_back(std::move(cell));
  return finished;
}

Result<StateFile> StateFile::open(const fs::path& folder, const Shard& shard, const CampaignIdentity& identity) {
  const std::string own = state_file_name(shard);
  Result<AppendFile> file = AppendFile::open((folder / own).string());
  if (!file) return std::unexpected(file.error());
  const auto names = state_files(folder);  // with the lock held: of two that start together one sees the other
  if (!names) return std::unexpected(names.error());
  for (const std::string& name : *names) {
    if (name != own && may_overlap(name, shard) && is_being_appended((folder / name).string())) {
      return failure(Fault::kOutputNotEmpty, "{}: its cells run now, and may be the same; wait for their end",
                     (folder / name).string());
    }
  }
  const Result<StateText> state = read_state(folder / own, identity);
  if (!state) return std::unexpected(state.error());
  if (state->torn) {
    if (Status cut = file->truncate(state->whole_bytes); !cut) return std::unexpected(cut.error());
  }
  if (!state->identity) {
    if (Status written = file->append_line(identity_line(identity)); !written) return std::unexpected(written.error());
  }
  return StateFile(std::move(*file));
}

Status StateFile::append(const CellRecord& cell) { return file_.append_line(cell_line(cell)); }

}  // namespace firstlook
