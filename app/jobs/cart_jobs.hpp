/// The jobs as the loop runs them: bytes in, work, bytes out.
#pragma once

#include <array>
#include <functional>

#include "app/jobs/workbench.hpp"
#include "platform/loop/jobs.hpp"

namespace firstlook {

/// What jobs of one kind took by the computer's clock, with the pictures that a simulated camera renders in them.
struct JobTimes {
  std::uint64_t count = 0;
  double total_s = 0;
  double longest_s = 0;
};

class CartJobs final : public JobExecutor {
 public:
  /// @param accepted  called on the job's thread when a job has accepted a new calibration, before its result is known
  explicit CartJobs(Workbench& bench, std::function<void()> accepted = {})
      : bench_(bench), accepted_(std::move(accepted)) {}
  /// Writes true and the result of the kind's type; or, when the job ran out of its heap allowance (kOutOfMemory) or
  /// threw anything else (kInternal), false and that fault.
  std::size_t execute(const JobRequest& request, std::span<std::byte> result) noexcept override;
  [[nodiscard]] std::uint64_t failed() const { return failed_; }
  /// While no job runs.
  [[nodiscard]] const JobTimes& times(JobKind kind) const { return times_[static_cast<std::size_t>(kind) - 1]; }

 private:
  std::size_t dispatch(const JobRequest& request, std::span<std::byte> result) noexcept;
  void tell_if_accepted() const;

  Workbench& bench_;
  std::function<void()> accepted_;
  std::uint64_t failed_ = 0;
  std::array<JobTimes, static_cast<std::size_t>(kLastJobKind)> times_{};
};

/// How long a job takes in virtual time: upper ends of what a computer with two cores needs at 5 cm (result.json's
/// wall.jobs says what they took; tests/bench).
[[nodiscard]] Duration virtual_duration(JobKind kind);

}  // namespace firstlook
