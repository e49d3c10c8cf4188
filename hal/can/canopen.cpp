#include "hal/can/canopen.hpp"

#include <linux/can/error.h>

#include <algorithm>
#include <array>

#include "platform/core/ensure.hpp"

namespace firstlook::can {
namespace {

constexpr std::uint8_t kSdoBytes = 8;

// Command specifiers of SDO, CiA 301 figures 8 and 10.
constexpr std::uint8_t kUploadRequest = 0x40;
constexpr std::uint8_t kDownloadRequest = 0x20;
constexpr std::uint8_t kDownloadAnswer = 0x60;
constexpr std::uint8_t kUploadAnswer = 0x40;
constexpr std::uint8_t kAbort = 0x80;
constexpr std::uint8_t kSpecifierMask = 0xE0;
constexpr std::uint8_t kExpedited = 0x02;
constexpr std::uint8_t kSizeGiven = 0x01;

can_frame frame_of(std::uint32_t id, std::uint8_t size) {
  can_frame frame{};
  frame.can_id = id;
  frame.len = size;
  return frame;
}

void put(can_frame& frame, std::size_t at, std::uint64_t value, std::size_t bytes) {
  for (std::size_t i = 0; i < bytes; ++i) frame.data[at + i] = static_cast<std::uint8_t>(value >> (8 * i));
}

std::uint64_t get(const can_frame& frame, std::size_t at, std::size_t bytes) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < bytes; ++i) value |= std::uint64_t{frame.data[at + i]} << (8 * i);
  return value;
}

can_frame sdo_frame(std::uint8_t node, std::uint8_t command, ObjectAddress address, std::uint32_t value) {
  can_frame frame = frame_of(kSdoRequestId + node, kSdoBytes);
  frame.data[0] = command;
  put(frame, 1, address.index, 2);
  frame.data[3] = address.sub;
  put(frame, 4, value, 4);
  return frame;
}

/// The node that a data frame with an 11-bit identifier of this function is of.
std::optional<std::uint8_t> node_of(const can_frame& frame, std::uint32_t function) {
  if ((frame.can_id & (CAN_EFF_FLAG | CAN_RTR_FLAG | CAN_ERR_FLAG)) != 0 || frame.len > CAN_MAX_DLEN) return {};
  const std::uint32_t id = frame.can_id & CAN_SFF_MASK;
  if (id <= function || id > function + kNodeMax) return {};
  return static_cast<std::uint8_t>(id - function);
}

struct AbortText {
  std::uint32_t code;
  std::string_view text;
};
constexpr AbortText kAbortTexts[] = {
    {0x05030000, "toggle bit not alternated"},
    {0x05040000, "SDO timed out"},
    {0x05040001, "command not valid"},
    {0x05040002, "block size not valid"},
    {0x05040005, "out of memory"},
    {0x06010000, "access not supported"},
    {0x06010001, "the entry can only be written"},
    {0x06010002, "the entry can only be read"},
    {0x06020000, "no such object"},
    {0x06040041, "the object cannot be mapped to the PDO"},
    {0x06040042, "the mapped objects exceed the PDO"},
    {0x06040043, "parameter incompatible"},
    {0x06040047, "internal incompatibility"},
    {0x06060000, "hardware error"},
    {0x06070010, "the length does not match"},
    {0x06070012, "the value is too long"},
    {0x06070013, "the value is too short"},
    {0x06090011, "no such sub-index"},
    {0x06090030, "value out of range"},
    {0x06090031, "value too high"},
    {0x06090032, "value too low"},
    {0x060A0023, "resource not available"},
    {0x08000000, "general error"},
    {0x08000020, "the value cannot be stored"},
    {0x08000021, "the value cannot be stored: local control"},
    {0x08000022, "the value cannot be stored in this state"},
    {0x08000023, "no object dictionary"},
    {0x08000024, "no data"},
};

}  // namespace

can_frame nmt_command(NmtCommand command, std::uint8_t node) {
  can_frame frame = frame_of(0, 2);
  frame.data[0] = static_cast<std::uint8_t>(command);
  frame.data[1] = node;
  return frame;
}

can_frame heartbeat_frame(const Heartbeat& heartbeat) {
  can_frame frame = frame_of(kHeartbeatId + heartbeat.node, 1);
  frame.data[0] = static_cast<std::uint8_t>(heartbeat.state);
  return frame;
}

