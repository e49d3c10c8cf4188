/// The finished cells of a campaign on disk: a first line that says of which campaign, then a line for each cell.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "app/campaign/cell_list.hpp"
#include "app/campaign/cell_record.hpp"
#include "platform/linux/append_file.hpp"

namespace firstlook {

/// What must agree for two cells to belong to one campaign. How many cells it has may grow from call to call.
struct CampaignIdentity {
  std::int64_t first_seed = 1;
  std::string sensor = "fast";
  std::string faults;
  std::string program;        ///< version and checksum of the file
  std::string configuration;  ///< checksum of what the environment and the system's configuration file make of it
  bool operator==(const CampaignIdentity&) const = default;
};

/// "cells.jsonl", or "cells-2-of-4.jsonl" of a shard.
[[nodiscard]] std::string state_file_name(const Shard& shard);

/// The text of a state file.
struct StateText {
  std::optional<CampaignIdentity> identity;  ///< empty when not even the first line is whole
  std::vector<CellRecord> cells;
  std::size_t whole_bytes = 0;  ///< up to the end of the last whole line
  bool torn = false;            ///< a last line is left out because it is not whole
};
/// `name` stands for the file in errors. Error: kDataMalformed with the line that is broken and is not the last one.
[[nodiscard]] Result<StateText> parse_state(std::string_view text, std::string_view name);

/// All state files of a folder together: one record for each cell, by index.
struct FinishedCells {
  std::vector<CellRecord> cells;
  std::vector<std::string> torn;  ///< names of the files with a last line that is not whole
};
/// Errors: kOutputNotEmpty when a file is of another campaign, or when the same cell stands in two files with different
/// results; kDataMalformed; kDataMissing (not readable). A folder that is not there has no cells.
[[nodiscard]] Result<FinishedCells> read_finished_cells(const std::filesystem::path& folder,
                                                        const CampaignIdentity& identity);

/// The state file of this process.
class StateFile {
 public:
  /// Opens or makes the file of a shard; a torn last line is cut off. Errors: as read_finished_cells; kDiskWrite;
  /// kOutputNotEmpty, too, while another process runs cells of this folder that may be the same.
  [[nodiscard]] static Result<StateFile> open(const std::filesystem::path& folder, const Shard& shard,
                                              const CampaignIdentity& identity);
  /// Error: kDiskWrite.
  [[nodiscard]] Status append(const CellRecord& cell);

 private:
  explicit StateFile(AppendFile file) : file_(std::move(file)) {}
  AppendFile file_;
};

}  // namespace firstlook
