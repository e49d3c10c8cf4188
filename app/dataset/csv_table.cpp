#include "app/dataset/csv_table.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>

namespace firstlook {
namespace {

constexpr std::size_t kRowsMax = 1'000'000;

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kBlank = " \t\r";
  const std::size_t from = text.find_first_not_of(kBlank);
  if (from == std::string_view::npos) return {};
  return text.substr(from, text.find_last_not_of(kBlank) - from + 1);
}

std::vector<std::string> split(std::string_view line) {
  std::vector<std::string> fields;
  while (true) {
    const std::size_t comma = line.find(',');
    fields.emplace_back(trimmed(line.substr(0, comma)));
    if (comma == std::string_view::npos) return fields;
    line.remove_prefix(comma + 1);
  }
}

/// Where each wanted column stands in the file.
Result<std::vector<std::size_t>> locate(const std::vector<std::string>& header, const std::string& place,
                                        std::span<const std::string_view> columns) {
  std::vector<std::size_t> positions;
  for (const std::string_view column : columns) {
    const auto found = std::find(header.begin(), header.end(), column);
    if (found == header.end()) {
      return failure(Fault::kDataMalformed, "{}: no column '{}'; the first line must name {}", place, column,
                     fmt::join(columns, ","));
    }
    positions.push_back(static_cast<std::size_t>(found - header.begin()));
  }
  return positions;
}

}  // namespace

Result<double> CsvTable::number(const CsvRow& row, std::size_t column) const {
  const std::string& field = row.fields[column];
  double value = 0;
  const char* end = field.data() + field.size();
  const auto [stopped, error] = std::from_chars(field.data(), end, value);
  if (error != std::errc{} || stopped != end || !std::isfinite(value)) {
    return failure(Fault::kDataMalformed, "{}: {} is '{}', not a finite number", place(row), columns[column], field);
  }
  return value;
}

Result<CsvTable> read_csv(const std::filesystem::path& file, std::span<const std::string_view> columns) {
  std::error_code ignored;
  std::ifstream stream(file);
  if (!std::filesystem::is_regular_file(file, ignored) || !stream) {
    return failure(Fault::kDataMissing, "{}: no such file", file.string());
  }
  CsvTable table{file.filename().string(), {columns.begin(), columns.end()}, {}};
  std::vector<std::size_t> positions;
  std::size_t width = 0;
  std::string text;
  for (int line = 1; std::getline(stream, text); ++line) {
    std::string_view content = text;
    if (line == 1 && content.starts_with("\xEF\xBB\xBF")) content.remove_prefix(3);
    content = trimmed(content);
    if (content.empty() || content.front() == '#') continue;
    const std::vector<std::string> fields = split(content);
    if (width == 0) {
      const auto located = locate(fields, fmt::format("{}:{}", table.file, line), columns);
      if (!located) return std::unexpected(located.error());
      positions = *located;
      width = fields.size();
      continue;
    }
    if (fields.size() != width) {
      return failure(Fault::kDataMalformed, "{}:{}: {} columns instead of {}", table.file, line, fields.size(), width);
    }
    if (table.rows.size() == kRowsMax) return failure(Fault::kDataMalformed, "{}: too long", table.file);
    CsvRow& row = table.rows.emplace_back(CsvRow{line, {}});
    for (const std::size_t position : positions) row.fields.push_back(fields[position]);
  }
  if (width == 0) return failure(Fault::kDataMalformed, "{}: empty", table.file);
  return table;
}

}  // namespace firstlook
