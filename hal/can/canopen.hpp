/// CANopen as a master of one small node speaks it: frames from values, values from frames. Pure, and safe with
/// whatever frames come. CiA 301 version 4.2 (NMT, heartbeat, emergency, SDO, PDO); numbers are little-endian.
#pragma once

#include <linux/can.h>

#include <cstdint>
#include <optional>
#include <string_view>

namespace firstlook::can {

inline constexpr std::uint8_t kNodeMax = 127;

// Function codes of the predefined connection set: the identifier is this plus the node's number.
inline constexpr std::uint32_t kEmergencyId = 0x080;
inline constexpr std::uint32_t kTransmitPdo1Id = 0x180;  ///< of the node: its inputs
inline constexpr std::uint32_t kReceivePdo1Id = 0x200;   ///< by the node: its outputs
inline constexpr std::uint32_t kSdoAnswerId = 0x580;
inline constexpr std::uint32_t kSdoRequestId = 0x600;
inline constexpr std::uint32_t kHeartbeatId = 0x700;

enum class NmtCommand : std::uint8_t {
  kStart = 1,
  kStop = 2,
  kEnterPreOperational = 0x80,
  kResetNode = 0x81,
  kResetCommunication = 0x82,
};
enum class NmtState : std::uint8_t { kBootUp = 0, kStopped = 4, kOperational = 5, kPreOperational = 0x7F };

/// @param node  0: all of them
[[nodiscard]] can_frame nmt_command(NmtCommand command, std::uint8_t node);

struct Heartbeat {
  std::uint8_t node = 0;
  NmtState state = NmtState::kBootUp;
};
[[nodiscard]] can_frame heartbeat_frame(const Heartbeat& heartbeat);
/// Empty for any other frame and for states that CiA 301 does not know.
[[nodiscard]] std::optional<Heartbeat> read_heartbeat(const can_frame& frame);

struct Emergency {
  std::uint8_t node = 0;
  std::uint16_t code = 0;  ///< 0: the error is gone
  std::uint8_t error_register = 0;
};
[[nodiscard]] std::optional<Emergency> read_emergency(const can_frame& frame);

/// An entry of a node's object dictionary.
struct ObjectAddress {
  std::uint16_t index = 0;
  std::uint8_t sub = 0;
  bool operator==(const ObjectAddress&) const = default;
};
[[nodiscard]] can_frame sdo_upload_request(std::uint8_t node, ObjectAddress address);
/// Expedited. @param size  of the entry, 1 to 4 bytes
[[nodiscard]] can_frame sdo_download_request(std::uint8_t node, ObjectAddress address, std::uint32_t value,
                                             std::uint8_t size);
[[nodiscard]] can_frame sdo_abort_request(std::uint8_t node, ObjectAddress address, std::uint32_t code);

struct SdoAnswer {
  enum class Kind : std::uint8_t {
    kUploaded,
    kDownloaded,
    kAborted,
    kSegmented,  ///< a value of more than 4 bytes begins, which we never ask for
  };
  Kind kind = Kind::kAborted;
  std::uint8_t node = 0;
  ObjectAddress address;
  std::uint32_t value = 0;  ///< what was uploaded; the code of an abort
  std::uint8_t size = 0;    ///< of an uploaded value in bytes; 4 when the node did not say
};
[[nodiscard]] std::optional<SdoAnswer> read_sdo_answer(const can_frame& frame);

inline constexpr std::uint32_t kAbortTimedOut = 0x05040000;
inline constexpr std::uint32_t kAbortNoObject = 0x06020000;
/// The meaning of an abort code in words (CiA 301, table 22).
[[nodiscard]] std::string_view abort_text(std::uint32_t code);

/// @param bytes  how many of `bits` the PDO carries, 1 to 8, the lowest first
[[nodiscard]] can_frame pdo_frame(std::uint32_t function, std::uint8_t node, std::uint64_t bits, std::uint8_t bytes);
/// The first `bytes` of a node's PDO; empty for any other frame and for one that is shorter.
[[nodiscard]] std::optional<std::uint64_t> read_pdo(const can_frame& frame, std::uint32_t function, std::uint8_t node,
                                                    std::uint8_t bytes);

/// What a CAN controller reports of itself (linux/can/error.h), not a frame from the bus.
struct BusError {
  bool bus_off = false;
  bool restarted = false;
  bool passive = false;         ///< error-passive: an error counter is above 127
  bool active = false;          ///< well again
  bool overflow = false;        ///< frames were lost in the controller
  bool unacknowledged = false;  ///< nobody on the bus heard us
  bool protocol = false;        ///< bit, form or stuff errors
};
/// Empty for frames from the bus.
[[nodiscard]] std::optional<BusError> read_bus_error(const can_frame& frame);

}  // namespace firstlook::can
