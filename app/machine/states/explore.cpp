/// Explore: choose the next best view, certify the way, go there, look; until nothing more can be seen.
#include "app/machine/states/states.hpp"

namespace firstlook::states {
namespace {
constexpr std::uint32_t kReplansMax = 8;  // in a row, without a view between
// Voxels. A look that is expected to tell no more hardly changes what comes next: it is chosen on the way there. What
// it has told then decides whether it stands.
constexpr std::uint32_t kFew = 40;

/// As in views.csv, where the sweep's come first.
std::uint32_t next_number(const Progress& p) { return p.sweep_views + p.explore_views + 1; }
}  // namespace

void enter_choose(Machine& m) {
  Progress& p = m.progress();
  if (p.explore_views >= static_cast<std::uint32_t>(m.settings().explore_views_max) || p.replans > kReplansMax) {
    m.transition(StateId::kVerifyBoard);
    return;
  }
  p.chosen_ahead = false;
  m.start_job(JobKind::kNextView, FromHere{m.arm().position_rad, p.steps++, m.now().seconds()});
}

Handled on_choose(Machine& m, const MachineEvent& event) {
  if (const auto choice = m.result_of<NextViewResult>(JobKind::kNextView, event)) {
    Progress& p = m.progress();
    p.chosen = *choice;
    if (choice->found) {
      m.transition(StateId::kPlan);
    } else if (choice->blocked) {
      ++p.replans;
      m.show("view {}: looking around", next_number(p));
      m.transition(StateId::kLook);
    } else {
      m.transition(StateId::kVerifyBoard);
    }
  }
  return Handled::kNo;
}

void enter_plan(Machine& m) {
  certify_from_here(m, m.progress().chosen.path, MotionPhase::kMapping, m.progress().chosen_ahead);
}

Handled on_plan(Machine& m, const MachineEvent& event) {
  if (const auto plan = m.result_of<PlanResult>(JobKind::kCertifyPath, event)) {
    if (plan->found) {
      m.transition(StateId::kMove);
    } else {
      ++m.progress().replans;
      m.transition(StateId::kChoose);
    }
  }
  return Handled::kNo;
}

void enter_move(Machine& m) {
  Progress& p = m.progress();
  if (p.chosen.gain_expected > 0) {
    m.show("view {}: expecting {:.0f} new voxels", next_number(p), p.chosen.gain_expected);
  } else {
    m.show("view {}: another look, to have room to move", next_number(p));
  }
  m.start_trip(p.chosen.path, Machine::OnTheWay::kMap);
  if (p.chosen.gain_expected > 0 && p.chosen.gain_expected <= kFew) m.foresee(JobKind::kNextView);
}

Handled on_move(Machine& m, const MachineEvent& event) {
  switch (m.advance_trip(event)) {
    case Machine::Trip::kArrived:
      m.progress().replans = 0;
      m.transition(StateId::kLook);
      break;
    case Machine::Trip::kInterrupted:
      ++m.progress().replans;
      m.transition(StateId::kLook);
      break;
    default:
      break;
  }
  return Handled::kNo;
}

void enter_look(Machine& m) { m.start_look(true, 1); }

Handled on_look(Machine& m, const MachineEvent& event) {
  if (m.advance_look(event)) {
    m.integrate(m.look()[0], true);
  } else if (const auto result = m.integrate_result(event); result && result->at_view) {
    Progress& p = m.progress();
    ++p.explore_views;
    const bool told_little = result->used && p.unknown <= result->unknown + kFew;
    p.unknown = result->unknown;
    const auto next = m.foreseen_view();
    p.chosen_ahead = next && next->found && told_little &&
                     p.explore_views < static_cast<std::uint32_t>(m.settings().explore_views_max);
    if (p.chosen_ahead) p.chosen = *next;
    m.transition(p.chosen_ahead ? StateId::kPlan : StateId::kChoose);
  }
  return Handled::kNo;
}

}  // namespace firstlook::states
