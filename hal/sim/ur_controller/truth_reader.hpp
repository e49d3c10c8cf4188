/// The other end of the private channel of `firstlook ur-sim`: for the cameras and the grader of a simulated cell.
#pragma once

#include <string>

#include "hal/sim/followed_arm.hpp"
#include "platform/linux/tcp_stream.hpp"

namespace firstlook::sim::ur {

class TruthReader final : public TrueJointFeed {
 public:
  /// Connects and reads the DH table; blocks for seconds at most. Error: kDeviceMissing when nobody answers there or it
  /// is no such channel.
  [[nodiscard]] Status connect(const std::string& host, std::uint16_t port);

  [[nodiscard]] const std::array<DhRow, kJointsMax>& true_dh() const override { return dh_; }
  [[nodiscard]] std::optional<Sample> next() override;
  void touched() override;

 private:
  bool fill();

  TcpStream stream_;
  std::array<DhRow, kJointsMax> dh_{};
  std::array<char, 4096> bytes_{};
  std::size_t begin_ = 0, end_ = 0;
};

}  // namespace firstlook::sim::ur
