/// The driver's network in memory: on the other side a simulated controller, whose time passes as the test says.
#pragma once

#include <array>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "hal/sim/ur_controller/simulated_ur.hpp"
#include "hal/ur/network.hpp"
#include "platform/core/time.hpp"

namespace firstlook::test {

class UrMemoryNetwork final : public ur::Network, public sim::ur::script::Sockets {
 public:
  static constexpr std::uint16_t kProgramPort = 50002, kControlPort = 50001;

  explicit UrMemoryNetwork(sim::ur::SimulatedUr& robot) : robot_(robot) { robot_.programs().set_sockets(this); }
  ~UrMemoryNetwork() override { robot_.programs().set_sockets(nullptr); }
  UrMemoryNetwork(const UrMemoryNetwork&) = delete;
  UrMemoryNetwork& operator=(const UrMemoryNetwork&) = delete;

  /// Lets the controller run up to `now`.
  void advance(Instant now) {
    while (time_ + robot_.cycle() <= now) {
      robot_.step();
      time_ = time_ + robot_.cycle();
      if (time_ < stalled_until_) continue;
      for (Pipe& pipe : pipes_) {
        pipe.to_script += pipe.held;
        pipe.held.clear();
      }
    }
  }
  /// The cable: nothing gets through while it is out, and nothing that was sent then comes later.
  void plug(bool in) { plugged_ = in; }
  /// For so long everything is delayed, then it comes at once.
  void stall(double s) { stalled_until_ = time_ + seconds(s); }
  /// What we send next on a connection with the program arrives so: without some of its bytes, twice, or changed.
  enum class Damage : std::uint8_t { kNone, kCut, kTwice, kChanged };
  void damage_next(Damage damage) { damage_ = damage; }
  /// The connections with the program carry nothing any more, and neither side is told.
  void half_open() {
    for (Pipe& pipe : pipes_) pipe.dead = true;
  }
  /// Ends the connection of the program for commands, on our side only: the program finds it closed.
  void break_control() {
    for (Pipe& pipe : pipes_) {
      if (pipe.port == kControlPort) pipe.closed_by_us = pipe.closed_by_script = true;
    }
  }
  /// The controller hangs up on all its clients; its program's connections stay.
  void break_sessions() {
    for (const Slot& slot : slots_) {
      if (slot.session != nullptr) slot.session->cut_off();
    }
  }
  [[nodiscard]] int links_open() const {
    int count = 0;
    for (const Slot& slot : slots_) count += slot.kind != Slot::Kind::kFree;
    return count;
  }
  /// What the program was sent on connections for commands, and did not read yet.
  [[nodiscard]] std::size_t unread_by_program() const {
    std::size_t bytes = 0;
    for (const Pipe& pipe : pipes_) bytes += pipe.to_script.size();
    return bytes;
  }

