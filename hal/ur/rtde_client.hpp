/// A client of RTDE that keeps itself connected: dials, agrees on protocol and outputs, reads, and dials again.
#pragma once

#include <array>
#include <optional>

#include "hal/ur/modes.hpp"
#include "hal/ur/network.hpp"
#include "hal/ur/rtde_codec.hpp"
#include "platform/core/joint_vector.hpp"
#include "platform/core/time.hpp"

namespace firstlook::ur {

/// One data package.
struct RtdeReport {
  double timestamp_s = 0;  ///< of the controller, since it was switched on
  JointVector position_rad = JointVector::zero(6);
  JointVector velocity_rad_s = JointVector::zero(6);
  int robot_mode = -1;
  int safety_mode = 0;
  Runtime runtime = Runtime::kUnknown;
  double speed_scaling = 0;            ///< how fast the program's motion runs, 0 to 1
  double slider = 0;                   ///< what the pendant's slider asks for, 0 to 1
  std::optional<double> payload_kg{};  ///< from 3.11 and 5.5 on
  /// What holds the base up against gravity, in Base (m/s²), as the installation's mounting has it; e-Series only.
  std::optional<std::array<double, 3>> gravity_m_s2{};
};

struct RtdeCounters {
  std::uint64_t reports = 0;
  std::uint64_t connections = 0;
  std::uint64_t broken = 0;  ///< streams given up: out of step, silent, refused
};

class RtdeClient {
 public:
  // Everything that is waited for has its limit.
  static constexpr Duration kDial = milliseconds(2000);    ///< for a connection
  static constexpr Duration kAnswer = milliseconds(1000);  ///< for an answer to a request
  static constexpr Duration kSilent = milliseconds(500);   ///< of a stream of data: then it counts as broken
  static constexpr Duration kRedial = milliseconds(200);   ///< the first time, twice as long each time after
  static constexpr Duration kRedialMax = milliseconds(3200);

  /// @param frequency_hz  of the reports; a controller that does less gives its most
  RtdeClient(Network& network, double frequency_hz) : network_(network), frequency_hz_(frequency_hz) {}
  ~RtdeClient();
  RtdeClient(const RtdeClient&) = delete;
  RtdeClient& operator=(const RtdeClient&) = delete;

  /// Goes on with what can be done now. The next report, oldest first; empty when there is none.
  [[nodiscard]] std::optional<RtdeReport> poll(Instant now);
  [[nodiscard]] bool streaming() const { return step_ == Step::kStreaming; }
  /// Major, minor, bugfix, build; zeros before it is known.
  [[nodiscard]] const std::array<std::uint32_t, 4>& version() const { return version_; }
  /// Why the last connection ended, or none stands yet.
  [[nodiscard]] const std::optional<Error>& trouble() const { return trouble_; }
  [[nodiscard]] RtdeCounters counters() const { return counters_; }

 private:
  enum class Step : std::uint8_t { kDown, kDialling, kProtocol, kVersion, kOutputs, kStart, kStreaming };

  void dial(Instant now);
  void give_up(Instant now, const Error& why);
  void wait_for_answer(Instant now, Step step, const RtdeRequest& request);
  void ask_outputs(Instant now);
  [[nodiscard]] std::optional<RtdeReport> take(Instant now, const RtdePackage& package);
  [[nodiscard]] Status take_answer(Instant now, const RtdePackage& package);
  [[nodiscard]] Status take_outputs(Instant now, std::string_view payload);
  [[nodiscard]] RtdeReport report_of(std::span<const double> values) const;

  Network& network_;
  double frequency_hz_;
  LinkId link_ = kNoLink;
  Step step_ = Step::kDown;
  Instant until_{};  ///< the step's limit
  Duration redial_ = kRedial;
  int protocol_ = 2;
  int extras_ = 2;  ///< outputs that not all controllers have: 2 payload and gravity, 1 payload, 0 none
  RtdeRecipe recipe_;
  Inbox<8192> inbox_;
  std::array<std::uint32_t, 4> version_{};
  std::optional<Error> trouble_;
  RtdeCounters counters_;
};

}  // namespace firstlook::ur
