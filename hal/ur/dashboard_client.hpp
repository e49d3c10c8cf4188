/// Questions to the dashboard server: one line there, one line back.
#pragma once

#include <array>
#include <optional>
#include <string_view>

#include "hal/ur/network.hpp"
#include "platform/core/result.hpp"
#include "platform/core/time.hpp"

namespace firstlook::ur {

/// Asks a fixed list of questions and keeps the answers. It changes nothing on the robot: no command is among them.
class DashboardClient {
 public:
  static constexpr Duration kDial = milliseconds(2000);
  static constexpr Duration kAnswer = milliseconds(2000);  ///< of one question
  static constexpr std::size_t kAnswerMax = 120;

  enum class Question : std::uint8_t { kModel, kSerial, kVersion, kRobotMode, kSafetyMode, kProgram, kRemote };
  static constexpr std::size_t kQuestions = 7;

  explicit DashboardClient(Network& network) : network_(network) {}
  ~DashboardClient();
  DashboardClient(const DashboardClient&) = delete;
  DashboardClient& operator=(const DashboardClient&) = delete;

  /// Goes on; true when all is answered. Error: kLinkLost: nobody there, or no answer in time.
  [[nodiscard]] Result<bool> poll(Instant now);
  /// The answer's own part ("RUNNING" of "Robotmode: RUNNING"); empty: not asked yet, or the controller is too old for
  /// the question.
  [[nodiscard]] std::string_view answer(Question question) const;

 private:
  struct Answer {
    std::array<char, kAnswerMax> text{};
    std::size_t size = 0;
  };
  void keep(std::string_view line);

  Network& network_;
  LinkId link_ = kNoLink;
  bool greeted_ = false;
  std::size_t asked_ = 0;  ///< questions; the last is waited for
  std::size_t answered_ = 0;
  Instant until_{};
  Inbox<1024> inbox_;
  std::array<Answer, kQuestions> answers_{};
};

}  // namespace firstlook::ur
