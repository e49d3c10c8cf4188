/// The states of the job as data: name, parent, handlers, and the transitions that are allowed out of each.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "app/machine/events.hpp"

namespace firstlook {

class Machine;

enum class StateId : std::uint8_t {
  kBoot,
  kReady,
  kRunning,
  kLocateBoard,
  kIdentifyLink,
  kCalibrate,
  kCollect,
  kSolve,
  kValidate,
  kTouchTest,
  kVerifyCalibration,
  kSweep,
  kExplore,
  kChoose,
  kPlan,
  kMove,
  kLook,
  kConclude,
  kVerifyBoard,
  kPark,
  kReport,
  kPaused,
  kStopped,
  kFaulted,
  kNone,  ///< parent of the outermost states
};

enum class Handled : std::uint8_t { kYes, kNo };

/// An allowed transition: what brings it about (for the diagram) and where it leads.
struct Transition {
  std::string_view cause;
  StateId to;
};

struct StateRow {
  StateId state;
  StateId parent;
  std::string_view name;
  void (*enter)(Machine&);                             ///< may be null
  void (*exit)(Machine&);                              ///< may be null
  Handled (*on_event)(Machine&, const MachineEvent&);  ///< may be null; kNo passes the event to the parent
  std::span<const Transition> transitions;
};

[[nodiscard]] std::span<const StateRow> state_table();
[[nodiscard]] const StateRow& state_row(StateId state);
[[nodiscard]] bool is_within(StateId state, StateId ancestor);

/// The table as a Mermaid state diagram: what `firstlook states` prints.
[[nodiscard]] std::string state_diagram();

}  // namespace firstlook
