/// Our end of the program on the robot: hands out its text, and talks to it while it runs.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>

#include "hal/ur/control_protocol.hpp"
#include "hal/ur/network.hpp"
#include "platform/core/time.hpp"

namespace firstlook::ur {

/// What a person should know of the robot's side; lines without an end. Must not allocate after boot.
class NoticeSink {
 public:
  virtual ~NoticeSink() = default;
  virtual void notice(std::string_view line) = 0;
};

class ProgramLink {
 public:
  static constexpr Duration kIntroduction = milliseconds(2000);  ///< a visitor says by then what it wants
  static constexpr std::size_t kLineMax = 120;                   ///< of text for the pendant; longer lines are cut

  /// @param script   what a visitor of Door::kProgram gets
  /// @param notices  may be null
  ProgramLink(Network& network, std::string script, NoticeSink* notices)
      : network_(network), script_(std::move(script)), notices_(notices) {}
  ~ProgramLink();
  ProgramLink(const ProgramLink&) = delete;
  ProgramLink& operator=(const ProgramLink&) = delete;

  /// Lets visitors in and hears them; a new program takes the place of the one before.
  void poll(Instant now);
  /// A program that speaks our protocol is connected.
  [[nodiscard]] bool up() const { return commands_.link != kNoLink; }
  /// Programs that were connected so far.
  [[nodiscard]] std::uint64_t programs() const { return programs_; }
  /// When the program was asked for last: somebody has pressed Play.
  [[nodiscard]] const std::optional<Instant>& asked() const { return asked_; }
  /// What it reports, oldest first.
  [[nodiscard]] std::optional<ProgramReport> take();
  /// False: it is gone.
  bool send(const Command& command);
  /// Kept for a program that comes later, too.
  void show(std::string_view line);
  void close();

 private:
  struct Visitor {
    LinkId link = kNoLink;
    Instant until{};
    Door door = Door::kProgram;
    Inbox<256> inbox;
  };

  void let_in(Instant now, Door door);
  void hear(Instant now, Visitor& visitor);
  void introduce(Visitor& visitor);
  void drop(LinkId& link);
  void send_line();

  Network& network_;
  std::string script_;
  NoticeSink* notices_;
  std::array<Visitor, 4> visitors_;
  Visitor commands_, texts_;  ///< links of the program that runs
  std::uint64_t programs_ = 0;
  std::optional<Instant> asked_;
  std::array<char, kLineMax + 1> line_{};
  std::size_t line_size_ = 0;
};

}  // namespace firstlook::ur
