#include "hal/can/remote_io.hpp"

#include <algorithm>

namespace firstlook::can {
namespace {

constexpr std::uint32_t kProfile = 401;
constexpr std::uint32_t kProfileMask = 0xFFFF;
constexpr std::size_t kFramesPerTurn = 64;
constexpr Duration kOutputsRefresh = milliseconds(1000);
constexpr Duration kRefusedRetry = milliseconds(5000);

}  // namespace

RemoteIo::RemoteIo(SystemCalls& system, const RemoteIoOptions& options)
    : options_(options),
      filters_{{{kEmergencyId + options.node, CAN_SFF_MASK | CAN_EFF_FLAG | CAN_RTR_FLAG},
                {kTransmitPdo1Id + options.node, CAN_SFF_MASK | CAN_EFF_FLAG | CAN_RTR_FLAG},
                {kSdoAnswerId + options.node, CAN_SFF_MASK | CAN_EFF_FLAG | CAN_RTR_FLAG},
                // Heartbeats of all nodes: one with another number than expected is worth telling.
                {kHeartbeatId, 0x780 | CAN_EFF_FLAG | CAN_RTR_FLAG}}},
      socket_(system, options_.interface, filters_),
      setups_(node_setup(options)) {}

bool RemoteIo::send(const can_frame& frame, Instant now) {
  switch (socket_.send(frame)) {
    case CanSocket::Sent::kYes:
      ++counters_.frames_out;
      return true;
    case CanSocket::Sent::kNoRoom:
      ++counters_.sends_put_off;
      return false;
    case CanSocket::Sent::kBroken:
      bus_lost(now);
      return false;
  }
  return false;
}

void RemoteIo::bus_lost(Instant now) {
  if (step_ != NodeStep::kNoBus) ++counters_.interface_losses;
  leave(NodeStep::kNoBus, LossCause::kInterface);
  due_ = now + options_.reopen;
}

void RemoteIo::leave(NodeStep step, LossCause cause) {
  if (step_ == NodeStep::kOperational) lose(cause);
  step_ = step;
  node_operational_ = false;
}

void RemoteIo::lose(LossCause cause) {
  ++counters_.losses;
  last_loss_ = cause;
  lost_ = true;
}

void RemoteIo::open(Instant now) {
  if (socket_.open() != BusTrouble::kNone) {
    due_ = now + options_.reopen;
    return;
  }
  error_passive_ = false;
  our_heartbeat_ = now;
  resets_ = 0;
  other_node_ = 0;
  reset(now);
}

void RemoteIo::reset(Instant now) {
  step_ = NodeStep::kAwaitingBoot;
  node_operational_ = false;
  due_ = now + options_.boot_timeout;
  if (send(nmt_command(NmtCommand::kResetCommunication, options_.node), now)) ++resets_;
}

void RemoteIo::configure(Instant now) {
  step_ = NodeStep::kConfiguring;
  node_operational_ = false;
  setup_ = 0;
  asked_again_ = false;
  watches_us_ = true;
  resets_ = 0;
  other_node_ = 0;
  refusal_ = {};
  ask(now);
}

void RemoteIo::ask(Instant now) {
  due_ = now + options_.sdo_timeout;
  const SetupStep& setup = setups_[setup_];
  const bool reads = setup.kind == SetupStep::Kind::kRead || setup.kind == SetupStep::Kind::kExpect;
  // A frame that finds no room is asked again when its time is over.
  (void)send(reads ? sdo_upload_request(options_.node, setup.address)
                   : sdo_download_request(options_.node, setup.address, setup.value, setup.size),
             now);
}

void RemoteIo::ask_inputs(Instant now) {
  due_ = now + options_.sdo_timeout;
  (void)send(sdo_upload_request(options_.node, {kInputsObject, input_sub_}), now);
}

void RemoteIo::next_setup(Instant now) {
  asked_again_ = false;
  if (++setup_ < setups_.size()) {
    ask(now);
    return;
  }
  step_ = NodeStep::kStarting;
  heard_ = now;
  due_ = now + options_.sdo_timeout;
  (void)send(nmt_command(NmtCommand::kStart, options_.node), now);
}

void RemoteIo::refuse(Instant now, const Refusal& refusal) {
  leave(NodeStep::kRefused, LossCause::kNone);
  refusal_ = refusal;
  due_ = now + kRefusedRetry;
}

void RemoteIo::become_operational(Instant now, std::uint64_t bits) {
  step_ = NodeStep::kOperational;
  inputs_.push_back({now, bits, true});
  outputs_pending_ = true;
}

void RemoteIo::set_outputs(std::uint64_t bits, Instant now) {
  outputs_ = bits;
  outputs_pending_ = true;
  outputs_refresh_ = now;
}

void RemoteIo::turn(Instant now) {
  inputs_.clear();
  if (!socket_.is_open()) {
    if (now >= due_) open(now);
    if (!socket_.is_open()) return;
  }
  for (std::size_t i = 0; i < kFramesPerTurn && !inputs_.full(); ++i) {
    const auto frame = socket_.receive();
    if (!frame) break;
    ++counters_.frames_in;
    handle(*frame, now);
  }
  if (!socket_.is_open()) {
    bus_lost(now);
    return;
  }
  keep_times(now);
}

void RemoteIo::handle(const can_frame& frame, Instant now) {
  if (const auto error = read_bus_error(frame)) {
    handle_error(*error, now);
    return;
  }
  if (step_ == NodeStep::kBusOff) {  // a frame came through: the controller is back
    step_ = NodeStep::kAwaitingBoot;
    due_ = now;
  }
  if (const auto heartbeat = read_heartbeat(frame)) {
    handle_heartbeat(*heartbeat, now);
  } else if (const auto answer = read_sdo_answer(frame); answer && answer->node == options_.node) {
    handle_answer(*answer, now);
  } else if (const auto bits = read_pdo(frame, kTransmitPdo1Id, options_.node, options_.input_bytes)) {
    if (step_ == NodeStep::kOperational) {
      inputs_.push_back({now, *bits, false});
    } else if (step_ == NodeStep::kStarting && node_operational_) {
      become_operational(now, *bits);
    }
  } else if (const auto emergency = read_emergency(frame); emergency && emergency->node == options_.node) {
    ++counters_.emergencies;
    last_emergency_ = emergency->code;
  }
}

void RemoteIo::handle_error(const BusError& error, Instant now) {
  counters_.bus_errors += error.protocol ? 1 : 0;
  counters_.overflows += error.overflow ? 1 : 0;
  counters_.unacknowledged += error.unacknowledged ? 1 : 0;
  if (error.passive) {
    if (!error_passive_) ++counters_.error_passive;
    error_passive_ = true;
  }
  if (error.active) error_passive_ = false;
  if (error.bus_off && step_ != NodeStep::kBusOff) {
    ++counters_.bus_off;
    leave(NodeStep::kBusOff, LossCause::kBusOff);
    due_ = now + options_.boot_timeout;
  }
  if (error.restarted && step_ == NodeStep::kBusOff) {
    error_passive_ = false;
    reset(now);
  }
}

void RemoteIo::handle_heartbeat(const Heartbeat& heartbeat, Instant now) {
  if (heartbeat.node != options_.node) {
    if (heartbeat.node != options_.master && step_ == NodeStep::kAwaitingBoot) other_node_ = heartbeat.node;
    return;
  }
  heard_ = now;
  error_passive_ = false;
  const bool booted = heartbeat.state == NmtState::kBootUp;
  switch (step_) {
    case NodeStep::kAwaitingBoot:
      if (booted) configure(now);
      break;
    case NodeStep::kConfiguring:
    case NodeStep::kStarting:
    case NodeStep::kRefused:
      if (booted) {
        ++counters_.node_restarts;
        configure(now);
      } else if (step_ == NodeStep::kStarting && heartbeat.state == NmtState::kOperational && !node_operational_) {
        node_operational_ = true;
        input_sub_ = 1;
        input_bits_ = 0;
        ask_inputs(now);
      }
      break;
    case NodeStep::kOperational:
      if (booted) {
        ++counters_.node_restarts;
        lose(LossCause::kRestarted);
        configure(now);
      } else if (heartbeat.state != NmtState::kOperational) {
        lose(LossCause::kLeftOperational);
        reset(now);
      }
      break;
    case NodeStep::kNoBus:
    case NodeStep::kBusOff:
      break;
  }
}

void RemoteIo::handle_answer(const SdoAnswer& answer, Instant now) {
  if (answer.kind == SdoAnswer::Kind::kAborted) ++counters_.sdo_aborts;
  if (step_ == NodeStep::kStarting) {
    if (answer.kind != SdoAnswer::Kind::kUploaded || answer.address != ObjectAddress{kInputsObject, input_sub_}) return;
    input_bits_ |= std::uint64_t{answer.value & 0xFF} << (8 * (input_sub_ - 1));
    if (input_sub_ == options_.input_bytes) {
      become_operational(now, input_bits_);
    } else {
      ++input_sub_;
      ask_inputs(now);
    }
    return;
  }
  if (step_ != NodeStep::kConfiguring) return;
  const SetupStep& setup = setups_[setup_];
  if (answer.address != setup.address) return;  // late, to a question before
  const bool reads = setup.kind == SetupStep::Kind::kRead || setup.kind == SetupStep::Kind::kExpect;
  switch (answer.kind) {
    case SdoAnswer::Kind::kUploaded:
      if (reads) handle_read(setup, answer.value, now);
      break;
    case SdoAnswer::Kind::kDownloaded:
      if (!reads) next_setup(now);
      break;
    case SdoAnswer::Kind::kSegmented:
      (void)send(sdo_abort_request(options_.node, answer.address, kAbortTimedOut), now);
      refuse(now, {Refusal::Kind::kAborted, setup.address, kAbortTimedOut, 0});
      break;
    case SdoAnswer::Kind::kAborted:
      if (setup.address == kConsumerHeartbeatObject) watches_us_ = false;
      // The product code is not mandatory (CiA 301, 7.5.2.18): its absence matters only where one is expected.
      if (setup.kind == SetupStep::Kind::kTryWrite || (setup.address == kProductObject && options_.product == 0)) {
        next_setup(now);
      } else {
        refuse(now, {Refusal::Kind::kAborted, setup.address, answer.value, 0});
      }
      break;
  }
}

void RemoteIo::handle_read(const SetupStep& setup, std::uint32_t value, Instant now) {
  if (setup.kind == SetupStep::Kind::kExpect) {
    if (value == setup.value) {
      next_setup(now);
    } else {
      refuse(now, {Refusal::Kind::kMapping, setup.address, value, setup.value});
    }
    return;
  }
  if (setup.address == kDeviceTypeObject && (value & kProfileMask) != kProfile) {
    refuse(now, {Refusal::Kind::kDeviceType, setup.address, value, kProfile});
    return;
  }
  if (setup.address == kVendorObject) {
    vendor_ = value;
    if (options_.vendor != 0 && value != options_.vendor) {
      refuse(now, {Refusal::Kind::kVendor, setup.address, value, options_.vendor});
      return;
    }
  }
  if (setup.address == kProductObject) {
    product_ = value;
    if (options_.product != 0 && value != options_.product) {
      refuse(now, {Refusal::Kind::kProduct, setup.address, value, options_.product});
      return;
    }
  }
  next_setup(now);
}

void RemoteIo::keep_times(Instant now) {
  if (now >= our_heartbeat_ && step_ != NodeStep::kBusOff) {
    our_heartbeat_ = now + options_.heartbeat;
    if (!send(heartbeat_frame({options_.master, NmtState::kOperational}), now) && !socket_.is_open()) return;
  }
  switch (step_) {
    case NodeStep::kAwaitingBoot:
    case NodeStep::kRefused:
      if (now >= due_) reset(now);
      break;
    case NodeStep::kConfiguring:
      if (now < due_) break;
      ++counters_.sdo_timeouts;
      if (asked_again_) {
        refuse(now, {Refusal::Kind::kSilent, setups_[setup_].address, 0, 0});
      } else {
        asked_again_ = true;
        ask(now);
      }
      break;
    case NodeStep::kStarting:
      if (now - heard_ > options_.heartbeat_timeout + options_.sdo_timeout) {
        reset(now);
      } else if (now >= due_) {
        ++counters_.sdo_timeouts;
        if (node_operational_) {
          ask_inputs(now);
        } else {
          due_ = now + options_.sdo_timeout;
          (void)send(nmt_command(NmtCommand::kStart, options_.node), now);
        }
      }
      break;
    case NodeStep::kOperational:
      if (now - heard_ > options_.heartbeat_timeout) {
        lose(LossCause::kHeartbeat);
        reset(now);
        break;
      }
      if (outputs_pending_ || now >= outputs_refresh_) {
        outputs_pending_ = !send(pdo_frame(kReceivePdo1Id, options_.node, outputs_, options_.output_bytes), now);
        outputs_refresh_ = now + kOutputsRefresh;
      }
      break;
    case NodeStep::kBusOff:
      // It may have been restarted without our hearing of it, and the node waits for its reset.
      if (now >= due_) {
        due_ = now + options_.boot_timeout;
        (void)send(nmt_command(NmtCommand::kResetCommunication, options_.node), now);
      }
      break;
    case NodeStep::kNoBus:
      break;
  }
}

}  // namespace firstlook::can
