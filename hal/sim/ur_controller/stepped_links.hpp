/// A client's side of a controller whose time the client keeps: byte streams that carry in turns.
#pragma once

#include <functional>
#include <map>
#include <span>
#include <string>
#include <string_view>

#include "hal/sim/ur_controller/simulated_ur.hpp"
#include "platform/core/result.hpp"
#include "platform/core/time.hpp"

namespace firstlook::sim::ur {

/// Takes a turn to a SteppedService (its header has the words) and brings the answer.
using TakeTurn = std::function<Status(std::string_view asked, std::string& told)>;

/// What is sent arrives, and what arrives is read, at `step_to`. All from one thread; what is allocated counts as the
/// simulation's.
class SteppedLinks {
 public:
  enum class State : std::uint8_t { kClosed, kConnecting, kOpen };
  using Id = int;
  static constexpr Id kNone = -1;

  explicit SteppedLinks(TakeTurn turn) : turn_(std::move(turn)) {}

  /// The time is 0 now.
  void begin();
  /// Lets the controller run until then; an instant that is not later than the last changes nothing.
  void step_to(Instant now);
  [[nodiscard]] Instant now() const { return time_; }
  /// When something can come next: not before the controller's next cycle has ended.
  [[nodiscard]] Instant next_cycle() const { return next_cycle_; }
  /// Why turns are no longer taken.
  [[nodiscard]] const Status& health() const { return health_; }

  [[nodiscard]] Id dial(Port port);
  /// Who dials that port of ours next.
  [[nodiscard]] Id accept(std::uint16_t port);
  [[nodiscard]] State state(Id link) const;
  [[nodiscard]] std::string_view receive(Id link, std::span<char> room);
  /// False: closed.
  bool send(Id link, std::string_view bytes);
  void close(Id link);

 private:
  struct Link {
    State state = State::kConnecting;
    std::uint16_t port = 0;  ///< of ours, that a script dials and nobody has accepted
    std::string inbox;
  };
  void ask(std::uint8_t what, Id link);
  [[nodiscard]] Status read(std::string_view told);

  TakeTurn turn_;
  Status health_;
  Instant time_{}, next_cycle_{};
  std::string asked_, told_;
  std::map<Id, Link> links_;
};

}  // namespace firstlook::sim::ur
