/// What a module is asked and told on its way to work: a list, made from the options. Pure.
#pragma once

#include <cstdint>
#include <string>

#include "hal/can/canopen.hpp"
#include "platform/core/fixed_vector.hpp"
#include "platform/core/time.hpp"

namespace firstlook::can {

struct RemoteIoOptions {
  std::string interface = "can0";
  std::uint8_t node = 10;
  std::uint8_t master = 127;        ///< our own number: our heartbeat is sent under it
  std::uint8_t input_bytes = 1;     ///< 1 to 8
  std::uint8_t output_bytes = 1;    ///< 1 to 8
  std::uint32_t vendor = 0;         ///< of object 1018h; 0: any
  std::uint32_t product = 0;        ///< of object 1018h; 0: any
  std::uint64_t fault_outputs = 0;  ///< what the node shows by itself when it does not hear us any more
  Duration heartbeat = milliseconds(100);
  Duration heartbeat_timeout = milliseconds(350);  ///< 3.5 periods: three lost frames in a row
  Duration boot_timeout = milliseconds(2000);      ///< from reset to the boot-up message; then reset again
  Duration sdo_timeout = milliseconds(500);        ///< of one answer; asked twice
  Duration reopen = milliseconds(1000);            ///< between two tries on an interface that is not there
};

// Objects whose answers matter (CiA 301, CiA 401).
inline constexpr ObjectAddress kDeviceTypeObject{0x1000, 0};
inline constexpr ObjectAddress kConsumerHeartbeatObject{0x1016, 1};
inline constexpr ObjectAddress kVendorObject{0x1018, 1};
inline constexpr ObjectAddress kProductObject{0x1018, 2};
inline constexpr std::uint16_t kInputsObject = 0x6000;

/// One entry that is read or written on the way to operational.
struct SetupStep {
  enum class Kind : std::uint8_t { kRead, kExpect, kWrite, kTryWrite };
  Kind kind = Kind::kRead;
  ObjectAddress address;
  std::uint32_t value = 0;
  std::uint8_t size = 0;
};

using NodeSetup = FixedVector<SetupStep, 80>;

/// In this order, before the node is started: identity, heartbeats, what the outputs show without us, both PDOs.
[[nodiscard]] NodeSetup node_setup(const RemoteIoOptions& options);

}  // namespace firstlook::can
