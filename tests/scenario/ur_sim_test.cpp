/// `firstlook ur-sim` as other programs meet it: over TCP, in a process of its own.
#include "tests/support/ur_sim_process.hpp"

namespace firstlook {
using namespace test;
using Catch::Matchers::Contains;

TEST_CASE("ur-sim is brought up, streams and runs a script", "[scenario]") {
  UrSim robot({"--model", "ur5e", "--serial", "20195599999"});
  CHECK_THAT(robot.said, Contains(std::string("RTDE on 127.0.0.1:") + std::to_string(30004 + robot.offset)));
  Connection dashboard(robot, 29999);
  CHECK(dashboard.line() == "Connected: Universal Robots Dashboard Server");
  CHECK(dashboard.ask("get serial number") == "20195599999");
  CHECK(dashboard.ask("brake release") == "Brake releasing");
  wait_for_answer(dashboard, "robotmode", "Robotmode: RUNNING");

  Connection rtde_client(robot, 30004);
  rtde_client.send(rtde('V', big_endian(2, 2)) + rtde('O', big_endian(500.0) + "timestamp,runtime_state") + rtde('S'));
  CHECK(rtde_client.rtde_package().payload == "\1");
  CHECK(rtde_client.rtde_package().payload == "\1DOUBLE,UINT32");
  CHECK(rtde_client.rtde_package().payload == "\1");
  double last_s = 0;
  for (int i = 0; i < 200; ++i) {
    const RtdePackage data = rtde_client.rtde_package();
    REQUIRE(data.type == 'U');
    const double now_s = double_at(data.payload, 1);
    if (i > 0) REQUIRE(now_s - last_s == Approx(0.002));
    last_s = now_s;
  }

  Connection primary(robot, 30001), secondary(robot, 30002);
  secondary.wait_for("URControl");
  primary.wait_for("URControl");
  secondary.send("def job():\n  textmsg(\"over TCP \", 1 + 1)\nend\n");
  primary.wait_for("PROGRAM_XXX_STARTEDjob");
  primary.wait_for("over TCP 2");
  primary.wait_for("PROGRAM_XXX_STOPPEDjob");
  CHECK(robot.end(SIGTERM) == 0);
}

TEST_CASE("a script dials back to the computer that sent it", "[scenario]") {
  UrSim robot({"--running"});
  int port = 45'000 + getpid() % 1000, listener = -1;
  while (listener < 0) listener = bind_to(++port);
  Connection primary(robot, 30001);
  primary.send(std::string("def dial():\n  socket_open(\"127.0.0.1\", ") + std::to_string(port) +
               ")\n  socket_send_line(\"hello\")\n  textmsg(socket_read_line(timeout=0))\nend\n");
  pollfd ready{listener, POLLIN, 0};
  REQUIRE(poll(&ready, 1, kLimit_ms) == 1);
  const int accepted = accept4(listener, nullptr, nullptr, SOCK_CLOEXEC);
  REQUIRE(accepted >= 0);
  std::string got;
  while (got.find('\n') == std::string::npos) {
    char buffer[64];
    const ssize_t count = read(accepted, buffer, sizeof buffer);
    REQUIRE(count > 0);
    got.append(buffer, static_cast<std::size_t>(count));
  }
  CHECK(got == "hello\n");
  REQUIRE(write(accepted, "answer\n", 7) == 7);
  primary.wait_for("answer");
  close(accepted);
  close(listener);
}

TEST_CASE("an e-Series takes statements on its interpreter port, a CB3 has none", "[scenario]") {
  UrSim robot({"--model", "ur5e", "--running"});
  Connection primary(robot, 30001), interpreter(robot, 30020);
  CHECK(interpreter.ask("x = 1") == "discard: Program is in an invalid state: x = 1");
  primary.send("interpreter_mode()\n");
  primary.wait_for("PROGRAM_XXX_STARTED");
  CHECK(interpreter.ask("textmsg(\"line by line\")") == "ack: 1: textmsg(\"line by line\")");
  primary.wait_for("line by line");
  CHECK(interpreter.ask("statelastexecuted") == "state: 1: statelastexecuted");
  CHECK(interpreter.ask("end_interpreter()") == "ack: 2: end_interpreter()");
  primary.wait_for("PROGRAM_XXX_STOPPED");
  const UrSim cb3({"--model", "ur5"});
  CHECK_THAT(cb3.said, !Contains("interpreter"));
}

TEST_CASE("a client that does not read is dropped, the others go on", "[scenario]") {
  UrSim robot({"--model", "ur5e"});
  Connection dashboard(robot, 29999);
  static_cast<void>(dashboard.line());
  // Some 5 MB/s: they fill the buffers of the system and then those of the program within seconds.
  Connection greedy(robot, 30004);
  std::string names = "actual_q";
  for (int i = 0; i < 200; ++i) names += ",actual_q";
  greedy.send(rtde('V', big_endian(2, 2)) + rtde('O', big_endian(500.0) + names) + rtde('S'));
  CHECK(greedy.rtde_package().type == 'V');
  const auto limit = std::chrono::steady_clock::now() + std::chrono::milliseconds(kLimit_ms);
  pollfd hung_up{greedy.descriptor(), POLLRDHUP, 0};
  while (poll(&hung_up, 1, 100) == 0) {
    REQUIRE(dashboard.ask("running") == "Program running: false");
    REQUIRE(std::chrono::steady_clock::now() < limit);
  }
  CHECK(dashboard.ask("running") == "Program running: false");
}

TEST_CASE("what people and mishaps do to ur-sim: by a timetable, and by lines to its private port", "[scenario]") {
  UrSim robot({"--model", "ur5e", "--running", "--at", "0.5=emergency-stop"});
  Connection dashboard(robot, 29999);
  static_cast<void>(dashboard.line());
  wait_for_answer(dashboard, "safetymode", "Safetymode: ROBOT_EMERGENCY_STOP");
  CHECK(dashboard.ask("robotmode") == "Robotmode: POWER_OFF");
  Connection hand(robot, 30098);
  CHECK_THAT(hand.line(), Contains("help"));
  CHECK(hand.ask("release-emergency-stop") == "done");
  CHECK_THAT(hand.ask("estop"), Contains("--at help"));
  CHECK(dashboard.ask("brake release") == "Brake releasing");
  wait_for_answer(dashboard, "robotmode", "Robotmode: RUNNING");

  // A cable that is out: nothing comes, and all that was sent comes when it is in again.
  CHECK(hand.ask("unplug") == "done");
  dashboard.send("get robot model\n");
  pollfd quiet{dashboard.descriptor(), POLLIN, 0};
  CHECK(poll(&quiet, 1, 300) == 0);
  CHECK(hand.ask("plug") == "done");
  CHECK(dashboard.line() == "UR5");

  // Switched off and on: the connection ends, and a new one finds nobody for some seconds.
  CHECK(hand.ask("reboot") == "done");
  while (dashboard.receive()) continue;
  Connection early(robot, 29999);
  CHECK_FALSE(early.receive());
  CHECK(hand.ask("slider=0.5") == "done");
}

TEST_CASE("what cannot happen to ur-sim is refused before it begins", "[scenario]") {
  const JobFolder folder;
  const ProgramResult wrong = folder.run({"ur-sim", "--at", "5=estop"});
  CHECK(wrong.exit_code == 2);
  CHECK_THAT(wrong.err, Contains("--at") && Contains("estop"));
  const ProgramResult help = folder.run({"ur-sim", "--at", "help"});
  CHECK(help.exit_code == 0);
  CHECK_THAT(help.out, Contains("emergency-stop") && Contains("reboot"));
}

TEST_CASE("a shutdown over the dashboard ends ur-sim", "[scenario]") {
  UrSim robot({});
  Connection dashboard(robot, 29999);
  static_cast<void>(dashboard.line());
  CHECK(dashboard.ask("shutdown") == "Shutting down");
  CHECK(robot.end(0) == 0);
}

TEST_CASE("ports that cannot be had", "[scenario]") {
  const JobFolder folder;
  const int offset = free_offset();
  const int taken = bind_to(30002 + offset);
  REQUIRE(taken >= 0);
  const ProgramResult in_use = folder.run({"ur-sim", "--port-offset", std::to_string(offset)});
  close(taken);
  CHECK(in_use.exit_code == 4);
  CHECK_THAT(in_use.err, Contains("E5001") && Contains(std::to_string(30002 + offset)) && Contains("in use"));
  const ProgramResult no_host = folder.run({"ur-sim", "--host", "192.0.2.7"});
  CHECK(no_host.exit_code == 4);
  CHECK_THAT(no_host.err, Contains("192.0.2.7"));
  CHECK(folder.run({"ur-sim", "--model", "ur6"}).exit_code == 2);
  CHECK(folder.run({"ur-sim", "--program", "nowhere.script"}).exit_code == 3);
}

}  // namespace firstlook
