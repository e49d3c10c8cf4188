#include "hal/sim/ur_controller/script/http_exchange.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>

namespace firstlook::sim::ur::script {
namespace {

constexpr std::size_t kAnswerBytesMax = 1 << 20;

std::string lower(std::string_view text) {
  std::string result(text);
  std::ranges::transform(result, result.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return result;
}

std::optional<std::size_t> number_of(std::string_view text, int base) {
  while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
  std::size_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number, base);
  if (error != std::errc{} || end == text.data()) return std::nullopt;
  return number;
}

/// The value of a header; its name in small letters.
std::optional<std::string_view> header(std::string_view head, std::string_view name) {
  while (!head.empty()) {
    const std::size_t end = std::min(head.find("\r\n"), head.size());
    const std::string_view line = head.substr(0, end);
    const std::size_t colon = line.find(':');
    if (colon != std::string_view::npos && lower(line.substr(0, colon)) == name) return line.substr(colon + 1);
    head.remove_prefix(std::min(end + 2, head.size()));
  }
  return std::nullopt;
}

/// Pieces with their sizes before them, the last of size 0.
std::expected<std::optional<std::string>, std::string> unchunked(std::string_view body) {
  std::string content;
  while (true) {
    const std::size_t line_end = body.find("\r\n");
    if (line_end == std::string_view::npos) return std::nullopt;
    const auto size = number_of(body.substr(0, line_end), 16);
    if (!size || *size > kAnswerBytesMax) return std::unexpected("a chunk of no size");
    body.remove_prefix(line_end + 2);
    if (*size == 0) return content;
    if (body.size() < *size + 2) return std::nullopt;
    content += body.substr(0, *size);
    body.remove_prefix(*size + 2);
  }
}

}  // namespace

std::optional<HttpUrl> read_http_url(std::string_view text) {
  constexpr std::string_view kScheme = "http://";
  if (!text.starts_with(kScheme)) return std::nullopt;
  text.remove_prefix(kScheme.size());
  const std::size_t slash = std::min(text.find('/'), text.size());
  HttpUrl url;
  url.path = slash < text.size() ? std::string(text.substr(slash)) : "/";
  text = text.substr(0, slash);
  const std::size_t colon = text.find(':');
  url.host = text.substr(0, colon);
  if (colon != std::string_view::npos) {
    const auto port = number_of(text.substr(colon + 1), 10);
    if (!port || *port == 0 || *port > 65535) return std::nullopt;
    url.port = static_cast<std::uint16_t>(*port);
  }
  if (url.host.empty()) return std::nullopt;
  return url;
}

std::string http_post(const HttpUrl& url, std::string_view xml) {
  return fmt::format(
      "POST {} HTTP/1.1\r\nHost: {}:{}\r\nContent-Type: text/xml\r\nContent-Length: {}\r\nConnection: close\r\n\r\n{}",
      url.path, url.host, url.port, xml.size(), xml);
}

std::expected<std::optional<std::string>, std::string> read_http_answer(std::string_view received, bool ended) {
  constexpr std::size_t kContinue = 100;  // "more will come"
  if (received.size() > kAnswerBytesMax) return std::unexpected("its answer is too long");
  std::string_view head;
  std::size_t head_end = 0;
  std::optional<std::size_t> status = kContinue;
  while (*status == kContinue) {
    if (!head.empty()) received.remove_prefix(head_end + 4);
    head_end = received.find("\r\n\r\n");
    if (head_end == std::string_view::npos) {
      if (ended) return std::unexpected("the connection ended without an answer");
      return std::nullopt;
    }
    head = received.substr(0, head_end);
    status = number_of(head.substr(std::min(head.find(' '), head.size())), 10);
    if (!head.starts_with("HTTP/") || !status) return std::unexpected("its answer is not HTTP");
  }
  if (*status != 200) return std::unexpected(fmt::format("HTTP status {}", *status));
  const std::string_view body = received.substr(head_end + 4);
  std::expected<std::optional<std::string>, std::string> content = std::nullopt;
  const auto coding = header(head, "transfer-encoding");
  if (const auto length = header(head, "content-length"); length && number_of(*length, 10)) {
    const std::size_t size = *number_of(*length, 10);
    if (body.size() >= size) content = std::string(body.substr(0, size));
  } else if (coding && lower(*coding).find("chunked") != std::string::npos) {
    content = unchunked(body);
  } else if (ended) {
    content = std::string(body);
  }
  if (content && !*content && ended) return std::unexpected("the connection ended within the answer");
  return content;
}

}  // namespace firstlook::sim::ur::script
