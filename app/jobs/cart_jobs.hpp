/// The jobs as the loop runs them: bytes in, work, bytes out.
#pragma once

#include <functional>

#include "app/jobs/workbench.hpp"
#include "platform/loop/jobs.hpp"

namespace firstlook {

class CartJobs final : public JobExecutor {
 public:
  /// @param accepted  called on the job's thread when a job has accepted a new calibration, before its result is known
  explicit CartJobs(Workbench& bench, std::function<void()> accepted = {})
      : bench_(bench), accepted_(std::move(accepted)) {}
  /// Writes true and the result of the kind's type; or, when the job ran out of its heap allowance (kOutOfMemory) or
  /// threw anything else (kInternal), false and that fault.
  std::size_t execute(const JobRequest& request, std::span<std::byte> result) noexcept override;
  [[nodiscard]] std::uint64_t failed() const { return failed_; }

 private:
  void tell_if_accepted() const;

  Workbench& bench_;
  std::function<void()> accepted_;
  std::uint64_t failed_ = 0;
};

/// How long a job takes in virtual time: upper ends of what the industrial PC needs (tests/bench).
[[nodiscard]] Duration virtual_duration(JobKind kind);

}  // namespace firstlook
