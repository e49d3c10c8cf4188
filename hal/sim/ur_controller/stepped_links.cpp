#include "hal/sim/ur_controller/stepped_links.hpp"

#include <algorithm>

#include "hal/sim/ur_controller/stepped_service.hpp"
#include "hal/sim/ur_controller/wire.hpp"
#include "platform/memory/allocation_guard.hpp"

namespace firstlook::sim::ur {

void SteppedLinks::ask(std::uint8_t what, Id link) {
  WireWriter wire(asked_);
  wire.u8(what);
  wire.u8(static_cast<std::uint8_t>(link));
}

void SteppedLinks::begin() {
  const memory::SimulationScope simulation;
  time_ = next_cycle_ = {};
  WireWriter(asked_).u8(static_cast<std::uint8_t>(Ask::kBegin));
}

void SteppedLinks::step_to(Instant now) {
  if (now <= time_ || !health_) return;
  const memory::SimulationScope simulation;
  time_ = now;
  WireWriter wire(asked_);
  wire.u8(static_cast<std::uint8_t>(Ask::kStepTo));
  wire.u64(static_cast<std::uint64_t>(now.ns));
  told_.clear();
  health_ = turn_(asked_, told_);
  asked_.clear();
  if (health_) health_ = read(told_);
  if (health_) return;
  for (auto& [number, link] : links_) link.state = State::kClosed;
}

Status SteppedLinks::read(std::string_view told) {
  WireReader wire(told);
  while (true) {
    const auto what = static_cast<Tell>(wire.u8());
    if (what == Tell::kReached) {
      next_cycle_ = Instant{static_cast<std::int64_t>(wire.u64())};
      if (wire.ok() && wire.rest().empty()) return {};
      return failure(Fault::kDataMalformed, "the robot's answer to a turn is none");
    }
    Link& link = links_[wire.u8()];
    switch (what) {
      case Tell::kOpen:
        link.state = State::kOpen;
        break;
      case Tell::kDialled:
        link.port = wire.u16();
        break;
      case Tell::kCame:
        link.inbox.append(wire.text(wire.u32()));
        break;
      case Tell::kEnded:
        link.state = State::kClosed;
        break;
      default:
        return failure(Fault::kDataMalformed, "the robot's answer to a turn is none");
    }
    if (!wire.ok()) return failure(Fault::kDataMalformed, "the robot's answer to a turn is cut off");
  }
}

SteppedLinks::Id SteppedLinks::dial(Port port) {
  const memory::SimulationScope simulation;
  Id number = 0;
  while (links_.contains(number)) ++number;
  if (number >= kScriptLinks) return kNone;
  links_[number].state = health_ ? State::kConnecting : State::kClosed;
  ask(static_cast<std::uint8_t>(Ask::kDial), number);
  WireWriter(asked_).u16(static_cast<std::uint16_t>(port));
  return number;
}

SteppedLinks::Id SteppedLinks::accept(std::uint16_t port) {
  const memory::SimulationScope simulation;
  for (auto& [number, link] : links_) {
    if (number < kScriptLinks || link.port != port) continue;
    link.port = 0;
    if (link.state == State::kConnecting) link.state = State::kOpen;
    ask(static_cast<std::uint8_t>(Ask::kAccept), number);
    return number;
  }
  return kNone;
}

SteppedLinks::State SteppedLinks::state(Id link) const {
  const auto found = links_.find(link);
  if (found == links_.end()) return State::kClosed;
  return found->second.inbox.empty() || found->second.state == State::kConnecting ? found->second.state : State::kOpen;
}

std::string_view SteppedLinks::receive(Id link, std::span<char> room) {
  const auto found = links_.find(link);
  if (found == links_.end()) return {};
  std::string& inbox = found->second.inbox;
  const std::size_t count = std::min(room.size(), inbox.size());
  std::copy_n(inbox.begin(), count, room.begin());
  inbox.erase(0, count);
  return {room.data(), count};
}

bool SteppedLinks::send(Id link, std::string_view bytes) {
  const memory::SimulationScope simulation;
  if (state(link) != State::kOpen) return false;
  ask(static_cast<std::uint8_t>(Ask::kSend), link);
  WireWriter wire(asked_);
  wire.u32(static_cast<std::uint32_t>(bytes.size()));
  wire.text(bytes);
  return true;
}

void SteppedLinks::close(Id link) {
  const memory::SimulationScope simulation;
  if (links_.erase(link) > 0) ask(static_cast<std::uint8_t>(Ask::kClose), link);
}

}  // namespace firstlook::sim::ur
