/// The jobs as the loop runs them: bytes in, work, bytes out.
#pragma once

#include "app/jobs/workbench.hpp"
#include "platform/loop/jobs.hpp"

namespace firstlook {

class CartJobs final : public JobExecutor {
 public:
  explicit CartJobs(Workbench& bench) : bench_(bench) {}
  /// Writes true and the result of the kind's type; or, when the job ran out of its heap allowance (kOutOfMemory) or
  /// threw anything else (kInternal), false and that fault.
  std::size_t execute(const JobRequest& request, std::span<std::byte> result) noexcept override;
  [[nodiscard]] std::uint64_t failed() const { return failed_; }

 private:
  Workbench& bench_;
  std::uint64_t failed_ = 0;
};

/// How long a job takes in virtual time: upper ends of what the industrial PC needs (tests/bench).
[[nodiscard]] Duration virtual_duration(JobKind kind);

}  // namespace firstlook
