#include "app/jobs/cart_jobs.hpp"

#include <algorithm>
#include <new>

#include "platform/journal/archive.hpp"
#include "platform/linux/wakeup.hpp"
#include "platform/memory/allocation_guard.hpp"

namespace firstlook {
namespace {

/// Libraries turn a refused allocation into exceptions of their own: the account knows.
Fault why_it_failed() {
  const memory::HeapAccount* const account = memory::allocation_context().account;
  return account != nullptr && account->refused > 0 ? Fault::kOutOfMemory : Fault::kInternal;
}

template <typename Arguments, typename Work>
std::size_t run(const JobRequest& request, std::span<std::byte> bytes, std::uint64_t& failed, Work work) noexcept {
  Arguments arguments;
  ENSURE(7101, unpack(request.bytes(), arguments));
  ByteWriter writer(bytes);
  try {
    const auto result = work(arguments);
    writer(true, result);
  } catch (const std::bad_alloc&) {
    ++failed;
    writer(false, Fault::kOutOfMemory);
  } catch (...) {
    ++failed;
    writer(false, why_it_failed());
  }
  ENSURE(7102, writer.ok());
  return writer.size();
}

}  // namespace

void CartJobs::tell_if_accepted() const {
  const auto& hand_eye = bench_.hand_eye();
  if (accepted_ && hand_eye && hand_eye->verdict == Verdict::kAccepted) accepted_();
}

std::size_t CartJobs::execute(const JobRequest& request, std::span<std::byte> result) noexcept {
  const std::int64_t began_ns = monotonic_ns();
  const std::size_t size = dispatch(request, result);
  const double took_s = 1e-9 * static_cast<double>(monotonic_ns() - began_ns);
  JobTimes& times = times_.at(request.kind - 1U);
  ++times.count;
  times.total_s += took_s;
  times.longest_s = std::max(times.longest_s, took_s);
  return size;
}

std::size_t CartJobs::dispatch(const JobRequest& request, std::span<std::byte> result) noexcept {
  Workbench& b = bench_;
  switch (static_cast<JobKind>(request.kind)) {
    case JobKind::kLocateViews:
      return run<FromHere>(request, result, failed_, [&b](const FromHere& a) { return b.locate_views(a); });
    case JobKind::kIdentifyMotions:
      return run<FromHere>(request, result, failed_, [&b](const FromHere& a) { return b.identify_motions(a); });
    case JobKind::kPlan:
      return run<PlanArguments>(request, result, failed_, [&b](const PlanArguments& a) { return b.plan(a); });
    case JobKind::kCertifyPath:
      return run<PlanArguments>(request, result, failed_, [&b](const PlanArguments& a) { return b.certify_path(a); });
    case JobKind::kDetectBoard:
      return run<DetectArguments>(request, result, failed_,
                                  [&b](const DetectArguments& a) { return b.detect_board(a); });
    case JobKind::kSeeOnTheWay:
      return run<WayArguments>(request, result, failed_, [&b](const WayArguments& a) { return b.see_on_the_way(a); });
    case JobKind::kNextCalibrationView:
      return run<FromHere>(request, result, failed_, [&b](const FromHere& a) { return b.next_calibration_view(a); });
    case JobKind::kSolve:
      return run<NoArguments>(request, result, failed_, [&b](const NoArguments&) { return b.solve(); });
    case JobKind::kValidate:
      return run<NoArguments>(request, result, failed_, [&](const NoArguments&) {
        const ValidateResult validated = b.validate();
        tell_if_accepted();
        return validated;
      });
    case JobKind::kIntegrate:
      return run<IntegrateArguments>(request, result, failed_,
                                     [&b](const IntegrateArguments& a) { return b.integrate(a); });
    case JobKind::kNextSweepView:
      return run<FromHere>(request, result, failed_, [&b](const FromHere& a) { return b.next_sweep_view(a); });
    case JobKind::kNextView:
      return run<FromHere>(request, result, failed_, [&b](const FromHere& a) { return b.next_view(a); });
    case JobKind::kCheckBoard:
      return run<DetectArguments>(request, result, failed_,
                                  [&b](const DetectArguments& a) { return b.check_board(a); });
    case JobKind::kNextVerificationView:
      return run<FromHere>(request, result, failed_, [&b](const FromHere& a) { return b.next_verification_view(a); });
    case JobKind::kVerifyCalibration:
      return run<NoArguments>(request, result, failed_, [&b](const NoArguments&) { return b.verify_calibration(); });
    case JobKind::kTouchTest:
      return run<TouchTestArguments>(request, result, failed_, [&](const TouchTestArguments& a) {
        const TouchTestResult touched = b.touch_test(a);
        tell_if_accepted();
        return touched;
      });
    case JobKind::kColorLook:
      return run<ColorArguments>(request, result, failed_, [&b](const ColorArguments& a) { return b.color_look(a); });
    case JobKind::kSummarize:
      return run<NoArguments>(request, result, failed_, [&b](const NoArguments&) { return b.summarize(); });
    case JobKind::kForgetKnownFree:
      return run<NoArguments>(request, result, failed_, [&b](const NoArguments& a) {
        b.forget_known_free();
        return a;
      });
  }
  ENSURE(7103, false);
  return 0;
}

Duration virtual_duration(JobKind kind) {
  switch (kind) {
    case JobKind::kLocateViews:
    case JobKind::kIdentifyMotions:
      return milliseconds(20);
    case JobKind::kPlan:
      return milliseconds(50);
    case JobKind::kCertifyPath:
      return milliseconds(5);
    case JobKind::kDetectBoard:
    case JobKind::kCheckBoard:
    case JobKind::kSeeOnTheWay:
      return milliseconds(90);
    case JobKind::kNextCalibrationView:
    case JobKind::kNextVerificationView:
      return milliseconds(200);
    case JobKind::kSolve:
      return milliseconds(300);
    case JobKind::kValidate:
      return milliseconds(1500);
    case JobKind::kVerifyCalibration:
    case JobKind::kTouchTest:
      return milliseconds(50);
    case JobKind::kIntegrate:
    case JobKind::kForgetKnownFree:
    case JobKind::kColorLook:
      return milliseconds(40);
    case JobKind::kNextSweepView:
    case JobKind::kNextView:
      return milliseconds(200);
    case JobKind::kSummarize:
      return milliseconds(100);
  }
  return milliseconds(100);
}

}  // namespace firstlook
