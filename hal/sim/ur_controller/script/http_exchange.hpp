/// One question to an HTTP server and its answer, as text: who brings the bytes there and back is no matter here.
#pragma once

#include <cstdint>
#include <expected>
#include <optional>
#include <string>
#include <string_view>

namespace firstlook::sim::ur::script {

struct HttpUrl {
  std::string host;
  std::uint16_t port = 80;
  std::string path;  ///< "/RPC2"
};
/// "http://192.168.0.2:8080/RPC2"; port and path may be missing.
[[nodiscard]] std::optional<HttpUrl> read_http_url(std::string_view text);

/// A POST of XML. The server is asked to close the connection behind its answer.
[[nodiscard]] std::string http_post(const HttpUrl& url, std::string_view xml);

/// The content of an answer; empty while more of it has to come. An error says what is wrong with it.
/// @param ended  nothing more will come
[[nodiscard]] std::expected<std::optional<std::string>, std::string> read_http_answer(std::string_view received,
                                                                                      bool ended);

}  // namespace firstlook::sim::ur::script
