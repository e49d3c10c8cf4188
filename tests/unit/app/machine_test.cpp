#include "app/machine/machine.hpp"

#include <catch2/catch.hpp>
#include <set>

#include "tests/support/scripted_world.hpp"

namespace firstlook {
using hal::OperatorAction;
using test::ScriptedWorld;

TEST_CASE("nothing moves before Play, and Play runs the whole job", "[machine]") {
  ScriptedWorld world;
  REQUIRE(world.run_until(StateId::kReady));
  for (int i = 0; i < 2000; ++i) world.tick();
  CHECK(world.segments.empty());
  CHECK(world.machine.state() == StateId::kReady);
  world.press(OperatorAction::kPlay);
  REQUIRE(world.run_to_end());
  CHECK(world.ending.outcome == Outcome::kDone);
  for (const StateId state : {StateId::kLocateBoard, StateId::kIdentifyLink, StateId::kCollect, StateId::kSolve,
                              StateId::kValidate, StateId::kSweep, StateId::kChoose, StateId::kPlan, StateId::kMove,
                              StateId::kLook, StateId::kVerifyBoard, StateId::kPark, StateId::kReport}) {
    INFO(state_row(state).name);
    CHECK(world.was_in(state));
  }
}

TEST_CASE("the panel's button starts only within a minute of Play", "[machine]") {
  MachineSettings settings = ScriptedWorld::default_settings();
  settings.start_source = StartSource::kPanel;
  ScriptedWorld world(settings);
  REQUIRE(world.run_until(StateId::kReady));
  world.press(OperatorAction::kPlay, OperatorDevice::kPanel);
  CHECK_FALSE(world.run_until(StateId::kLocateBoard, 1));
  world.press(OperatorAction::kPlay);
  CHECK_FALSE(world.run_until(StateId::kLocateBoard, 61));
  world.press(OperatorAction::kPlay, OperatorDevice::kPanel);
  CHECK_FALSE(world.run_until(StateId::kLocateBoard, 1));
  world.press(OperatorAction::kPlay);
  world.press(OperatorAction::kPlay, OperatorDevice::kPanel);
  CHECK(world.run_until(StateId::kLocateBoard, 1));
}

TEST_CASE("a device that is missing in Ready is named, and no job begins without it", "[machine]") {
  MachineSettings settings = ScriptedWorld::default_settings();
  settings.start_source = GENERATE(StartSource::kPendant, StartSource::kPanel);
  ScriptedWorld world(settings);
  const auto start = [&] {
    world.press(OperatorAction::kPlay);
    world.press(OperatorAction::kPlay, OperatorDevice::kPanel);
    return world.run_until(StateId::kLocateBoard, 1);
  };
  REQUIRE(world.run_until(StateId::kReady));
  CHECK(world.lights.back() == hal::Light::kGreen);
  world.machine.on_event(world.now, DeviceChanged{CartDevice::kDepthCamera, false});
  CHECK(world.lights.back() == hal::Light::kRed);
  CHECK_THAT(world.shown.back(), Catch::Contains("the depth camera is missing or wrong: see"));
  world.machine.on_event(world.now, DeviceChanged{CartDevice::kPanel, false});
  CHECK_THAT(world.shown.back(), Catch::Contains("wrong, and more"));
  CHECK_FALSE(start());
  CHECK(world.has_shown("cannot start, the depth camera is missing"));
  world.machine.on_event(world.now, DeviceChanged{CartDevice::kDepthCamera, true});
  CHECK_FALSE(start());
  CHECK(world.lights.back() == hal::Light::kRed);
  world.machine.on_event(world.now, DeviceChanged{CartDevice::kPanel, true});
  CHECK(world.lights.back() == hal::Light::kGreen);
  CHECK_FALSE(world.run_until(StateId::kLocateBoard, 5));  // by itself
  CHECK(start());
}

TEST_CASE("of what came in Ready the job remembers only where the arm is: a record leaves the rest out", "[machine]") {
  ScriptedWorld world;
  REQUIRE(world.run_until(StateId::kReady));
  world.wait(2);
  REQUIRE(world.machine.stood_at(0.5));
  world.press(OperatorAction::kPlay);
  REQUIRE(world.run_until(StateId::kLocateBoard, 1));
  CHECK_FALSE(world.machine.stood_at(0.1));
  CHECK(world.machine.arm().position_rad == world.position_rad());
}

TEST_CASE("a missing device is named at boot", "[machine]") {
  ScriptedWorld world;
  world.devices = false;
  REQUIRE(world.run_to_end(20));
  CHECK(world.ending.outcome == Outcome::kFaulted);
  CHECK(world.ending.fault == Fault::kDeviceMissing);
}

TEST_CASE("a board that is nowhere ends the job safely", "[machine]") {
  ScriptedWorld world;
  world.detect = [](const DetectArguments&) { return DetectResult{}; };
  world.run_until(StateId::kReady);
  world.press(OperatorAction::kPlay);
  REQUIRE(world.run_to_end());
  CHECK(world.ending.outcome == Outcome::kSafelyStopped);
  CHECK(world.ending.fault == Fault::kBoardNotLocated);
}

TEST_CASE("nothing reachable from the start ends the job safely, without a motion, with why", "[machine]") {
  for (const Fault why : {Fault::kNothingReachable, Fault::kStartBlocked}) {
    ScriptedWorld world;
    world.locate_views = 0;
    world.no_views_because = why;
    world.plan = [](const PlanArguments&) { return PlanResult{}; };
    world.run_until(StateId::kReady);
    world.press(OperatorAction::kPlay);
    REQUIRE(world.run_to_end());
    CHECK(world.ending.outcome == Outcome::kSafelyStopped);
    CHECK(world.ending.fault == why);
    CHECK(world.segments.empty());
  }
}

TEST_CASE("a sweep that finds no room to move ends the job safely, after some looks around", "[machine]") {
  ScriptedWorld world;
  world.next_view = [](const FromHere&) {
    NextViewResult r;
    r.blocked = true;
    return r;
  };
  world.run_until(StateId::kReady);
  world.press(OperatorAction::kPlay);
  REQUIRE(world.run_to_end());
  CHECK(world.was_in(StateId::kSweep));
  CHECK_FALSE(world.was_in(StateId::kMove));
  CHECK(world.ending.outcome == Outcome::kSafelyStopped);
  CHECK(world.ending.fault == Fault::kStartBlocked);
}

TEST_CASE("a camera that no joint moves is reported", "[machine]") {
  ScriptedWorld world;
  world.detect = [](const DetectArguments&) {
    DetectResult r;
    r.found = true;
    return r;
  };
  world.run_until(StateId::kReady);
  world.press(OperatorAction::kPlay);
  REQUIRE(world.run_to_end());
  CHECK(world.ending.outcome == Outcome::kCalibrationRejected);
  CHECK(world.ending.fault == Fault::kCameraNotOnArm);
}

TEST_CASE("a camera on an inner link is named", "[machine]") {
  ScriptedWorld world;
  const int link = GENERATE(1, 3, 5);
  const bool lost = GENERATE(false, true);  // the joint that tells two links apart takes the board out of view
  world.detect = [=](const DetectArguments& a) {
    const int joint = 6 - static_cast<int>(a.view);  // from the last inwards
    DetectResult r;
    r.found = a.purpose != BoardLook::kIdentify || !lost || joint != link;
    r.changed = a.purpose == BoardLook::kIdentify && joint <= link;
    return r;
  };
  world.run_until(StateId::kReady);
  world.press(OperatorAction::kPlay);
  REQUIRE(world.run_to_end());
  CHECK(world.ending.outcome == Outcome::kCalibrationRejected);
  CHECK(world.ending.fault == Fault::kCameraOnInnerLink);
  CHECK(world.ending.camera_link_low == std::max(1, lost ? link - 1 : link));
  CHECK(world.ending.camera_link_high == link);
  CHECK(world.plans_for(MotionPhase::kBeforeCalibration) == 0);  // the way to park, too: any link may carry the camera
}

TEST_CASE("a board that the first search misses is looked for with the inner joints", "[machine]") {
  ScriptedWorld world;
  int looks = 0;
  world.detect = [&](const DetectArguments& a) {
    DetectResult r;
    r.found = a.purpose != BoardLook::kLocate || ++looks > world.locate_views;
    r.changed = a.purpose == BoardLook::kIdentify;
    return r;
  };
  world.run_until(StateId::kReady);
  world.press(OperatorAction::kPlay);
  CHECK(world.run_until(StateId::kCollect));
  CHECK(looks == world.locate_views + 1);
  CHECK(world.plans_for(MotionPhase::kLinkUnknown) > 0);
  CHECK(world.plans_for(MotionPhase::kBeforeCalibration) == 0);
}

TEST_CASE("a board that every test motion loses says nothing about the camera's link", "[machine]") {
  ScriptedWorld world;
  int motions = 0;
  world.detect = [&motions](const DetectArguments& a) {
    DetectResult r;
    r.found = a.purpose != BoardLook::kIdentify;
    motions += r.found ? 0 : 1;
    return r;
  };
  world.run_until(StateId::kReady);
  world.press(OperatorAction::kPlay);
  REQUIRE(world.run_to_end());
  CHECK(motions == 6);
  CHECK(world.ending.outcome == Outcome::kCalibrationRejected);
  CHECK(world.ending.fault == Fault::kBoardNotFound);
}

TEST_CASE("a rejected calibration maps nothing", "[machine]") {
  ScriptedWorld world;
  world.validate.accepted = false;
  world.run_until(StateId::kReady);
  world.press(OperatorAction::kPlay);
  REQUIRE(world.run_to_end());
  CHECK(world.ending.outcome == Outcome::kCalibrationRejected);
  CHECK_FALSE(world.was_in(StateId::kSweep));
}

TEST_CASE("one view at the end that contradicts the others is no verdict yet: two more are taken, once", "[machine]") {
  const bool it_was_wrong_by_itself = GENERATE(true, false);
  ScriptedWorld world;
  std::vector<std::uint32_t> observations;
  world.validating = [&] {
    observations.push_back(world.machine.progress().observations);
    const bool settled = observations.size() == 2 && it_was_wrong_by_itself;
    return ValidateResult{.accepted = settled, .more_views_tell = !settled};
  };
  world.run_until(StateId::kReady);
  world.press(OperatorAction::kPlay);
  REQUIRE(world.run_to_end());
  REQUIRE(observations.size() == 2);
  CHECK(observations[1] == observations[0] + 2);
  CHECK(world.ending.outcome == (it_was_wrong_by_itself ? Outcome::kDone : Outcome::kCalibrationRejected));
  CHECK(world.was_in(StateId::kSweep) == it_was_wrong_by_itself);
}

TEST_CASE("a calibration view is chosen on the way to the one before, and certified from where the arm stands",
          "[machine]") {
  MachineSettings settings = ScriptedWorld::default_settings();
  settings.calibration_views_max = 12;
  ScriptedWorld world(settings);
  int ahead = 0, due = 0, certified = 0;
  bool certifies = GENERATE(true, false);
  world.calibration_view = [&](const FromHere& here) {
    ++(here.after_look ? ahead : due);
    CalibrationViewResult r;
    r.found = true;
    r.path = ScriptedWorld::beside(here);
    return r;
  };
  world.certify = [&](const PlanArguments& a) {
    if (a.phase == MotionPhase::kBeforeCalibration) {
      ++certified;
      CHECK((a.from_rad - world.position_rad()).max_abs() < 1e-9);
    }
    PlanResult r;
    r.found = a.phase != MotionPhase::kBeforeCalibration || certifies;
    return r;
  };
  world.run_until(StateId::kReady);
  world.press(OperatorAction::kPlay);
  REQUIRE(world.run_to_end());
  CHECK(world.machine.progress().observations == 12);
  // The first six tell the model, the last has none after it.
  CHECK(ahead == 5);
  CHECK(certified == 5);
  CHECK(due == (certifies ? 7 : 12));
}

TEST_CASE("a view of Explore that tells little is followed by the one chosen on the way, others, or a pause, ask anew",
          "[machine]") {
  enum class Case { kLittle, kMuch, kExpectedMuch, kNotUsed, kPaused };
  const Case which = GENERATE(Case::kLittle, Case::kMuch, Case::kExpectedMuch, Case::kNotUsed, Case::kPaused);
  MachineSettings settings = ScriptedWorld::default_settings();
  settings.explore_views_max = 6;
  ScriptedWorld world(settings);
  int ahead = 0, due = 0, foreseen = 0;
  std::uint64_t unknown = 100000;
  world.next_view = [&](const FromHere& here) {
    ++(here.after_look ? ahead : due);
    NextViewResult r;
    r.found = world.was_in(StateId::kChoose) || here.step < 1;
    r.path = ScriptedWorld::beside(here);
    r.gain_expected = which == Case::kExpectedMuch ? 10000 : 20;
    return r;
  };
  world.certify = [&](const PlanArguments& a) {
    foreseen += a.foreseen ? 1 : 0;
    PlanResult r;
    r.found = true;
    return r;
  };
  world.integrating = [&](IntegrateResult& r) {
    r.used = which != Case::kNotUsed;
    if (which == Case::kMuch) unknown -= 1000;
    r.unknown = unknown;
  };
  world.run_until(StateId::kReady);
  world.press(OperatorAction::kPlay);
  REQUIRE(world.run_until(StateId::kMove));
  REQUIRE(world.run_until(StateId::kLook));
  if (which == Case::kPaused) {
    world.consent = false;
    REQUIRE(world.run_until(StateId::kPaused, 1));
    world.consent = true;
    const int due_before = due;
    REQUIRE(world.run_until(StateId::kMove, 5));
    CHECK(due == due_before + 1);
    CHECK(foreseen == 0);
  }
  REQUIRE(world.run_to_end());
  CHECK(world.ending.outcome == Outcome::kDone);
  CHECK(world.machine.progress().explore_views == 6);
  const bool little = which == Case::kLittle || which == Case::kPaused;
  CHECK(foreseen == (little ? 5 : 0));  // after the last of the six none is chosen
  CHECK((ahead == 0) == (which == Case::kExpectedMuch));
}

TEST_CASE("a board that moved rejects the map", "[machine]") {
  ScriptedWorld world;
  world.check.moved = 1;
  world.run_until(StateId::kReady);
  world.press(OperatorAction::kPlay);
  REQUIRE(world.run_to_end());
  CHECK(world.ending.fault == Fault::kBoardMoved);
}

TEST_CASE("no consent, no motion: pause withdraws, resume asks for a new segment from where the arm is", "[machine]") {
  ScriptedWorld world;
  world.run_until(StateId::kReady);
  world.press(OperatorAction::kPlay);
  REQUIRE(world.run_until(StateId::kMove));
  for (int i = 0; i < 3; ++i) world.tick();
  world.consent = false;
  world.tick();
  CHECK(world.machine.state() == StateId::kPaused);
  const std::size_t before = world.segments.size();
  for (int i = 0; i < 500; ++i) world.tick();
  CHECK(world.segments.size() == before);
  CHECK(world.forgotten == 0);
  world.consent = true;
  world.tick();
  CHECK(world.machine.state() != StateId::kPaused);
  REQUIRE(world.run_to_end());
  CHECK(world.ending.outcome == Outcome::kDone);
}

TEST_CASE("a long pause makes the known free space unknown again", "[machine]") {
  ScriptedWorld world;
  world.run_until(StateId::kReady);
  world.press(OperatorAction::kPlay);
  REQUIRE(world.run_until(StateId::kSweep));
  world.consent = false;
  for (int i = 0; i < 125 * 61; ++i) world.tick();
  world.consent = true;
  world.tick();
  CHECK(world.forgotten == 1);
}

TEST_CASE("every stop ends motion at once and needs a person", "[machine]") {
  ScriptedWorld world;
  world.run_until(StateId::kReady);
  world.press(OperatorAction::kPlay);
  const StateId state = GENERATE(StateId::kLocateBoard, StateId::kCollect, StateId::kSweep, StateId::kMove,
                                 StateId::kVerifyBoard, StateId::kPark);
  REQUIRE(world.run_until(state));
  Fault expected = Fault::kInternal;
  SECTION("Stop on the pendant") {
    expected = Fault::kProgramStopped;
    world.press(OperatorAction::kStop);
  }
  SECTION("the panel is lost") {
    expected = Fault::kPanelLost;
    world.press(OperatorAction::kLost, OperatorDevice::kPanel);
  }
  SECTION("the panel was lost before the job began, and is told of now") {
    expected = Fault::kPanelLost;
    world.machine.on_event(world.now, DeviceChanged{CartDevice::kPanel, false});
  }
  SECTION("protective stop") {
    expected = Fault::kProtectiveStop;
    world.safety = hal::ArmSafety::kProtectiveStop;
    world.tick();
  }
  REQUIRE(world.ended);
  CHECK(world.machine.state() == StateId::kStopped);
  CHECK(world.ending.outcome == Outcome::kSafelyStopped);
  CHECK(world.ending.fault == expected);
  CHECK(world.forgotten == 1);
  const std::size_t before = world.segments.size();
  for (int i = 0; i < 1000; ++i) world.tick();
  CHECK(world.segments.size() == before);
  CHECK(world.segments_after_stop == 0);
}

TEST_CASE("a silent arm is a lost link in every state, at once", "[machine]") {
  ScriptedWorld world;
  world.run_until(StateId::kReady);
  const StateId state = GENERATE(StateId::kReady, StateId::kLocateBoard, StateId::kIdentifyLink, StateId::kCollect,
                                 StateId::kSweep, StateId::kMove, StateId::kLook, StateId::kPark);
  if (state != StateId::kReady) world.press(OperatorAction::kPlay);
  REQUIRE(world.run_until(state));
  world.tick();
  world.arm_reports = false;
  REQUIRE(world.run_to_end(0.3));
  CHECK(world.ending.outcome == Outcome::kSafelyStopped);
  CHECK(world.ending.fault == Fault::kLinkLost);
  CHECK(world.stops.size() == 1);
}

TEST_CASE("a paused arm that falls silent, and a pause that never ends", "[machine]") {
  ScriptedWorld world;
  world.run_until(StateId::kReady);
  world.press(OperatorAction::kPlay);
  REQUIRE(world.run_until(StateId::kSweep));
  world.consent = false;
  REQUIRE(world.run_until(StateId::kPaused));
  SECTION("silence") {
    world.arm_reports = false;
    REQUIRE(world.run_to_end(0.3));
    CHECK(world.ending.fault == Fault::kLinkLost);
  }
  SECTION("no panel that could hear a stop") {
    world.press(OperatorAction::kLost, OperatorDevice::kPanel);
    REQUIRE(world.ended);
    CHECK(world.ending.fault == Fault::kPanelLost);
  }
  SECTION("an hour") {
    REQUIRE(world.run_to_end(3601));
    CHECK(world.ending.fault == Fault::kPausedTooLong);
  }
}

TEST_CASE("a protective stop before Play is named, not waited for", "[machine]") {
  ScriptedWorld world;
  world.run_until(StateId::kReady);
  world.safety = hal::ArmSafety::kEmergencyStop;
  REQUIRE(world.run_to_end(0.1));
  CHECK(world.ending.fault == Fault::kProtectiveStop);
}

TEST_CASE("a shutdown ends the job in every state, with its cause", "[machine]") {
  ScriptedWorld world;
  const StateId state = GENERATE(StateId::kBoot, StateId::kReady, StateId::kSweep);
  world.devices = state != StateId::kBoot;
  REQUIRE(world.run_until(state == StateId::kBoot ? StateId::kBoot : StateId::kReady));
  if (state == StateId::kSweep) world.press(OperatorAction::kPlay);
  REQUIRE(world.run_until(state));
  world.machine.on_event(world.now, ShutdownAsked{Fault::kNotStarted});
  REQUIRE(world.ended);
  CHECK(world.ending.outcome == Outcome::kSafelyStopped);
  CHECK(world.ending.fault == Fault::kNotStarted);
}

TEST_CASE("a job that fails ends the run safely with its fault", "[machine]") {
  ScriptedWorld world;
  world.failing = GENERATE(JobKind::kLocateViews, JobKind::kIdentifyMotions, JobKind::kPlan, JobKind::kDetectBoard,
                           JobKind::kNextCalibrationView, JobKind::kSolve, JobKind::kValidate, JobKind::kIntegrate,
                           JobKind::kNextSweepView, JobKind::kNextView, JobKind::kCertifyPath, JobKind::kCheckBoard,
                           JobKind::kSummarize);
  INFO(name_of(*world.failing));
  world.run_until(StateId::kReady);
  world.press(OperatorAction::kPlay);
  REQUIRE(world.run_to_end(600));
  CHECK(world.ending.outcome == Outcome::kSafelyStopped);
  CHECK(world.ending.fault == Fault::kOutOfMemory);
  REQUIRE(world.shown.size() >= 2);
  CHECK(world.shown[world.shown.size() - 2].find(name_of(*world.failing)) != std::string::npos);
}

TEST_CASE("frames whose time the arm does not know are not a camera that stopped", "[machine]") {
  ScriptedWorld world;
  world.frame_age = GENERATE(milliseconds(-300), milliseconds(5000));
  world.run_until(StateId::kReady);
  world.press(OperatorAction::kPlay);
  REQUIRE(world.run_to_end(20));
  CHECK(world.ending.fault == Fault::kClockWrong);
}

TEST_CASE("stamps that fit no offset stop the job, unless the calibration is wrong by itself", "[machine]") {
  ScriptedWorld world;
  world.solve.stamps_wrong = true;
  world.validate.accepted = GENERATE(true, false);
  world.run_until(StateId::kReady);
  world.press(OperatorAction::kPlay);
  REQUIRE(world.run_to_end(600));
  CHECK(world.ending.fault == (world.validate.accepted ? Fault::kClockWrong : Fault::kCalibrationRejected));
  CHECK(world.ending.outcome == (world.validate.accepted ? Outcome::kSafelyStopped : Outcome::kCalibrationRejected));
}

TEST_CASE("frames on the way between calibration views are looked at, and nobody waits for them", "[machine]") {
  ScriptedWorld world;
  REQUIRE(world.run_until(StateId::kReady));
  world.press(OperatorAction::kPlay);
  CHECK(world.run_to_end());
  CHECK(world.ending.outcome == Outcome::kDone);
  CHECK(world.seen_on_the_way > 0);
  MachineSettings settings = ScriptedWorld::default_settings();
  settings.see_on_the_way = false;
  ScriptedWorld plain(settings);
  REQUIRE(plain.run_until(StateId::kReady));
  plain.press(OperatorAction::kPlay);
  CHECK(plain.run_to_end());
  CHECK(plain.seen_on_the_way == 0);
}

TEST_CASE("looks at depth give the map its colours where it wants them, and nobody waits for that", "[machine]") {
  for (const bool wanted : {false, true}) {
    MachineSettings settings = ScriptedWorld::default_settings();
    settings.color_at_looks = wanted;
    ScriptedWorld world(settings);
    REQUIRE(world.run_until(StateId::kReady));
    world.press(OperatorAction::kPlay);
    CHECK(world.run_to_end());
    CHECK(world.ending.outcome == Outcome::kDone);
    CHECK(world.looks > 2);
    CHECK(world.colored == (wanted ? world.looks : 0));
  }
  MachineSettings settings = ScriptedWorld::default_settings();
  settings.color_at_looks = true;
  ScriptedWorld failing(settings);
  failing.failing = JobKind::kColorLook;
  REQUIRE(failing.run_until(StateId::kReady));
  failing.press(OperatorAction::kPlay);
  CHECK(failing.run_to_end());
  CHECK(failing.ending.outcome == Outcome::kDone);
}

TEST_CASE("stamps that run ahead are corrected: frames wait until the arm has been there", "[machine]") {
  ScriptedWorld world;
  world.frame_age = milliseconds(-100);
  world.solve.offsets = {-0.104, -0.104};
  REQUIRE(world.run_until(StateId::kReady));
  world.press(OperatorAction::kPlay);
  CHECK(world.run_to_end());
  CHECK(world.ending.outcome == Outcome::kDone);
}

TEST_CASE("a picture that still moves is looked at again, at once, and is not a view", "[machine]") {
  ScriptedWorld w;
  std::vector<std::uint32_t> looks;
  w.detect = [&](const DetectArguments& a) {
    DetectResult r;
    r.changed = a.purpose == BoardLook::kIdentify;
    if (a.purpose == BoardLook::kCollect) {
      looks.push_back(a.looks);
      r.still = looks.size() % 3 == 0;
      r.moved_px = r.still ? 0.01 : 0.3;
    }
    r.found = r.still;
    return r;
  };
  REQUIRE(w.run_until(StateId::kReady));
  w.press(hal::OperatorAction::kPlay);
  REQUIRE(w.run_to_end());
  CHECK(w.ending.outcome == Outcome::kDone);
  CHECK(looks == std::vector<std::uint32_t>{1, 2, 3, 1, 2, 3, 1, 2, 3, 1, 2, 3});
  CHECK(std::none_of(w.shown.begin(), w.shown.end(),
                     [](const std::string& line) { return line.find("stand still") != std::string::npos; }));
}

TEST_CASE("a picture that never stands still is used in the end, and said", "[machine]") {
  ScriptedWorld w;
  std::uint32_t most = 0;
  w.detect = [&](const DetectArguments& a) {
    DetectResult r;
    r.changed = a.purpose == BoardLook::kIdentify;
    r.still = a.purpose != BoardLook::kCollect;
    r.moved_px = 0.25;
    r.found = r.still || a.looks == kLooksMax;
    most = std::max(most, a.looks);
    return r;
  };
  REQUIRE(w.run_until(StateId::kReady));
  w.press(hal::OperatorAction::kPlay);
  REQUIRE(w.run_to_end());
  CHECK(w.ending.outcome == Outcome::kDone);
  CHECK(most == kLooksMax);
  CHECK(std::count(w.shown.begin(), w.shown.end(), "the picture does not stand still: 0.25 px from frame to frame") ==
        ScriptedWorld::default_settings().calibration_views_max);
}

TEST_CASE("a look whose pictures are gone says that the computer is too slow", "[machine]") {
  ScriptedWorld w;
  w.detect = [&](const DetectArguments& a) {
    DetectResult r;
    r.changed = a.purpose == BoardLook::kIdentify;
    r.still = r.found = a.purpose != BoardLook::kCollect;
    return r;
  };
  REQUIRE(w.run_until(StateId::kReady));
  w.press(hal::OperatorAction::kPlay);
  REQUIRE(w.run_to_end());
  const auto says = [&w](std::string_view part) {
    return std::ranges::any_of(w.shown, [part](const std::string& line) { return line.contains(part); });
  };
  CHECK(says("too slow for the camera"));
  CHECK_FALSE(says("does not stand still"));
}

TEST_CASE("the board is not judged to have moved by a picture that moves", "[machine]") {
  ScriptedWorld w;
  w.check = {.seen = 1, .moved = 1, .still = false, .moved_px = 0.4};
  REQUIRE(w.run_until(StateId::kReady));
  w.press(hal::OperatorAction::kPlay);
  REQUIRE(w.run_until(StateId::kVerifyBoard, 4000));
  for (int i = 0; i < 250; ++i) w.tick();  // 2 s
  REQUIRE(w.machine.state() == StateId::kVerifyBoard);
  w.check = {.seen = 1, .moved = 0};
  REQUIRE(w.run_to_end());
  CHECK(w.ending.outcome == Outcome::kDone);
}

TEST_CASE("a frozen depth camera stops the job", "[machine]") {
  ScriptedWorld world;
  world.integrated.frozen = true;
  world.run_until(StateId::kReady);
  world.press(OperatorAction::kPlay);
  REQUIRE(world.run_to_end());
  CHECK(world.ending.outcome == Outcome::kSafelyStopped);
  CHECK(world.ending.fault == Fault::kStreamFrozen);
}

TEST_CASE("a look at a camera that delivers nothing ends with a stale stream", "[machine]") {
  ScriptedWorld world;
  world.run_until(StateId::kReady);
  world.press(OperatorAction::kPlay);
  REQUIRE(world.run_until(StateId::kSweep));
  world.depth_frames = false;
  REQUIRE(world.run_to_end(20));
  CHECK(world.ending.fault == Fault::kStreamStale);
}

TEST_CASE("an obstacle that a frame shows on the way stops the arm and another way is chosen", "[machine]") {
  ScriptedWorld world;
  world.run_until(StateId::kReady);
  world.press(OperatorAction::kPlay);
  REQUIRE(world.run_until(StateId::kMove));
  world.guardian_margin_m = -0.01;
  world.tick();
  CHECK(world.machine.state() == StateId::kLook);
  REQUIRE(world.stops.size() == 1);
  CHECK(world.stops[0] == Fault::kGuardianStop);
  world.guardian_margin_m = 0.1;
  REQUIRE(world.run_to_end());
  CHECK(world.ending.outcome == Outcome::kDone);
}

namespace {
MachineSettings with_scope(RunScope scope) {
  MachineSettings s = ScriptedWorld::default_settings();
  s.scope = scope;
  return s;
}
int looks_to_verify(const ScriptedWorld& world) {
  return static_cast<int>(std::count_if(world.shown.begin(), world.shown.end(),
                                        [](const std::string& line) { return line.starts_with("verification view"); }));
}
}  // namespace

TEST_CASE("calibrate only: no mapping, and no word of a stored calibration", "[machine]") {
  ScriptedWorld world(with_scope(RunScope::kCalibrate));
  world.run_until(StateId::kReady);
  world.press(OperatorAction::kPlay);
  REQUIRE(world.run_to_end());
  CHECK(world.ending.outcome == Outcome::kDone);
  CHECK(world.was_in(StateId::kValidate));
  for (const StateId state : {StateId::kVerifyCalibration, StateId::kSweep, StateId::kVerifyBoard}) {
    CHECK_FALSE(world.was_in(state));
  }
}

TEST_CASE("verify only: three views test the stored calibration, and the arm parks", "[machine]") {
  ScriptedWorld world(with_scope(RunScope::kVerify));
  world.run_until(StateId::kReady);
  world.press(OperatorAction::kPlay);
  REQUIRE(world.run_to_end());
  CHECK(world.ending.outcome == Outcome::kDone);
  CHECK_FALSE(world.ending.has_fault);
  for (const StateId state : {StateId::kLocateBoard, StateId::kVerifyCalibration, StateId::kPark, StateId::kReport}) {
    INFO(state_row(state).name);
    CHECK(world.was_in(state));
  }
  for (const StateId state : {StateId::kIdentifyLink, StateId::kCollect, StateId::kSolve, StateId::kValidate,
                              StateId::kSweep, StateId::kVerifyBoard}) {
    INFO(state_row(state).name);
    CHECK_FALSE(world.was_in(state));
  }
  CHECK(looks_to_verify(world) == 2);  // besides the one from where the board was found
  CHECK(world.plans_for(MotionPhase::kMapping) == 0);
}

TEST_CASE("map only: the camera is trusted from the verification on, not before", "[machine]") {
  ScriptedWorld world(with_scope(RunScope::kMap));
  world.run_until(StateId::kReady);
  world.press(OperatorAction::kPlay);
  REQUIRE(world.run_until(StateId::kSweep));
  CHECK(world.plans_for(MotionPhase::kMapping) == 0);
  REQUIRE(world.run_to_end());
  CHECK(world.ending.outcome == Outcome::kDone);
  for (const StateId state : {StateId::kVerifyCalibration, StateId::kSweep, StateId::kLook, StateId::kVerifyBoard}) {
    CHECK(world.was_in(state));
  }
  for (const StateId state : {StateId::kIdentifyLink, StateId::kCollect, StateId::kSolve, StateId::kValidate}) {
    CHECK_FALSE(world.was_in(state));
  }
  CHECK(world.plans_for(MotionPhase::kMapping) > 0);
}

TEST_CASE("a stored calibration that fails its test maps nothing and is never trusted", "[machine]") {
  const RunScope scope = GENERATE(RunScope::kMap, RunScope::kVerify);
  ScriptedWorld world(with_scope(scope));
  world.verify.accepted = false;
  world.run_until(StateId::kReady);
  world.press(OperatorAction::kPlay);
  REQUIRE(world.run_to_end());
  CHECK(world.ending.outcome == Outcome::kCalibrationRejected);
  CHECK(world.ending.fault == Fault::kCalibrationRejected);
  CHECK(world.was_in(StateId::kPark));
  CHECK_FALSE(world.was_in(StateId::kSweep));
  CHECK(world.plans_for(MotionPhase::kMapping) == 0);
}

TEST_CASE("more views where three leave the test too weak, but not without end", "[machine]") {
  ScriptedWorld world(with_scope(RunScope::kVerify));
  world.verification_view.target_met = false;
  world.run_until(StateId::kReady);
  world.press(OperatorAction::kPlay);
  REQUIRE(world.run_to_end());
  CHECK(looks_to_verify(world) == 7);
  CHECK(world.ending.outcome == Outcome::kDone);  // the job that tests decides
}

TEST_CASE("a board that is lost while verifying leaves the verdict to what was seen", "[machine]") {
  ScriptedWorld world(with_scope(RunScope::kMap));
  world.detect = [](const DetectArguments& a) {
    DetectResult r;
    r.found = a.purpose == BoardLook::kLocate;
    return r;
  };
  world.verification_view.found = false;
  world.verify.accepted = false;
  world.run_until(StateId::kReady);
  world.press(OperatorAction::kPlay);
  REQUIRE(world.run_to_end());
  CHECK(world.ending.outcome == Outcome::kCalibrationRejected);
}

TEST_CASE("a pause while verifying goes on with the views that are missing", "[machine]") {
  ScriptedWorld world(with_scope(RunScope::kMap));
  world.run_until(StateId::kReady);
  world.press(OperatorAction::kPlay);
  REQUIRE(world.run_until(StateId::kVerifyCalibration));
  for (int i = 0; i < 150; ++i) world.tick();
  REQUIRE(world.machine.state() == StateId::kVerifyCalibration);
  world.consent = false;
  world.tick();
  CHECK(world.machine.state() == StateId::kPaused);
  for (int i = 0; i < 300; ++i) world.tick();
  world.consent = true;
  for (int i = 0; i < 3; ++i) world.tick();
  CHECK(world.machine.state() == StateId::kVerifyCalibration);
  REQUIRE(world.run_to_end());
  CHECK(world.ending.outcome == Outcome::kDone);
}

namespace {

/// A job that asks for three corners, up to where a person is asked to touch the first.
MachineSettings with_touch_test(RunScope scope = RunScope::kEverything) {
  MachineSettings settings = with_scope(scope);
  for (const int point : {0, 8, 45}) settings.touch_points.push_back(point);
  settings.touch_columns = 9;
  settings.touch_time_max_s = 60;
  return settings;
}

void run_to_touch_test(ScriptedWorld& world) {
  world.run_until(StateId::kReady);
  world.press(OperatorAction::kPlay);
  REQUIRE(world.run_until(StateId::kTouchTest));
}

void touch_corners(ScriptedWorld& world, int corners) {
  for (int i = 0; i < corners; ++i) {
    world.lead(1, 0.1);
    world.wait(1);
    world.press(OperatorAction::kConfirm);
  }
}

}  // namespace

TEST_CASE("a person touches the corners asked for and brings the arm back, firstlook moves nothing meanwhile",
          "[machine]") {
  ScriptedWorld world(with_touch_test());
  std::vector<TouchedPoint> touches;
  world.touch_test = [&](const TouchTestArguments& a) {
    touches.assign(a.touches.begin(), a.touches.end());
    TouchTestResult r;
    r.usable = r.agrees = true;
    return r;
  };
  run_to_touch_test(world);
  CHECK(world.has_shown("touch 1 of 3: lead the tip onto column 0, row 0"));
  const std::size_t segments = world.segments.size();
  const JointVector home = world.position_rad();
  world.guardian_margin_m = -0.5;  // far outside of what is known free: it is not firstlook that moves
  touch_corners(world, 3);
  CHECK(world.has_shown("touch 2 of 3: lead the tip onto column 8, row 0"));
  CHECK(world.has_shown("touch 3 of 3: lead the tip onto column 0, row 5"));
  CHECK(world.has_shown("bring the arm back"));
  world.lead(1, -0.3);
  world.wait(1);
  CHECK(world.machine.state() == StateId::kTouchTest);
  CHECK(world.segments.size() == segments);
  CHECK(world.stops.empty());
  CHECK(touches.empty());
  world.guardian_margin_m = 0.1;
  const int forgotten = world.forgotten;
  world.press(OperatorAction::kConfirm);
  REQUIRE(world.run_until(StateId::kSweep, 5));
  CHECK(world.forgotten == forgotten + 1);
  REQUIRE(touches.size() == 3);
  CHECK(touches[2].point == 45);
  for (int i = 0; i < 3; ++i) {
    CHECK(touches[static_cast<std::size_t>(i)].at_rad[1] - home[1] == Approx(0.1 * (i + 1)).margin(1e-9));
  }
  REQUIRE(world.run_to_end());
  CHECK(world.ending.outcome == Outcome::kDone);
}

TEST_CASE("a touch counts when the arm stands still, and once", "[machine]") {
  ScriptedWorld world(with_touch_test(RunScope::kCalibrate));
  std::size_t touches = 0;
  world.touch_test = [&](const TouchTestArguments& a) {
    touches = a.touches.size();
    TouchTestResult r;
    r.usable = r.agrees = true;
    return r;
  };
  run_to_touch_test(world);
  world.lead(0, 0.2);
  world.press(OperatorAction::kConfirm);
  CHECK(world.has_shown("must stand still"));
  CHECK_FALSE(world.has_shown("touch 2 of 3"));
  touch_corners(world, 1);
  CHECK(world.has_shown("touch 2 of 3"));
  world.press(OperatorAction::kConfirm);
  CHECK(world.has_shown("still stands where it touched the last corner"));
  CHECK_FALSE(world.has_shown("touch 3 of 3"));
  touch_corners(world, 2);
  world.press(OperatorAction::kPlay);  // of no meaning here
  world.wait(1);
  world.press(OperatorAction::kConfirm);
  REQUIRE(world.run_to_end());
  CHECK(touches == 3);
  CHECK(world.ending.outcome == Outcome::kDone);
  CHECK_FALSE(world.was_in(StateId::kSweep));
}

TEST_CASE("an arm that is not brought back moves nothing: asked again, then the job ends", "[machine]") {
  ScriptedWorld world(with_touch_test());
  run_to_touch_test(world);
  touch_corners(world, 3);
  const auto plan = world.plan;
  world.plan = [](const PlanArguments&) {
    return PlanResult{.found = false, .fault = Fault::kStartBlocked, .path = {}};
  };
  const std::size_t segments = world.segments.size();
  world.wait(1);
  world.press(OperatorAction::kConfirm);
  world.wait(1);
  CHECK(world.machine.state() == StateId::kTouchTest);
  CHECK(world.has_shown("bring the arm into the safe zone"));
  SECTION("brought back in the end") {
    world.plan = plan;
    world.press(OperatorAction::kConfirm);
    CHECK(world.run_until(StateId::kSweep, 5));
    REQUIRE(world.run_to_end());
    CHECK(world.ending.outcome == Outcome::kDone);
  }
  SECTION("left where it is") {
    REQUIRE(world.run_to_end(100));
    CHECK(world.ending.outcome == Outcome::kSafelyStopped);
    CHECK(world.ending.fault == Fault::kTouchTestEnded);
    CHECK(world.segments.size() == segments);
  }
}

TEST_CASE("nobody who touches, a stop, and a pause in which the arm is led", "[machine]") {
  ScriptedWorld world(with_touch_test());
  run_to_touch_test(world);
  touch_corners(world, 1);
  const std::size_t segments = world.segments.size();
  SECTION("nobody: after its time the job ends where the arm is") {
    REQUIRE(world.run_to_end(100));
    CHECK(world.ending.outcome == Outcome::kSafelyStopped);
    CHECK(world.ending.fault == Fault::kTouchTestEnded);
    CHECK(world.segments.size() == segments);
  }
  SECTION("stop") {
    world.press(OperatorAction::kStop);
    CHECK(world.ended);
    CHECK(world.ending.fault == Fault::kProgramStopped);
    CHECK(world.segments.size() == segments);
  }
  SECTION("a protective stop while somebody leads the arm") {
    world.safety = hal::ArmSafety::kProtectiveStop;
    world.tick();
    CHECK(world.ending.fault == Fault::kProtectiveStop);
  }
  SECTION("a pause longer than the time for a corner, the arm led meanwhile: touches stay") {
    world.press(OperatorAction::kPause);
    world.consent = false;
    CHECK(world.machine.state() == StateId::kPaused);
    world.lead(2, 0.2);
    world.wait(70);
    CHECK(world.machine.state() == StateId::kPaused);
    world.consent = true;
    REQUIRE(world.run_until(StateId::kTouchTest, 1));
    touch_corners(world, 2);
    world.lead(2, -0.2);
    world.wait(1);
    CHECK(world.segments.size() == segments);
    world.press(OperatorAction::kConfirm);
    CHECK(world.run_until(StateId::kSweep, 5));
  }
}

TEST_CASE("touches that contradict the calibration, or tell nothing, map nothing", "[machine]") {
  const bool usable = GENERATE(true, false);
  ScriptedWorld world(with_touch_test());
  world.touch_test = [usable](const TouchTestArguments&) {
    TouchTestResult r;
    r.usable = usable;
    r.fault = Fault::kTouchesUnusable;
    return r;
  };
  run_to_touch_test(world);
  touch_corners(world, 3);
  world.wait(1);
  world.press(OperatorAction::kConfirm);
  REQUIRE(world.run_to_end());
  CHECK(world.ending.outcome == Outcome::kCalibrationRejected);
  CHECK(world.ending.fault == (usable ? Fault::kCalibrationRejected : Fault::kTouchesUnusable));
  CHECK(world.was_in(StateId::kPark));
  CHECK_FALSE(world.was_in(StateId::kSweep));
  CHECK(world.plans_for(MotionPhase::kMapping) == 0);
}

TEST_CASE("the state table is sound", "[machine]") {
  std::set<std::string_view> names;
  for (const StateRow& row : state_table()) {
    CHECK(names.insert(row.name).second);
    CHECK(is_within(row.state, row.state));
    for (const Transition& t : row.transitions) CHECK(t.to < StateId::kNone);
  }
  // Whatever runs can be paused and stopped.
  for (const StateRow& row : state_table()) {
    if (!is_within(row.state, StateId::kRunning)) continue;
    CHECK(is_within(row.state, StateId::kRunning));
  }
  CHECK(state_diagram().find("Ready --> LocateBoard") != std::string::npos);
}

TEST_CASE("with several boards the search goes on until all were seen, and each is looked at again", "[machine]") {
  MachineSettings settings = ScriptedWorld::default_settings();
  settings.targets = 3;
  ScriptedWorld world(settings);
  int looks = 0;
  world.detect = [&](const DetectArguments& a) {
    DetectResult r;
    r.found = a.purpose != BoardLook::kLocate || looks != 1;
    r.changed = a.purpose == BoardLook::kIdentify;
    r.targets = 1;
    if (a.purpose == BoardLook::kLocate) r.targets = looks++ == 0 ? 1 : 2;  // the third is nowhere
    return r;
  };
  world.solve.targets = 3;
  world.check.seen = 3;
  world.run_until(StateId::kReady);
  world.press(OperatorAction::kPlay);
  REQUIRE(world.run_to_end());
  CHECK(looks == world.locate_views);
  CHECK(world.ending.outcome == Outcome::kDone);
  CHECK(std::ranges::count(world.shown, "2 of 3 boards were seen") == 1);

  // The same job where the solve placed and the end shows these targets only.
  const auto finish = [&](ScriptedWorld& again, TargetMask solved, TargetMask seen_at_end) {
    looks = 0;
    again.detect = world.detect;
    again.solve.targets = solved;
    again.check.seen = seen_at_end;
    again.run_until(StateId::kReady);
    again.press(OperatorAction::kPlay);
    REQUIRE(again.run_to_end());
    return std::ranges::count(again.shown, "looking at the board again");
  };
  ScriptedWorld again(settings);
  SECTION("the second is not where it was") {
    CHECK(finish(again, 3, 1) == 2);
    CHECK(again.ending.fault == Fault::kBoardNotFound);
  }
  SECTION("one that the solve could not place is not missed") {
    CHECK(finish(again, 1, 1) == 1);
    CHECK(again.ending.outcome == Outcome::kDone);
  }
}

}  // namespace firstlook
