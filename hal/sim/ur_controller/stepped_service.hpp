/// A simulated controller whose time somebody else keeps: the byte streams to it and from it, in turns.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "hal/sim/ur_controller/happenings.hpp"
#include "hal/sim/ur_controller/simulated_ur.hpp"
#include "hal/sim/ur_controller/wire.hpp"
#include "platform/core/result.hpp"

namespace firstlook::sim::ur {

// What a turn is made of, big-endian. Links that the client dials have numbers below kScriptLinks, those that scripts
// dial the others; a number is free again when both sides have closed it.
inline constexpr std::uint8_t kScriptLinks = 128;
/// Asked: what to do, in this order; kStepTo is the last.
enum class Ask : std::uint8_t {
  kBegin = 'Z',   ///< the time of the turns is 0 now, and what is to happen to the robot counts from here
  kDial = 'D',    ///< u8 link, u16 port (Port)
  kAccept = 'K',  ///< u8 link, of a script
  kSend = 'S',    ///< u8 link, u32 count, bytes
  kClose = 'C',   ///< u8 link
  kStepTo = 'A',  ///< u64 ns: the controller runs until then
};
/// Told: what came of it; kReached is the last, with when there can be more.
enum class Tell : std::uint8_t {
  kOpen = 'O',     ///< u8 link
  kDialled = 'I',  ///< u8 link, u16 port: a script dials
  kCame = 'B',     ///< u8 link, u32 count, bytes
  kEnded = 'E',    ///< u8 link: closed over there, and all bytes have come
  kReached = '.',  ///< u64 ns: the end of the next control cycle
};

/// Deterministic: the same turns get the same answers, in process or in two.
class SteppedService final : public script::Sockets {
 public:
  /// @param timetable  what happens to the robot, on the time of the turns
  SteppedService(SimulatedUr& robot, Timetable timetable);
  ~SteppedService() override;
  SteppedService(const SteppedService&) = delete;
  SteppedService& operator=(const SteppedService&) = delete;

  /// One turn: appends the answer. Error: kDataMalformed for what is no turn.
  [[nodiscard]] Status turn(std::string_view asked, std::string& told);
  /// The client is gone, and its side of every link with it.
  void hang_up();

  // Sockets of the controller's scripts.
  Id open(const std::string& host, std::uint16_t port) override;
  [[nodiscard]] State state(Id socket) const override;
  bool send(Id socket, std::string_view bytes) override;
  std::string& received(Id socket) override;
  void close(Id socket) override;

 private:
  static constexpr std::uint64_t kStepMax_ns = 1'000'000'000'000'000;  // eleven days

  struct Link {
    std::optional<Port> dialled;  ///< by the client; empty: a script dialled `port`
    Session* session = nullptr;   ///< once the controller has answered
    std::uint16_t port = 0;
    std::string to_script, out;
    bool announced = false;  ///< to the client: that it is open, or that a script dials
    bool accepted = false;   ///< by the client, of a script's
    bool closed_here = false, closed_there = false, end_told = false;
    [[nodiscard]] bool is_truth() const { return dialled == Port::kTruth; }
  };
  using Links = std::map<std::uint8_t, Link>;

  [[nodiscard]] bool act(Ask what, WireReader& wire);
  void hear(Link& link, std::string_view bytes);
  void step_to(Instant until);
  void tell(std::string& told);
  void drop_if_done(Links::iterator link);

  SimulatedUr& robot_;
  Timetable timetable_;
  std::size_t next_ = 0;
  bool begun_ = false;
  Instant time_{};
  Links links_;
};

}  // namespace firstlook::sim::ur
