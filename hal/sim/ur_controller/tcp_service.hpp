/// A simulated controller on TCP, in real time or in that of its client.
#pragma once

#include <string>

#include "hal/sim/ur_controller/happenings.hpp"

namespace firstlook::sim::ur {

struct TcpServiceOptions {
  std::string host = "127.0.0.1";
  int port_offset = 0;  ///< added to every port
  bool truth = false;   ///< the private channel, too
  /// So long after the start somebody loads external_control.urp and presses Play, again every 3 s until it runs;
  /// nobody does when negative.
  double play_after_s = -1;
  /// The robot's time is that of the client of the private channel, and stands still without one. What its programs
  /// dial is carried there, too; Play is pressed once, so long after the job's begin.
  bool lockstep = false;
  Timetable timetable{};  ///< what happens to the robot, and when
  bool console = false;   ///< the same by lines on stdin, answered on stderr
};

/// Serves all ports until SIGINT, SIGTERM (see catch_stop_signals) or a client's `shutdown`; says on stderr which ports
/// are ready. A client that does not read is dropped when 2 MiB wait for it. Error: kDeviceMissing for a port that
/// cannot be had.
[[nodiscard]] Status serve_on_tcp(SimulatedUr& robot, const TcpServiceOptions& options);

}  // namespace firstlook::sim::ur
