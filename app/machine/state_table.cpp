#include "app/machine/state_table.hpp"

#include <fmt/format.h>

#include <array>

#include "app/machine/states/states.hpp"
#include "platform/core/ensure.hpp"

namespace firstlook {
namespace {
using S = StateId;
using enum StateId;

constexpr std::array kFromBoot = {Transition{"all devices report", kReady}, Transition{"a device is missing", kFaulted},
                                  Transition{"shutdown", kStopped}};
constexpr std::array kFromReady = {Transition{"Play or start button", kLocateBoard},
                                   Transition{"link lost, protective stop, shutdown", kStopped}};
constexpr std::array kFromRunning = {Transition{"pause", kPaused},
                                     Transition{"stop, link lost, panel lost, stale stream", kStopped},
                                     Transition{"unexpected event", kFaulted}, Transition{"cannot go on", kPark}};
constexpr std::array kFromLocate = {Transition{"board seen", kIdentifyLink},
                                    Transition{"board seen, calibration stored", kVerifyCalibration}};
constexpr std::array kFromIdentify = {Transition{"camera on the flange", kCollect}};
constexpr std::array kFromCollect = {Transition{"sigma reached or no view helps", kSolve}};
constexpr std::array kFromSolve = {Transition{"solved", kValidate}};
constexpr std::array kFromValidate = {Transition{"accepted", kSweep},
                                      Transition{"accepted, touch test asked for", kTouchTest},
                                      Transition{"the last view contradicts", kCollect}};
constexpr std::array kFromTouchTest = {Transition{"touches agree", kSweep}};
constexpr std::array kFromVerify = {Transition{"stored calibration holds", kSweep}};
constexpr std::array kFromSweep = {Transition{"nothing more in the sweep", kChoose}};
constexpr std::array kFromChoose = {Transition{"view chosen", kPlan}, Transition{"nothing more to see", kVerifyBoard},
                                    Transition{"surroundings not free", kLook}};
constexpr std::array kFromPlan = {Transition{"certified", kMove}, Transition{"not certified", kChoose}};
constexpr std::array kFromMove = {Transition{"arrived or interrupted", kLook}};
constexpr std::array kFromLook = {Transition{"frame integrated", kChoose},
                                  Transition{"frame integrated, next view chosen before", kPlan}};
constexpr std::array kFromPark = {Transition{"parked", kReport}};
constexpr std::array kFromReport = {Transition{"reported", kReady}};
constexpr std::array kFromPaused = {Transition{"resume", kLocateBoard},
                                    Transition{"resume", kIdentifyLink},
                                    Transition{"resume", kCollect},
                                    Transition{"resume", kSolve},
                                    Transition{"resume", kValidate},
                                    Transition{"resume", kTouchTest},
                                    Transition{"resume", kVerifyCalibration},
                                    Transition{"resume", kSweep},
                                    Transition{"resume", kChoose},
                                    Transition{"resume", kVerifyBoard},
                                    Transition{"resume", kPark},
                                    Transition{"resume", kReport},
                                    Transition{"stop", kStopped},
                                    Transition{"unexpected event", kFaulted}};

constexpr std::array kRows = {
    StateRow{kBoot, kNone, "Boot", states::enter_boot, nullptr, states::on_boot, kFromBoot},
    StateRow{kReady, kNone, "Ready", states::enter_ready, states::exit_ready, states::on_ready, kFromReady},
    StateRow{kRunning, kNone, "Running", states::enter_running, nullptr, states::on_running, kFromRunning},
    StateRow{kLocateBoard, kRunning, "LocateBoard", states::enter_locate_board, nullptr, states::on_locate_board,
             kFromLocate},
    StateRow{kIdentifyLink, kRunning, "IdentifyLink", states::enter_identify_link, nullptr, states::on_identify_link,
             kFromIdentify},
    StateRow{kCalibrate, kRunning, "Calibrate", nullptr, nullptr, nullptr, {}},
    StateRow{kCollect, kCalibrate, "Collect", states::enter_collect, nullptr, states::on_collect, kFromCollect},
    StateRow{kSolve, kCalibrate, "Solve", states::enter_solve, nullptr, states::on_solve, kFromSolve},
    StateRow{kValidate, kCalibrate, "Validate", states::enter_validate, nullptr, states::on_validate, kFromValidate},
    StateRow{kTouchTest, kCalibrate, "TouchTest", states::enter_touch_test, states::exit_touch_test,
             states::on_touch_test, kFromTouchTest},
    StateRow{kVerifyCalibration, kRunning, "VerifyCalibration", states::enter_verify_calibration, nullptr,
             states::on_verify_calibration, kFromVerify},
    StateRow{kSweep, kRunning, "Sweep", states::enter_sweep, nullptr, states::on_sweep, kFromSweep},
    StateRow{kExplore, kRunning, "Explore", nullptr, nullptr, nullptr, {}},
    StateRow{kChoose, kExplore, "Choose", states::enter_choose, nullptr, states::on_choose, kFromChoose},
    StateRow{kPlan, kExplore, "Plan", states::enter_plan, nullptr, states::on_plan, kFromPlan},
    StateRow{kMove, kExplore, "Move", states::enter_move, nullptr, states::on_move, kFromMove},
    StateRow{kLook, kExplore, "Look", states::enter_look, nullptr, states::on_look, kFromLook},
    StateRow{kConclude, kRunning, "Conclude", nullptr, nullptr, nullptr, {}},
    StateRow{kVerifyBoard, kConclude, "VerifyBoard", states::enter_verify_board, nullptr, states::on_verify_board, {}},
    StateRow{kPark, kConclude, "Park", states::enter_park, nullptr, states::on_park, kFromPark},
    StateRow{kReport, kRunning, "Report", states::enter_report, nullptr, states::on_report, kFromReport},
    StateRow{kPaused, kNone, "Paused", states::enter_paused, states::exit_paused, states::on_paused, kFromPaused},
    StateRow{kStopped, kNone, "Stopped", states::enter_stopped, nullptr, states::on_ended, {}},
    StateRow{kFaulted, kNone, "Faulted", states::enter_faulted, nullptr, states::on_ended, {}},
};

void draw(std::string& out, StateId parent, int depth) {
  const std::string indent(static_cast<std::size_t>(depth) * 2, ' ');
  for (const StateRow& row : kRows) {
    if (row.parent != parent) continue;
    bool has_children = false;
    for (const StateRow& other : kRows) has_children = has_children || other.parent == row.state;
    if (has_children) {
      out += fmt::format("{}state {} {{\n", indent, row.name);
      draw(out, row.state, depth + 1);
      out += fmt::format("{}}}\n", indent);
    } else {
      out += fmt::format("{}{}\n", indent, row.name);
    }
  }
}

}  // namespace

std::span<const StateRow> state_table() { return kRows; }

const StateRow& state_row(StateId state) {
  ENSURE(7020, state < StateId::kNone);
  const StateRow& row = kRows[static_cast<std::size_t>(state)];
  ENSURE(7021, row.state == state);
  return row;
}

bool is_within(StateId state, StateId ancestor) {
  for (StateId at = state; at != StateId::kNone; at = state_row(at).parent) {
    if (at == ancestor) return true;
  }
  return false;
}

std::string state_diagram() {
  std::string out = "stateDiagram-v2\n  [*] --> Boot\n";
  draw(out, StateId::kNone, 1);
  for (const StateRow& row : kRows) {
    for (const Transition& t : row.transitions) {
      out += fmt::format("  {} --> {} : {}\n", row.name, state_row(t.to).name, t.cause);
    }
  }
  return out;
}

}  // namespace firstlook
