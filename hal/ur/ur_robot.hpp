/// A UR robot as firstlook's arm and pendant: joints by RTDE, motion by our program on the robot, keys by what the
/// controller says of that program.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>

#include "hal/api/operator_devices.hpp"
#include "hal/api/robot_arm.hpp"
#include "hal/ur/program_link.hpp"
#include "hal/ur/rtde_client.hpp"
#include "platform/core/fixed_vector.hpp"
#include "platform/loop/clock_mapping.hpp"

namespace firstlook::ur {

struct UrRobotOptions {
  std::string model = "ur5";           ///< as ArmModel names it
  std::string own_host = "127.0.0.1";  ///< this computer as the controller sees it
  std::uint16_t control_port = 50001;
};

/// What took how long; the longest of each.
struct UrDelays {
  double consent_s = 0;  ///< from Play (the program was asked for, or connected) until the arm might be moved
  double motion_s = 0;   ///< from there until the first segment had begun
  double accept_s = 0;   ///< from a segment's command until the program had begun it
  double stop_s = 0;     ///< from the command to stop until the program said that the arm stands
  /// While a segment was under way: from the moment when the controller was stopped, paused or in a safety stop, by its
  /// own clock, until firstlook had withdrawn the segment and given the command to stop. Empty: that did not happen.
  std::optional<double> react_s;
  /// The same from the last report of a link that was lost; kStale of it is the silence that tells.
  std::optional<double> lost_s;
};

/// Never switches the power on, releases brakes or unlocks a stop. A segment is withdrawn by a pause, a stop, an end of
/// the program or of a connection; what comes after asks for a new one.
class UrRobot final : public hal::RobotArm {
 public:
  static constexpr Duration kPoll = milliseconds(2);   ///< how often the network is looked at
  static constexpr Duration kPause = milliseconds(7);  ///< after a report, where nothing but the next one can come
  static constexpr double kReports_hz = 125;
  static constexpr Duration kStale = milliseconds(100);   ///< joints older than that: the link counts as lost
  static constexpr Duration kAccept = milliseconds(500);  ///< of a segment by the program
  static constexpr Duration kStopAnswer = milliseconds(2000);
  static constexpr Duration kProgramEnd = milliseconds(50);  ///< of a program whose connection ended, by its runtime
  /// After the first report: firstlook's self test is over then, and a program that comes finds it ready.
  static constexpr Duration kSelfTest = milliseconds(500);

  /// @param notices  may be null; it and the network outlive the robot
  UrRobot(Network& network, const UrRobotOptions& options, NoticeSink* notices = nullptr);
  UrRobot(const UrRobot&) = delete;
  UrRobot& operator=(const UrRobot&) = delete;

  /// Ends the program on the robot.
  ~UrRobot() override { program_.send(plain_command(CommandKind::kEnd, 0)); }

  [[nodiscard]] const char* model() const override { return model_.data(); }
  [[nodiscard]] std::optional<hal::ArmState> poll(Instant now) override;
  [[nodiscard]] Instant next_due() const override;
  [[nodiscard]] Status move(const hal::Segment& segment, Instant now) override;
  void stop(Instant now) override;
  [[nodiscard]] hal::ArmCounters counters() const override { return counters_; }

  /// The controller's own pendant. Play: our program is connected and may move, for the first time or after a pause.
  [[nodiscard]] hal::Pendant& pendant() { return pendant_; }

  [[nodiscard]] const RtdeClient& rtde() const { return rtde_; }
  /// The controller's newest report; empty before the first.
  [[nodiscard]] std::optional<RtdeReport> newest_report() const {
    return heard_ ? std::optional(report_) : std::nullopt;
  }
  [[nodiscard]] const ProgramLink& program() const { return program_; }
  [[nodiscard]] const UrDelays& delays() const { return delays_; }

 private:
  class UrPendant final : public hal::Pendant {
   public:
    explicit UrPendant(UrRobot& robot) : robot_(robot) {}
    [[nodiscard]] std::optional<hal::OperatorEvent> poll(Instant now) override;
    [[nodiscard]] Instant next_due() const override;
    void show(std::string_view line) override { robot_.program_.show(line); }

   private:
    UrRobot& robot_;
  };

  /// What became of the last segment.
  enum class Flight : std::uint8_t {
    kNone,
    kSent,      ///< on its way to the program
    kMoving,    ///< the program has begun it
    kStopping,  ///< the program was told to brake
    kArriving,  ///< the program says that the arm stands; the joints have not shown it yet
  };

  void hear_program(Instant now);
  void note_end_of_program(Instant now);
  void follow_program(Instant now);
  void follow(const RtdeReport& report, Instant now);
  void follow_runtime(Runtime before, Runtime after, Instant now);
  void press(hal::OperatorAction action, Instant now);
  void command_stop(Instant now);
  void note_cause(const RtdeReport& report, Instant stamp);
  void note_withdrawal(Instant now);
  void stay(Instant now);
  void tell(std::string_view line);
  [[nodiscard]] hal::ArmState state_of(const RtdeReport& report) const;
  [[nodiscard]] bool consent() const;
  [[nodiscard]] bool playing() const;
  [[nodiscard]] bool stale(Instant now) const { return !heard_ || now - *heard_ > kStale; }
  /// The connection is gone, or silent for too long.
  [[nodiscard]] bool lost(Instant now) const { return stale(now) || !rtde_.streaming(); }

  std::array<char, 16> model_{};
  NoticeSink* notices_;
  RtdeClient rtde_;
  ProgramLink program_;
  UrPendant pendant_;
  ClockMapping clock_;
  Instant polled_{};

  RtdeReport report_;             ///< the newest
  std::optional<Instant> heard_;  ///< when it came
  Instant stamp_{};               ///< and when it was so, on our clock
  std::optional<Instant> opens_;  ///< from when on programs are let in
  bool was_up_ = false;
  Instant played_{};
  bool moved_ = false;          ///< since then
  std::optional<Instant> cut_;  ///< since when the program plays without a connection to us
  bool cut_short_ = false;      ///< a segment was under way when the connection ended
  bool consented_ = false;

  Flight flight_ = Flight::kNone;
  std::uint32_t number_ = 0;    ///< of the segment in flight, or the last
  std::uint32_t accepted_ = 0;  ///< of the last that the program took
  Instant sent_{};              ///< the command that is waited for
  int standing_reports_ = 0;
  bool withdrawn_ = false;  ///< by a pause: no consent until the program has stopped the arm
  std::int32_t stop_number_ = 0;
  Instant stayed_{};
  std::optional<Instant> cause_;  ///< since when the controller says that nothing may move, with a segment under way

  FixedQueue<hal::OperatorEvent, 16> keys_;
  hal::ArmCounters counters_;
  UrDelays delays_;
};

}  // namespace firstlook::ur
