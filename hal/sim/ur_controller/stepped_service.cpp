#include "hal/sim/ur_controller/stepped_service.hpp"

#include <algorithm>

#include "hal/sim/ur_controller/wire.hpp"

namespace firstlook::sim::ur {
namespace {

constexpr std::size_t kUnreadMax = 2 << 20;

void tell_bytes(WireWriter& wire, std::uint8_t link, std::string& bytes) {
  if (bytes.empty()) return;
  wire.u8(static_cast<std::uint8_t>(Tell::kCame));
  wire.u8(link);
  wire.u32(static_cast<std::uint32_t>(bytes.size()));
  wire.text(bytes);
  bytes.clear();
}

}  // namespace

SteppedService::SteppedService(SimulatedUr& robot, Timetable timetable)
    : robot_(robot), timetable_(std::move(timetable)) {
  std::ranges::stable_sort(timetable_, {}, &TimedHappening::stamp);
  robot_.programs().set_sockets(this);
}

SteppedService::~SteppedService() {
  hang_up();
  robot_.programs().set_sockets(nullptr);
}

Status SteppedService::turn(std::string_view asked, std::string& told) {
  WireReader wire(asked);
  bool stepped = false;
  while (!stepped && wire.ok()) {
    const auto what = static_cast<Ask>(wire.u8());
    stepped = what == Ask::kStepTo;
    if (!act(what, wire)) return failure(Fault::kDataMalformed, "a turn of the robot that is none");
  }
  if (!wire.ok() || !wire.rest().empty()) return failure(Fault::kDataMalformed, "a turn of the robot that is none");
  tell(told);
  return {};
}

/// False: that is nothing that can be asked.
bool SteppedService::act(Ask what, WireReader& wire) {
  if (what == Ask::kBegin) {
    time_ = {};
    begun_ = true;
    return true;
  }
  if (what == Ask::kStepTo) {
    const std::uint64_t until_ns = wire.u64();
    if (!wire.ok() || until_ns > kStepMax_ns) return false;
    step_to(Instant{static_cast<std::int64_t>(until_ns)});
    return true;
  }
  const std::uint8_t number = wire.u8();
  if (what == Ask::kDial) {
    const auto port = static_cast<Port>(wire.u16());
    const bool served = port == Port::kTruth || std::ranges::find(kPorts, port) != kPorts.end();
    if (number >= kScriptLinks || links_.contains(number) || !served) return false;
    links_[number].dialled = port;
    return true;
  }
  const auto link = links_.find(number);
  if (link == links_.end()) return false;
  switch (what) {
    case Ask::kAccept:
      link->second.accepted = true;
      return true;
    case Ask::kSend:
      hear(link->second, wire.text(wire.u32()));
      return true;
    case Ask::kClose:
      link->second.closed_here = true;
      drop_if_done(link);
      return true;
    default:
      return false;
  }
}

void SteppedService::hear(Link& link, std::string_view bytes) {
  if (!robot_.cable_in() && !link.is_truth()) return;
  if (link.session == nullptr) {
    link.to_script.append(bytes);
  } else if (!link.session->over()) {
    link.session->receive(bytes);
  }
}

void SteppedService::step_to(Instant until) {
  for (auto& [number, link] : links_) {
    if (!link.dialled || link.session != nullptr) continue;
    const bool reached = robot_.cable_in() && robot_.serves(*link.dialled);
    if (reached || link.is_truth()) link.session = &robot_.open(*link.dialled);
  }
  while (true) {
    for (; begun_ && next_ < timetable_.size() && timetable_[next_].stamp <= time_; ++next_) {
      happen(timetable_[next_].happening, robot_);
    }
    if (time_ + robot_.cycle() > until) return;
    robot_.step();
    time_ = time_ + robot_.cycle();
  }
}

void SteppedService::tell(std::string& told) {
  WireWriter wire(told);
  const auto mark = [&](Tell what, std::uint8_t number) {
    wire.u8(static_cast<std::uint8_t>(what));
    wire.u8(number);
  };
  for (auto& [number, link] : links_) {
    std::string& out = link.session != nullptr ? link.session->output() : link.out;
    if (link.closed_here || (!robot_.cable_in() && !link.is_truth())) {
      out.clear();
      continue;
    }
    if (!link.announced && (link.session != nullptr || !link.dialled)) {
      link.announced = true;
      mark(link.dialled ? Tell::kOpen : Tell::kDialled, number);
      if (!link.dialled) wire.u16(link.port);
    }
    tell_bytes(wire, number, out);
    const bool ended = link.session != nullptr ? link.session->over() : link.closed_there;
    if (ended && !link.end_told) {
      link.end_told = true;
      mark(Tell::kEnded, number);
    }
  }
  wire.u8(static_cast<std::uint8_t>(Tell::kReached));
  wire.u64(static_cast<std::uint64_t>((time_ + robot_.cycle()).ns));
}

void SteppedService::drop_if_done(Links::iterator link) {
  if (!link->second.closed_here || !(link->second.dialled || link->second.closed_there)) return;
  if (link->second.session != nullptr) robot_.close(*link->second.session);
  links_.erase(link);
}

void SteppedService::hang_up() {
  for (auto link = links_.begin(); link != links_.end();) {
    const auto next = std::next(link);
    link->second.closed_here = true;
    drop_if_done(link);
    link = next;
  }
}

script::Sockets::Id SteppedService::open(const std::string&, std::uint16_t port) {
  if (!robot_.cable_in()) return 0;
  std::uint8_t number = kScriptLinks;
  while (links_.contains(number)) {
    if (++number == 0) return 0;
  }
  links_[number].port = port;
  return number;
}

script::Sockets::State SteppedService::state(Id socket) const {
  const auto found = links_.find(static_cast<std::uint8_t>(socket));
  if (found == links_.end() || found->second.closed_there || found->second.closed_here) return State::kClosed;
  return found->second.accepted ? State::kOpen : State::kConnecting;
}

bool SteppedService::send(Id socket, std::string_view bytes) {
  if (state(socket) != State::kOpen) return false;
  std::string& out = links_.at(static_cast<std::uint8_t>(socket)).out;
  out.append(bytes);
  return out.size() <= kUnreadMax;
}

std::string& SteppedService::received(Id socket) { return links_.at(static_cast<std::uint8_t>(socket)).to_script; }

void SteppedService::close(Id socket) {
  const auto found = links_.find(static_cast<std::uint8_t>(socket));
  if (found == links_.end()) return;
  found->second.closed_there = true;
  drop_if_done(found);
}

}  // namespace firstlook::sim::ur
