/// IdentifyLink: move joints from the outermost inwards; the first that moves the image carries the camera.
#include <cmath>

#include "app/machine/states/states.hpp"

namespace firstlook::states {
namespace {

/// The joint that differs between two configurations the most.
int moved_joint(const JointVector& from, const JointVector& to) {
  int joint = 0;
  for (int i = 1; i < to.size(); ++i) {
    if (std::abs(to[i] - from[i]) > std::abs(to[joint] - from[joint])) joint = i;
  }
  return joint;
}

int motion_joint(Machine& m) {
  return moved_joint(m.progress().board_view_rad, m.progress().views.views_rad[m.progress().view]);
}

void conclude_on_inner_link(Machine& m, int low, int high) {
  m.conclude(Outcome::kCalibrationRejected, Fault::kCameraOnInnerLink);
  m.progress().ending.camera_link_low = low;
  m.progress().ending.camera_link_high = high;
}

/// No joint changed the picture of the board; some may have lost it.
void conclude_without_change(Machine& m) {
  const Progress& p = m.progress();
  if (p.still_images == 0) {  // nothing says that the camera is not on the arm: the board was lost each time
    m.conclude(Outcome::kCalibrationRejected, Fault::kBoardNotFound);
  } else if (p.still_joint == 0) {
    m.conclude(Outcome::kCalibrationRejected, Fault::kCameraNotOnArm);
  } else {
    conclude_on_inner_link(m, 1, p.still_joint);  // the joints within the still one lost the board, or cannot move
  }
}

void next_motion(Machine& m) {
  Progress& p = m.progress();
  if (p.view >= p.views.views_rad.size()) {
    conclude_without_change(m);
    return;
  }
  const JointVector& target = p.views.views_rad[p.view];
  m.show("identifying the camera's link, joint {}", motion_joint(m) + 1);
  plan_to(m, target, phase_of(m));
}

}  // namespace

void enter_identify_link(Machine& m) {
  m.progress().view = 0;
  m.progress().still_images = 0;
  m.start_job(JobKind::kIdentifyMotions, FromHere{m.progress().board_view_rad, 0, m.now().seconds()});
}

Handled on_identify_link(Machine& m, const MachineEvent& event) {
  Progress& p = m.progress();
  if (const auto list = m.result_of<ViewList>(JobKind::kIdentifyMotions, event)) {
    p.views = *list;
    next_motion(m);
  } else if (const auto plan = m.result_of<PlanResult>(JobKind::kPlan, event)) {
    if (plan->found) {
      m.start_trip(plan->path, Machine::OnTheWay::kNothing);
    } else {
      ++p.view;
      next_motion(m);
    }
  } else if (m.advance_look(event)) {
    m.start_job(JobKind::kDetectBoard, DetectArguments{BoardLook::kIdentify, p.view, m.look()});
  } else if (const auto seen = m.result_of<DetectResult>(JobKind::kDetectBoard, event)) {
    if (seen->found && seen->changed) {
      // An outer joint that moved the arm but not the image lies beyond the camera; one that took the board out of view
      // says nothing.
      if (p.still_images == 0) {
        p.camera_on_flange = true;
        m.transition(StateId::kCollect);
      } else {
        conclude_on_inner_link(m, motion_joint(m) + 1, p.still_joint);
      }
    } else {
      // Each joint is turned to both sides at most: to the other one only when the board left the view on the first.
      const int joint = motion_joint(m);
      ++p.view;
      if (seen->found) {
        ++p.still_images;
        p.still_joint = joint;
        while (p.view < p.views.views_rad.size() && motion_joint(m) == joint) ++p.view;
      }
      next_motion(m);
    }
  }
  switch (m.advance_trip(event)) {
    case Machine::Trip::kArrived:
      m.start_look(false, 1);
      break;
    case Machine::Trip::kInterrupted:
      next_motion(m);
      break;
    default:
      break;
  }
  return Handled::kNo;
}

}  // namespace firstlook::states
