/// Tables of comma-separated values, every complaint with file and line.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "platform/core/result.hpp"

namespace firstlook {

struct CsvRow {
  int line = 0;
  std::vector<std::string> fields;  ///< in the order of the columns asked for
};

struct CsvTable {
  std::string file;  ///< name for messages
  std::vector<std::string> columns;
  std::vector<CsvRow> rows;

  [[nodiscard]] std::string place(const CsvRow& row) const { return file + ":" + std::to_string(row.line); }
  /// A finite number. @return kDataMalformed with file, line and column
  [[nodiscard]] Result<double> number(const CsvRow& row, std::size_t column) const;
};

/// Reads the columns named, which the first line must name (in any order; others are ignored). Blank lines and lines
/// that begin with # are skipped.
/// @return kDataMissing; kDataMalformed for a missing column or a row with more or fewer fields than the first line
[[nodiscard]] Result<CsvTable> read_csv(const std::filesystem::path& file, std::span<const std::string_view> columns);

}  // namespace firstlook
