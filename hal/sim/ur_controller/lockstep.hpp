/// Turns (stepped_service.hpp) over TCP: each with its length before it, u32, as is the answer.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "platform/core/result.hpp"
#include "platform/linux/tcp_stream.hpp"

namespace firstlook::sim::ur {

/// Puts the length before what is appended to `out` from `at` on.
void close_turn(std::string& out, std::size_t at);
/// Where a turn begins in `out`: leaves room for its length.
[[nodiscard]] std::size_t open_turn(std::string& out);
/// The first whole turn of what has come, without its length; it takes up 4 bytes more. Error: kDataMalformed for a
/// length that no turn has.
[[nodiscard]] Result<std::optional<std::string_view>> first_turn(std::string_view came);

/// The client's end.
class LockstepClient {
 public:
  explicit LockstepClient(TcpStream stream) : stream_(std::move(stream)) {}
  /// Waits for the answer. Error: kLinkLost when none comes within 30 s, or the other side is gone.
  [[nodiscard]] Status turn(std::string_view asked, std::string& told);

 private:
  TcpStream stream_;
  std::string out_, in_;
};

}  // namespace firstlook::sim::ur
