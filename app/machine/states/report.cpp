/// Report: what remains unknown, and why; then the job is over.
#include "app/machine/states/states.hpp"

namespace firstlook::states {

void enter_report(Machine& m) { m.start_job(JobKind::kSummarize, NoArguments{}); }

Handled on_report(Machine& m, const MachineEvent& event) {
  if (m.result_of<SummarizeResult>(JobKind::kSummarize, event)) {
    m.finish(m.progress().ending);
    m.transition(StateId::kReady);
  }
  return Handled::kNo;
}

}  // namespace firstlook::states
