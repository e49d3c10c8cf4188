/// What is to go wrong in a simulated cell, and when: options with seeds.
#pragma once

#include <limits>
#include <string_view>

#include "platform/core/result.hpp"

namespace firstlook::sim {

inline constexpr double kNever = std::numeric_limits<double>::infinity();

/// Times in seconds since the start; kNever where a thing does not happen. The names in comments are those of a
/// specification such as "depth.drop=0.05,operator.pause_at=20:5".
struct Faults {
  double color_drop = 0;              ///< color.drop: share of frames lost
  double depth_drop = 0;              ///< depth.drop
  double color_stall_s = kNever;      ///< color.stall_at: no frames any more
  double depth_stall_s = kNever;      ///< depth.stall_at
  double color_freeze_s = kNever;     ///< color.freeze_at: new stamps, the same picture
  double depth_freeze_s = kNever;     ///< depth.freeze_at
  double color_clock_offset_s = 0;    ///< color.clock: stamps are wrong by this much
  double depth_clock_offset_s = 0;    ///< depth.clock
  double color_focal_error = 0;       ///< color.focal: the camera states focal lengths too large by this share
  double color_center_error_px = 0;   ///< color.center: and a centre too far right and down by so many pixels
  double depth_shift_mm = 0;          ///< depth.shift: the depth camera sits so far from where its maker states it
  double depth_tilt_mrad = 0;         ///< depth.tilt: and is turned by so much
  double link_lost_s = kNever;        ///< link.lost_at: no reports, no commands
  double protective_stop_s = kNever;  ///< arm.protective_stop_at
  double emergency_stop_s = kNever;   ///< arm.emergency_stop_at
  double play_s = 0.5;                ///< operator.play_at; "never" for nobody
  double start_s = 1.0;               ///< operator.start_at: the button on the panel
  double pause_s = kNever;            ///< operator.pause_at=T:DURATION, resumed after it
  double pause_duration_s = kNever;
  double stop_s = kNever;         ///< operator.stop_at
  double panel_lost_s = kNever;   ///< panel.lost_at: the button panel is gone
  double board_move_s = kNever;   ///< board.move_at: slides by 3 cm and turns by 3 degrees
  double board_number = 1;        ///< board.number: which of the boards moves, counted from 1
  bool board_absent = false;      ///< board.absent=1: no board hangs in the cell
  bool camera_fixed = false;      ///< camera.fixed=1: it stands beside the arm
  double obstacle_s = kNever;     ///< obstacle.appear_at: a box appears in reach
  double touch_mixed_up = 0;      ///< touch.mixed_up: the touch with this number is made on the next corner in the row
  bool touch_left_there = false;  ///< touch.left_there=1: the arm is not brought back from the board
};

/// Reads a specification; empty is no fault. Errors: kUsage for an unknown name (with the nearest known one) or a value
/// that is not a number in its range.
[[nodiscard]] Result<Faults> parse_faults(std::string_view specification);

/// Whether any of them happens to the arm, its link or its pendant: not to cameras and cell alone.
[[nodiscard]] bool acts_on_arm(const Faults& faults);

}  // namespace firstlook::sim