std::optional<Heartbeat> read_heartbeat(const can_frame& frame) {
  const auto node = node_of(frame, kHeartbeatId);
  if (!node || frame.len != 1) return {};
  const auto state = static_cast<NmtState>(frame.data[0] & 0x7F);  // bit 7 toggles where a node is guarded
  switch (state) {
    case NmtState::kBootUp:
    case NmtState::kStopped:
    case NmtState::kOperational:
    case NmtState::kPreOperational:
      return Heartbeat{*node, state};
  }
  return {};
}

std::optional<Emergency> read_emergency(const can_frame& frame) {
  const auto node = node_of(frame, kEmergencyId);
  if (!node || frame.len < 3) return {};
  return Emergency{*node, static_cast<std::uint16_t>(get(frame, 0, 2)), frame.data[2]};
}

can_frame sdo_upload_request(std::uint8_t node, ObjectAddress address) {
  return sdo_frame(node, kUploadRequest, address, 0);
}

can_frame sdo_download_request(std::uint8_t node, ObjectAddress address, std::uint32_t value, std::uint8_t size) {
  ENSURE(5301, size >= 1 && size <= 4);
  const int unused = 4 - size;
  const auto command = static_cast<std::uint8_t>(kDownloadRequest | kExpedited | kSizeGiven | (unused << 2));
  const std::uint32_t kept = size == 4 ? value : value & ((1U << (8 * size)) - 1);
  return sdo_frame(node, command, address, kept);
}

can_frame sdo_abort_request(std::uint8_t node, ObjectAddress address, std::uint32_t code) {
  return sdo_frame(node, kAbort, address, code);
}

std::optional<SdoAnswer> read_sdo_answer(const can_frame& frame) {
  const auto node = node_of(frame, kSdoAnswerId);
  if (!node || frame.len != kSdoBytes) return {};
  SdoAnswer answer;
  answer.node = *node;
  answer.address = {static_cast<std::uint16_t>(get(frame, 1, 2)), frame.data[3]};
  const std::uint8_t command = frame.data[0];
  switch (command & kSpecifierMask) {
    case kAbort:
      answer.kind = SdoAnswer::Kind::kAborted;
      answer.value = static_cast<std::uint32_t>(get(frame, 4, 4));
      return answer;
    case kDownloadAnswer:
      answer.kind = SdoAnswer::Kind::kDownloaded;
      return answer;
    case kUploadAnswer:
      if ((command & kExpedited) == 0) {
        answer.kind = SdoAnswer::Kind::kSegmented;
        return answer;
      }
      answer.kind = SdoAnswer::Kind::kUploaded;
      answer.size = 4;
      if ((command & kSizeGiven) != 0) answer.size = static_cast<std::uint8_t>(4 - ((command >> 2) & 3));
      answer.value = static_cast<std::uint32_t>(get(frame, 4, answer.size));
      return answer;
    default:
      return {};
  }
}

std::string_view abort_text(std::uint32_t code) {
  const auto* const row = std::ranges::find(kAbortTexts, code, &AbortText::code);
  return row == std::end(kAbortTexts) ? std::string_view("reason of the manufacturer's own") : row->text;
}

can_frame pdo_frame(std::uint32_t function, std::uint8_t node, std::uint64_t bits, std::uint8_t bytes) {
  ENSURE(5302, bytes >= 1 && bytes <= CAN_MAX_DLEN);
  can_frame frame = frame_of(function + node, bytes);
  put(frame, 0, bits, bytes);
  return frame;
}

std::optional<std::uint64_t> read_pdo(const can_frame& frame, std::uint32_t function, std::uint8_t node,
                                      std::uint8_t bytes) {
  if (node_of(frame, function) != node || frame.len < bytes) return {};
  return get(frame, 0, bytes);
}

std::optional<BusError> read_bus_error(const can_frame& frame) {
  if ((frame.can_id & CAN_ERR_FLAG) == 0) return {};
  const auto has = [&](std::uint32_t kind) { return (frame.can_id & kind) != 0; };
  BusError error;
  error.bus_off = has(CAN_ERR_BUSOFF);
  error.restarted = has(CAN_ERR_RESTARTED);
  error.unacknowledged = has(CAN_ERR_ACK);
  error.protocol = has(CAN_ERR_PROT);
  if (has(CAN_ERR_CRTL)) {
    const std::uint8_t state = frame.data[1];
    error.passive = (state & (CAN_ERR_CRTL_RX_PASSIVE | CAN_ERR_CRTL_TX_PASSIVE)) != 0;
    error.active = (state & CAN_ERR_CRTL_ACTIVE) != 0;
    error.overflow = (state & (CAN_ERR_CRTL_RX_OVERFLOW | CAN_ERR_CRTL_TX_OVERFLOW)) != 0;
  }
  return error;
}

}  // namespace firstlook::can
