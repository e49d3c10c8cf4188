/// Every fault that a user can meet: its number, how bad it is, what it says and what to do.
/// `firstlook explain CODE` and the reports come from this table. Numbers are stable: never reuse one.
/// 1xxx platform, 2xxx calibration and vision, 3xxx map, 4xxx motion and views, 5xxx devices, 6xxx configuration and
/// data, 7xxx the job.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

namespace firstlook {

enum class Severity : std::uint8_t { kNotice, kRefusal, kStop, kInternal };

// clang-format off
#define FIRSTLOOK_FAULTS(X) \
  X(kInternal,               1000, kInternal, "internal fault",                       "Report it with the run folder; `firstlook bundle` packs it.") \
  X(kOutOfMemory,            1001, kRefusal,  "memory budget exceeded",               "Choose a coarser map or smaller extents, or raise the budget.") \
  X(kDiskWrite,              1002, kRefusal,  "cannot write a file",                  "Free disk space and check that the folder is writable.") \
  X(kQueueFull,              1003, kStop,     "event queue full",                     "The computer is too slow or too busy; stop other programs.") \
  X(kJournalBroken,          1004, kRefusal,  "journal unreadable",                   "The file is cut short or altered; use the journal of another run.") \
  X(kReplayDiffers,          1005, kRefusal,  "replay differs from the record",       "Use the version that wrote the journal, or report the difference.") \
  X(kUnexpectedEvent,        1006, kStop,     "an event that no state expects",       "Report it with the run folder.") \
  X(kBoardNotFound,          2001, kRefusal,  "board not found in the image",         "Clean the lens, check the light and that the whole board is visible.") \
  X(kDegenerateMotion,       2002, kRefusal,  "the motions do not determine the hand-eye transform", "Add views that rotate about at least two axes by 20 degrees or more.") \
  X(kTooFewViews,            2003, kRefusal,  "too few usable views",                 "Record more views of the board.") \
  X(kSolveFailed,            2004, kRefusal,  "the calibration did not converge",     "Check board size, poses and their frames.") \
  X(kBoardNotLocated,        2005, kRefusal,  "no board seen from the safe zone",     "Put the board where the camera can see it from the safe zone and light it.") \
  X(kCameraNotOnArm,         2006, kRefusal,  "camera not on the arm",                "No joint moves the image: mount the camera on the arm, or free a stuck joint.") \
  X(kCalibrationRejected,    2007, kRefusal,  "calibration rejected",                 "See the reasons in the report; check the mount, the board and its size.") \
  X(kBoardMoved,             2008, kRefusal,  "the board moved during the job",       "Fix the board and the cart, then start again.") \
  X(kCameraOnInnerLink,      2009, kRefusal,  "the camera is not on the last link",   "Mount the camera on the flange: only that is calibrated so far.") \
  X(kIntrinsicsUnknown,      2010, kRefusal,  "the views do not determine the camera's intrinsics", "Add views that are tilted by 20 to 40 degrees to all sides and cover the whole picture, or give a camera_info.yaml.") \
  X(kTouchesUnusable,        2011, kRefusal,  "the touches do not determine where the board is", "Touch three corners or more that are not on a line; tilt the arm to different sides between touches, or give the tip's offset.") \
  X(kMapTooLarge,            3001, kRefusal,  "the map does not fit its memory",      "Choose a coarser resolution or smaller extents.") \
  X(kFrameRefused,           3002, kNotice,   "depth frame refused",                  "Check the depth stream: size, scale and time stamps.") \
  X(kMapUnreadable,          3003, kRefusal,  "map file unreadable",                  "Use a .bt or .ot file that OctoMap can read.") \
  X(kNoPath,                 4001, kNotice,   "no certified path",                    "Known free space does not connect start and goal; give more room or more views.") \
  X(kStartBlocked,           4002, kStop,     "the arm does not stand in known free space", "Jog the arm into the safe zone and start again.") \
  X(kNothingReachable,       4003, kRefusal,  "no reachable view",                    "Enlarge the safe zone, or move the arm away from obstacles.") \
  X(kDeviation,              4004, kStop,     "the arm left its path",                "Check payload and speed settings; start again.") \
  X(kGuardianStop,           4005, kStop,     "the guardian saw the arm leave known free space", "Look at the cell, then start again.") \
  X(kDeviceMissing,          5001, kRefusal,  "device missing",                       "Check power and cable; `firstlook check` lists the devices.") \
  X(kLinkLost,               5002, kStop,     "lost the link to the robot",           "Check the network cable and the controller, then press start again.") \
  X(kStreamStale,            5003, kStop,     "a camera stream stopped",              "Check the camera's cable and power, then press start again.") \
  X(kProtectiveStop,         5004, kStop,     "protective or emergency stop",         "Find the cause, clear it at the pendant, then press start again.") \
  X(kProgramStopped,         5005, kStop,     "stopped by the operator",              "Press start for a new job.") \
  X(kFrameGone,              5006, kNotice,   "a frame is no longer held by its device", "The computer is too slow for the stream.") \
  X(kMoveRefused,            5007, kStop,     "the controller refused a move",        "Check the joint limits and speeds of the configuration against the controller's.") \
  X(kNotStarted,             5008, kRefusal,  "nobody pressed Play",                  "Press Play on the pendant within 10 minutes of the start, then the start button where one is configured.") \
  X(kPausedTooLong,          5009, kStop,     "paused for longer than an hour",       "Press start for a new job.") \
  X(kClockWrong,             5010, kStop,     "a camera's time stamps do not fit the arm's", "Set the camera's clock and latency: the arm's pose at the time of a frame must be known.") \
  X(kStreamFrozen,           5011, kStop,     "a camera repeats one picture",         "Restart the camera, check its cable and power, then press start again.") \
  X(kTookTooLong,            5012, kStop,     "the job took longer than three hours", "See in the report which phase took so long.") \
  X(kTouchTestEnded,         5013, kStop,     "the touch test was not carried on", "Lead the tip onto the corner that the pendant names and confirm, within 10 minutes each; at the end bring the arm back into the safe zone.") \
  X(kPanelLost,              5014, kStop,     "lost the button panel, and with it its stop button", "Check the panel's power, its cable and the CAN bus: `firstlook check` tells which; then press start again.") \
  X(kConfigUnreadable,       6001, kRefusal,  "configuration not readable",           "Correct the file; `firstlook config --defaults` shows every key.") \
  X(kConfigUnknownKey,       6002, kRefusal,  "unknown configuration key",            "Correct the key; `firstlook config --defaults` shows every key.") \
  X(kConfigBadValue,         6003, kRefusal,  "configuration value out of range",     "Correct the value; `firstlook config --defaults` shows the defaults.") \
  X(kDataMissing,            6101, kRefusal,  "data missing",                         "Check the path and the names of the files.") \
  X(kDataMalformed,          6102, kRefusal,  "data malformed",                       "Correct the file at the place named.") \
  X(kOutputNotEmpty,         6103, kRefusal,  "output folder exists and is not empty", "Choose another folder with --out.") \
  X(kCellInvalid,            6104, kRefusal,  "the cell cannot be used",              "Correct the cell file at the place named.") \
  X(kStoredCalibration,      6105, kRefusal,  "the stored calibration cannot be used", "Make one here with `firstlook run --only calibrate` and give its hand_eye.yaml.") \
  X(kUsage,                  6201, kRefusal,  "wrong usage",                          "See --help.")
// clang-format on

enum class Fault : std::uint16_t {
#define FIRSTLOOK_FAULT_ENUM(name, code, severity, text, remedy) name = (code),
  FIRSTLOOK_FAULTS(FIRSTLOOK_FAULT_ENUM)
#undef FIRSTLOOK_FAULT_ENUM
};

struct FaultRow {
  Fault fault;
  Severity severity;
  std::string_view name;
  std::string_view text;
  std::string_view remedy;
};

/// All rows, in the order of their numbers within each block.
[[nodiscard]] std::span<const FaultRow> fault_table();
[[nodiscard]] const FaultRow& fault_row(Fault fault);
[[nodiscard]] std::optional<FaultRow> find_fault(int code);

}  // namespace firstlook
