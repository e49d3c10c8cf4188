#include "hal/can/node_setup.hpp"

namespace firstlook::can {
namespace {

// Objects of CiA 301.
constexpr ObjectAddress kProducerHeartbeat{0x1017, 0};
constexpr std::uint16_t kReceivePdoParameters = 0x1400;
constexpr std::uint16_t kReceivePdoMapping = 0x1600;
constexpr std::uint16_t kTransmitPdoParameters = 0x1800;
constexpr std::uint16_t kTransmitPdoMapping = 0x1A00;
constexpr std::uint32_t kPdoOff = 0x80000000;
constexpr std::uint32_t kPdoNoRemote = 0x40000000;  // nobody may ask for it
constexpr std::uint32_t kPdoOnChange = 255;         // transmission type: event driven, by the device profile
constexpr std::uint32_t kPdoAtLeastEvery_ms = 250;  // event timer: a lost frame is made good

// Objects of CiA 401.
constexpr ObjectAddress kInputInterrupt{0x6005, 0};
constexpr std::uint16_t kOutputs = 0x6200;
constexpr std::uint16_t kOutputErrorMode = 0x6206;
constexpr std::uint16_t kOutputErrorValue = 0x6207;
constexpr std::uint32_t kWatchUs_ms = 500;  // five of our heartbeats

/// A PDO is mapped while it is off (CiA 301, 7.5.2.36). A node whose mapping is fixed refuses that; what counts is that
/// the mapping is the one we need, which is read back.
void add_pdo(NodeSetup& setup, std::uint8_t node, std::uint16_t parameters, std::uint16_t mapping,
             std::uint32_t function, std::uint16_t object, std::uint8_t bytes) {
  using Kind = SetupStep::Kind;
  const std::uint32_t id = kPdoNoRemote | (function + node);
  setup.push_back({Kind::kTryWrite, {parameters, 1}, kPdoOff | id, 4});
  setup.push_back({Kind::kTryWrite, {parameters, 2}, kPdoOnChange, 1});
  if (parameters == kTransmitPdoParameters) {
    setup.push_back({Kind::kTryWrite, {parameters, 5}, kPdoAtLeastEvery_ms, 2});
  }
  setup.push_back({Kind::kTryWrite, {mapping, 0}, 0, 1});
  const auto entry = [&](std::uint8_t i) { return std::uint32_t{object} << 16 | (i + 1U) << 8 | 8U; };
  const auto sub = [](std::uint8_t i) { return static_cast<std::uint8_t>(i + 1); };
  for (std::uint8_t i = 0; i < bytes; ++i) setup.push_back({Kind::kTryWrite, {mapping, sub(i)}, entry(i), 4});
  setup.push_back({Kind::kTryWrite, {mapping, 0}, bytes, 1});
  for (std::uint8_t i = 0; i < bytes; ++i) setup.push_back({Kind::kExpect, {mapping, sub(i)}, entry(i), 4});
  setup.push_back({Kind::kWrite, {parameters, 1}, id, 4});
}

}  // namespace

NodeSetup node_setup(const RemoteIoOptions& options) {
  NodeSetup setup;
  using Kind = SetupStep::Kind;
  setup.push_back({Kind::kRead, kDeviceTypeObject, 0, 4});
  setup.push_back({Kind::kRead, kVendorObject, 0, 4});
  setup.push_back({Kind::kRead, kProductObject, 0, 4});
  const auto period_ms = static_cast<std::uint32_t>(options.heartbeat.ns / 1'000'000);
  setup.push_back({Kind::kWrite, kProducerHeartbeat, period_ms, 2});
  setup.push_back({Kind::kTryWrite, kConsumerHeartbeatObject, std::uint32_t{options.master} << 16 | kWatchUs_ms, 4});
  for (std::uint8_t i = 0; i < options.output_bytes; ++i) {
    const auto sub = static_cast<std::uint8_t>(i + 1);
    setup.push_back({Kind::kTryWrite, {kOutputErrorMode, sub}, 0xFF, 1});
    const auto value = static_cast<std::uint32_t>(options.fault_outputs >> (8 * i)) & 0xFF;
    setup.push_back({Kind::kTryWrite, {kOutputErrorValue, sub}, value, 1});
  }
  add_pdo(setup, options.node, kTransmitPdoParameters, kTransmitPdoMapping, kTransmitPdo1Id, kInputsObject,
          options.input_bytes);
  add_pdo(setup, options.node, kReceivePdoParameters, kReceivePdoMapping, kReceivePdo1Id, kOutputs,
          options.output_bytes);
  setup.push_back({Kind::kTryWrite, kInputInterrupt, 1, 1});
  return setup;
}

}  // namespace firstlook::can
