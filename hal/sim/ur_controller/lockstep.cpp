#include "hal/sim/ur_controller/lockstep.hpp"

#include <array>

#include "hal/sim/ur_controller/wire.hpp"
#include "platform/linux/wakeup.hpp"

namespace firstlook::sim::ur {
namespace {
constexpr std::size_t kLengthBytes = 4, kTurnMax = 16 << 20;
constexpr std::int64_t kAnswer_ns = 30'000'000'000;
}  // namespace

std::size_t open_turn(std::string& out) {
  const std::size_t at = out.size();
  out.append(kLengthBytes, '\0');
  return at;
}

void close_turn(std::string& out, std::size_t at) {
  WireWriter(out).patch_u32(at, static_cast<std::uint32_t>(out.size() - at - kLengthBytes));
}

Result<std::optional<std::string_view>> first_turn(std::string_view came) {
  if (came.size() < kLengthBytes) return std::nullopt;
  const std::size_t length = WireReader(came).u32();
  if (length > kTurnMax) return failure(Fault::kDataMalformed, "a turn of {} bytes", length);
  if (came.size() < kLengthBytes + length) return std::nullopt;
  return came.substr(kLengthBytes, length);
}

Status LockstepClient::turn(std::string_view asked, std::string& told) {
  out_.clear();
  const std::size_t at = open_turn(out_);
  out_ += asked;
  close_turn(out_, at);
  stream_.send(out_);
  const std::int64_t until_ns = monotonic_ns() + kAnswer_ns;
  while (true) {
    const auto answer = first_turn(in_);
    if (!answer) return std::unexpected(answer.error());
    if (*answer) {
      told += **answer;
      in_.erase(0, kLengthBytes + (*answer)->size());
      return {};
    }
    std::array<char, 16384> room;
    const std::string_view came = stream_.receive(room);
    in_ += came;
    if (!came.empty()) continue;
    if (stream_.state() == TcpStream::State::kClosed || monotonic_ns() > until_ns) {
      return failure(Fault::kLinkLost, "the robot's simulation is gone");
    }
    stream_.wait(milliseconds(1000));
  }
}

}  // namespace firstlook::sim::ur
