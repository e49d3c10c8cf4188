/// The master of one CiA 401 node with digital inputs and outputs: brings it up, watches it, brings it up again.
/// CiA 301 (communication), CiA 401 (device profile of generic I/O modules).
#pragma once

#include <array>
#include <cstdint>
#include <utility>

#include "hal/can/can_socket.hpp"
#include "hal/can/canopen.hpp"
#include "hal/can/node_setup.hpp"
#include "platform/core/fixed_vector.hpp"
#include "platform/core/time.hpp"

namespace firstlook::can {

/// Where the node is on its way. kOperational alone means that inputs and outputs can be relied on.
enum class NodeStep : std::uint8_t {
  kNoBus,         ///< no CAN, no interface, or it is down: RemoteIo::bus_trouble()
  kBusOff,        ///< the controller left the bus after too many errors
  kAwaitingBoot,  ///< reset was sent, nothing came back so far
  kConfiguring,   ///< identity is asked for, objects are written
  kStarting,      ///< start was sent, neither a heartbeat of an operational node nor its inputs came so far
  kOperational,
  kRefused,  ///< another device than expected, or one that refuses its configuration: RemoteIo::refusal()
};

/// Why an operational node was lost.
enum class LossCause : std::uint8_t { kNone, kHeartbeat, kRestarted, kLeftOperational, kBusOff, kInterface };

/// Why a node is not used.
struct Refusal {
  enum class Kind : std::uint8_t { kNone, kDeviceType, kVendor, kProduct, kMapping, kAborted, kSilent };
  Kind kind = Kind::kNone;
  ObjectAddress address;
  std::uint32_t found = 0;     ///< the value, or the abort code
  std::uint32_t expected = 0;  ///< the value
};

struct RemoteIoCounters {
  std::uint64_t frames_in = 0, frames_out = 0;
  std::uint64_t losses = 0;         ///< of an operational node, whatever the cause
  std::uint64_t node_restarts = 0;  ///< boot-up messages that nobody asked for
  std::uint64_t bus_off = 0, error_passive = 0, bus_errors = 0, overflows = 0, unacknowledged = 0;
  std::uint64_t interface_losses = 0;
  std::uint64_t sdo_timeouts = 0, sdo_aborts = 0;
  std::uint64_t emergencies = 0;
  std::uint64_t sends_put_off = 0;  ///< there was no room in the queue
};

/// A change of the inputs as it was received.
struct InputReport {
  Instant stamp{};
  std::uint64_t bits = 0;
  bool first = false;  ///< since the node became operational: a state, not a change
};

/// Loop thread. Nothing blocks or allocates after construction.
class RemoteIo {
 public:
  RemoteIo(SystemCalls& system, const RemoteIoOptions& options);

  /// Receives what waits, answers, keeps the times. Reports of inputs are then in inputs() until the next call.
  void turn(Instant now);
  [[nodiscard]] const auto& inputs() const { return inputs_; }
  /// True once after each loss of an operational node.
  [[nodiscard]] bool take_loss() { return std::exchange(lost_, false); }

  /// Sends the outputs now if the node is operational, and again whenever it becomes so.
  void set_outputs(std::uint64_t bits, Instant now);

  [[nodiscard]] NodeStep step() const { return step_; }
  [[nodiscard]] bool operational() const { return step_ == NodeStep::kOperational; }
  [[nodiscard]] LossCause last_loss() const { return last_loss_; }
  [[nodiscard]] BusTrouble bus_trouble() const { return socket_.trouble(); }
  [[nodiscard]] int bus_error() const { return socket_.last_error(); }
  [[nodiscard]] const Refusal& refusal() const { return refusal_; }
  [[nodiscard]] const RemoteIoCounters& counters() const { return counters_; }
  [[nodiscard]] const RemoteIoOptions& options() const { return options_; }
  [[nodiscard]] bool error_passive() const { return error_passive_; }
  /// Number of another node that was heard while ours was silent; 0: none.
  [[nodiscard]] std::uint8_t other_node() const { return other_node_; }
  [[nodiscard]] bool reset_was_sent() const { return resets_ > 0; }
  [[nodiscard]] std::uint32_t resets() const { return resets_; }  ///< unanswered ones, of this silence
  /// False when the node refused to watch our heartbeat: then it keeps its outputs when we are gone.
  [[nodiscard]] bool watches_us() const { return watches_us_; }
  [[nodiscard]] std::uint32_t vendor() const { return vendor_; }
  [[nodiscard]] std::uint32_t product() const { return product_; }
  [[nodiscard]] std::uint16_t last_emergency() const { return last_emergency_; }
  [[nodiscard]] Instant last_heard() const { return heard_; }

 private:
  void open(Instant now);
  void reset(Instant now);
  void configure(Instant now);
  void ask(Instant now);
  void ask_inputs(Instant now);
  void next_setup(Instant now);
  void refuse(Instant now, const Refusal& refusal);
  void lose(LossCause cause);
  void leave(NodeStep step, LossCause cause);
  void become_operational(Instant now, std::uint64_t bits);

  void handle(const can_frame& frame, Instant now);
  void handle_error(const BusError& error, Instant now);
  void handle_heartbeat(const Heartbeat& heartbeat, Instant now);
  void handle_answer(const SdoAnswer& answer, Instant now);
  void handle_read(const SetupStep& setup, std::uint32_t value, Instant now);
  void keep_times(Instant now);
  void bus_lost(Instant now);
  bool send(const can_frame& frame, Instant now);

  RemoteIoOptions options_;
  std::array<can_filter, 4> filters_;
  CanSocket socket_;
  NodeSetup setups_;
  std::size_t setup_ = 0;
  bool asked_again_ = false;
  NodeStep step_ = NodeStep::kNoBus;
  bool lost_ = false;
  bool node_operational_ = false;  ///< by its heartbeat
  LossCause last_loss_ = LossCause::kNone;
  Refusal refusal_;
  RemoteIoCounters counters_;
  FixedVector<InputReport, 64> inputs_;
  std::uint8_t input_sub_ = 1;    ///< which byte is asked for after the start
  std::uint64_t input_bits_ = 0;  ///< those before it
  std::uint64_t outputs_ = 0;
  bool outputs_pending_ = false;
  bool error_passive_ = false;
  bool watches_us_ = true;
  std::uint8_t other_node_ = 0;
  std::uint32_t resets_ = 0;
  std::uint32_t vendor_ = 0, product_ = 0;
  std::uint16_t last_emergency_ = 0;
  Instant due_{};            ///< of what the step waits for
  Instant heard_{};          ///< the node's last heartbeat
  Instant our_heartbeat_{};  ///< the next one to send
  Instant outputs_refresh_{};
};

}  // namespace firstlook::can
