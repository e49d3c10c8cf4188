/// The pieces that the report's pages are made of: escaped text, tables, numbers as people read them.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

namespace firstlook {

/// Text for HTML and for quoted attributes: & < > " ' are escaped; control characters and bytes that are not UTF-8
/// become U+FFFD.
[[nodiscard]] std::string escape_html(std::string_view text);

/// A table whose cells are text: every cell is escaped, so data can never become markup.
class HtmlTable {
 public:
  /// @param text_columns  so many columns from the left are text, the others numbers (right-aligned)
  HtmlTable(std::initializer_list<std::string_view> header, int text_columns);
  void row(const std::vector<std::string>& cells);
  [[nodiscard]] bool empty() const { return rows_ == 0; }
  /// @param style  class of the table element; a word of ours, not data
  [[nodiscard]] std::string html(std::string_view style = {}) const;

 private:
  void append_cell(std::string_view tag, int column, std::string_view text);

  int text_columns_;
  int rows_ = 0;
  std::string html_;
};

/// "1 234 567" with narrow no-break spaces.
[[nodiscard]] std::string grouped(std::uint64_t value);
/// "8.4 s", "2 min 05 s".
[[nodiscard]] std::string duration_text(double seconds);
/// "128.0 MiB".
[[nodiscard]] std::string mib_text(std::uint64_t bytes);
/// A section with its heading; `id` is an anchor.
[[nodiscard]] std::string section(std::string_view id, std::string_view title, const std::string& body);
/// All of a page before its body. @param title  escaped already
[[nodiscard]] std::string page_head(const std::string& title);
/// A paragraph of escaped text.
[[nodiscard]] std::string paragraph(std::string_view text);

}  // namespace firstlook