  // ur::Network
  ur::LinkId dial(ur::Service service) override {
    const sim::ur::Port port = service == ur::Service::kRtde        ? sim::ur::Port::kRtde
                               : service == ur::Service::kDashboard ? sim::ur::Port::kDashboard
                                                                    : sim::ur::Port::kPrimary;
    const ur::LinkId link = free_slot();
    if (link != ur::kNoLink)
      slots_[at(link)] = {Slot::Kind::kSession, plugged_ && robot_.serves(port) ? &robot_.open(port) : nullptr, 0};
    return link;
  }
  ur::LinkId accept(ur::Door door) override {
    const std::uint16_t port = door == ur::Door::kProgram ? kProgramPort : kControlPort;
    for (std::size_t i = 0; i < pipes_.size(); ++i) {
      if (pipes_[i].port != port || pipes_[i].accepted || !plugged_) continue;
      const ur::LinkId link = free_slot();
      if (link == ur::kNoLink) return link;
      pipes_[i].accepted = true;
      slots_[at(link)] = {Slot::Kind::kPipe, nullptr, i};
      return link;
    }
    return ur::kNoLink;
  }
  ur::LinkState state(ur::LinkId link) override {
    const Slot& slot = slots_[at(link)];
    if (slot.kind == Slot::Kind::kSession) {
      if (slot.session == nullptr) return ur::LinkState::kConnecting;
      return slot.session->over() && slot.session->output().empty() ? ur::LinkState::kClosed : ur::LinkState::kOpen;
    }
    const Pipe& pipe = pipes_[slot.pipe];
    const bool ended = pipe.closed_by_us || (plugged_ && pipe.closed_by_script && pipe.to_us.empty());
    return ended ? ur::LinkState::kClosed : ur::LinkState::kOpen;
  }
  std::string_view receive(ur::LinkId link, std::span<char> room) override {
    const Slot& slot = slots_[at(link)];
    std::string* bytes = slot.kind == Slot::Kind::kPipe ? &pipes_[slot.pipe].to_us
                         : slot.session != nullptr      ? &slot.session->output()
                                                        : nullptr;
    if (bytes == nullptr || time_ < stalled_until_) return {};
    if (!plugged_ || (slot.kind == Slot::Kind::kPipe && pipes_[slot.pipe].dead)) {
      bytes->clear();
      return {};
    }
    const std::size_t count = std::min(room.size(), bytes->size());
    std::copy_n(bytes->begin(), count, room.begin());
    bytes->erase(0, count);
    return {room.data(), count};
  }
  bool send(ur::LinkId link, std::string_view bytes) override {
    const Slot& slot = slots_[at(link)];
    if (state(link) != ur::LinkState::kOpen) return false;
    if (!plugged_) return true;
    if (slot.kind == Slot::Kind::kSession) {
      slot.session->receive(bytes);
    } else {
      Pipe& pipe = pipes_[slot.pipe];
      if (!pipe.dead) (time_ < stalled_until_ ? pipe.held : pipe.to_script).append(damaged(bytes));
    }
    return true;
  }
  void close(ur::LinkId link) override {
    Slot& slot = slots_[at(link)];
    if (slot.kind == Slot::Kind::kSession && slot.session != nullptr) robot_.close(*slot.session);
    if (slot.kind == Slot::Kind::kPipe) pipes_[slot.pipe].closed_by_us = true;
    slot = {};
  }

  // Sockets of the controller's scripts.
  Id open(const std::string&, std::uint16_t port) override {
    if (!plugged_ || (port != kProgramPort && port != kControlPort)) return 0;
    pipes_.push_back({});
    pipes_.back().port = port;
    return pipes_.size();
  }
  State state(Id socket) const override { return script_state(socket); }
  bool send(Id socket, std::string_view bytes) override {
    if (script_state(socket) != State::kOpen) return false;
    if (plugged_ && !pipes_[socket - 1].dead) pipes_[socket - 1].to_us.append(bytes);
    return true;
  }
  std::string& received(Id socket) override { return pipes_[socket - 1].to_script; }
  void close(Id socket) override { pipes_[socket - 1].closed_by_script = true; }

 private:
  struct Pipe {
    std::uint16_t port = 0;
    std::string to_script, held, to_us;
    bool dead = false;
    bool accepted = false, closed_by_script = false, closed_by_us = false;
  };
  struct Slot {
    enum class Kind : std::uint8_t { kFree, kSession, kPipe } kind = Kind::kFree;
    sim::ur::Session* session = nullptr;
    std::size_t pipe = 0;
  };
  std::string damaged(std::string_view bytes) {
    std::string result(bytes);
    switch (std::exchange(damage_, Damage::kNone)) {
      case Damage::kNone:
        break;
      case Damage::kCut:
        result.resize(result.size() / 2);
        break;
      case Damage::kTwice:
        result += result;
        break;
      case Damage::kChanged:
        result[result.size() / 2 + 2] = static_cast<char>(result[result.size() / 2 + 2] ^ 0x55);  // some 20 mrad
        break;
    }
    return result;
  }
  static std::size_t at(ur::LinkId link) { return static_cast<std::size_t>(link); }
  [[nodiscard]] State script_state(Id socket) const {
    const Pipe& pipe = pipes_[socket - 1];
    if (pipe.closed_by_script || (plugged_ && pipe.closed_by_us)) return State::kClosed;
    return pipe.accepted ? State::kOpen : State::kConnecting;
  }
  [[nodiscard]] ur::LinkId free_slot() const {
    for (std::size_t i = 0; i < slots_.size(); ++i) {
      if (slots_[i].kind == Slot::Kind::kFree) return static_cast<ur::LinkId>(i);
    }
    return ur::kNoLink;
  }

  sim::ur::SimulatedUr& robot_;
  Instant time_{};
  bool plugged_ = true;
  Instant stalled_until_{};
  Damage damage_ = Damage::kNone;
  std::array<Slot, ur::kLinksMax> slots_{};
  std::vector<Pipe> pipes_;
};

}  // namespace firstlook::test
