/// The other end of the private channel of a simulated robot: for the cameras and the grader of a simulated cell.
#pragma once

#include <string>

#include "hal/sim/followed_arm.hpp"
#include "hal/sim/ur_controller/stepped_links.hpp"
#include "platform/linux/tcp_stream.hpp"

namespace firstlook::sim::ur {

/// Reads the channel, however its bytes come.
class TruthReader : public TrueJointFeed {
 public:
  [[nodiscard]] const std::array<DhRow, kJointsMax>& true_dh() const override { return dh_; }
  [[nodiscard]] std::optional<Sample> next() override;
  void touched() override;
  void lead(const JointVector& to_rad, double speed_rad_s, double acceleration_rad_s2) override;

 protected:
  [[nodiscard]] virtual std::string_view receive(std::span<char> room) = 0;
  virtual void send(std::string_view bytes) = 0;
  /// True when something came.
  bool fill();
  /// Once the head has come: the DH table. False: it has not yet.
  [[nodiscard]] bool read_head();

 private:
  std::array<DhRow, kJointsMax> dh_{};
  std::array<char, 4096> bytes_{};
  std::size_t begin_ = 0, end_ = 0;
};

/// On a connection of its own to `firstlook ur-sim`.
class TcpTruth final : public TruthReader {
 public:
  /// Reads the DH table; blocks for seconds at most. Error: kDeviceMissing when it does not come.
  [[nodiscard]] Status connect(TcpStream stream);

 private:
  void send(std::string_view bytes) override { stream_.send(bytes); }
  [[nodiscard]] std::string_view receive(std::span<char> room) override { return stream_.receive(room); }
  TcpStream stream_;
};

/// Among the links of a robot whose time its client keeps.
class SteppedTruth final : public TruthReader {
 public:
  /// @param links  outlive this
  explicit SteppedTruth(SteppedLinks& links) : links_(links) {}
  /// The same, in the robot's time, which goes on meanwhile.
  [[nodiscard]] Status connect();

 private:
  void send(std::string_view bytes) override { links_.send(link_, bytes); }
  [[nodiscard]] std::string_view receive(std::span<char> room) override { return links_.receive(link_, room); }
  SteppedLinks& links_;
  SteppedLinks::Id link_ = SteppedLinks::kNone;
};

/// A connection to the private channel, and whose time is kept.
struct PrivateChannel {
  TcpStream stream;
  bool lockstep = false;  ///< the robot's time is its client's (stepped_service.hpp)
};
/// Blocks for seconds at most. Error: kDeviceMissing when nobody answers there or it is no such channel.
[[nodiscard]] Result<PrivateChannel> connect_private_channel(const std::string& host, std::uint16_t port);

}  // namespace firstlook::sim::ur
