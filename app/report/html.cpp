#include "app/report/html.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/report/report_style.hpp"

namespace firstlook {
namespace {

constexpr std::string_view kReplacement = "\xEF\xBF\xBD";

/// Length of the well-formed UTF-8 sequence at the start of `text` (Unicode 15, table 3-7); 0 when there is none.
std::size_t utf8_length(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(i < text.size() ? text[i] : 0); };
  const unsigned char lead = byte(0);
  if (lead < 0x80) return 1;
  const std::size_t length = lead >= 0xC2 && lead <= 0xDF   ? 2
                             : (lead & 0xF0) == 0xE0        ? 3
                             : lead >= 0xF0 && lead <= 0xF4 ? 4
                                                            : 0;
  if (length == 0) return 0;
  const unsigned char low = lead == 0xE0 ? 0xA0 : lead == 0xF0 ? 0x90 : 0x80;
  const unsigned char high = lead == 0xED ? 0x9F : lead == 0xF4 ? 0x8F : 0xBF;
  if (byte(1) < low || byte(1) > high) return 0;
  for (std::size_t i = 2; i < length; ++i) {
    if ((byte(i) & 0xC0) != 0x80) return 0;
  }
  return length;
}

std::string_view escaped_char(char c) {
  switch (c) {
    case '&':
      return "&amp;";
    case '<':
      return "&lt;";
    case '>':
      return "&gt;";
    case '"':
      return "&quot;";
    case '\'':
      return "&#39;";
    default:
      return {};
  }
}

}  // namespace

std::string escape_html(std::string_view text) {
  std::string out;
  out.reserve(text.size());
  while (!text.empty()) {
    const std::size_t length = utf8_length(text);
    const auto first = static_cast<unsigned char>(text.front());
    const bool control = length == 1 && ((first < 0x20 && first != '\n' && first != '\t') || first == 0x7F);
    if (length == 0 || control) {
      out += kReplacement;
    } else if (const std::string_view escaped = escaped_char(text.front()); length == 1 && !escaped.empty()) {
      out += escaped;
    } else {
      out += text.substr(0, length);
    }
    text.remove_prefix(length == 0 ? 1 : length);
  }
  return out;
}

HtmlTable::HtmlTable(std::initializer_list<std::string_view> header, int text_columns) : text_columns_(text_columns) {
  // A table of names and values needs no header.
  if (std::all_of(header.begin(), header.end(), [](std::string_view title) { return title.empty(); })) {
    html_ = "<tbody>\n";
    return;
  }
  html_ = "<thead><tr>";
  int column = 0;
  for (const std::string_view title : header) append_cell("th", column++, title);
  html_ += "</tr></thead>\n<tbody>\n";
}

void HtmlTable::append_cell(std::string_view tag, int column, std::string_view text) {
  html_ += fmt::format("<{}{}>{}</{}>", tag, column < text_columns_ ? "" : " class=\"num\"", escape_html(text), tag);
}

void HtmlTable::row(const std::vector<std::string>& cells) {
  html_ += "<tr>";
  for (std::size_t i = 0; i < cells.size(); ++i) append_cell("td", static_cast<int>(i), cells[i]);
  html_ += "</tr>\n";
  ++rows_;
}

std::string HtmlTable::html(std::string_view style) const {
  const std::string open = style.empty() ? "<table>" : fmt::format("<table class=\"{}\">", style);
  return "<div class=\"scroll\">" + open + html_ + "</tbody></table></div>\n";
}

std::string grouped(std::uint64_t value) {
  const std::string digits = fmt::format("{}", value);
  std::string out;
  for (std::size_t i = 0; i < digits.size(); ++i) {
    if (i > 0 && (digits.size() - i) % 3 == 0) out += "\u202F";
    out += digits[i];
  }
  return out;
}

std::string duration_text(double seconds) {
  if (!(seconds >= 60)) return fmt::format("{:.1f} s", seconds);
  const auto whole = static_cast<std::int64_t>(std::llround(std::min(seconds, 1e12)));
  return fmt::format("{} min {:02} s", whole / 60, whole % 60);
}

std::string mib_text(std::uint64_t bytes) { return fmt::format("{:.1f} MiB", static_cast<double>(bytes) / 1048576.0); }

std::string section(std::string_view id, std::string_view title, const std::string& body) {
  return fmt::format("<section id=\"{}\">\n<h2>{}</h2>\n{}</section>\n", id, escape_html(title), body);
}

std::string paragraph(std::string_view text) { return "<p>" + escape_html(text) + "</p>\n"; }

std::string page_head(const std::string& title) {
  // The policy keeps the promise of the page: nothing is fetched and no script runs, whatever the data say.
  std::string html =
      "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; img-src data:; style-src "
      "'unsafe-inline'\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>" +
      title + "</title>\n<style>";
  html += kReportStyle;
  return html + "</style>\n</head>\n";
}

}  // namespace firstlook
