/// The jobs as the loop runs them: bytes in, work, bytes out.
#pragma once

#include "app/jobs/workbench.hpp"
#include "platform/loop/jobs.hpp"

namespace firstlook {

class CartJobs final : public JobExecutor {
 public:
  explicit CartJobs(Workbench& bench) : bench_(bench) {}
  /// A job that runs out of its heap allowance gives the empty result of its kind: not found, not solved, not used.
  std::size_t execute(const JobRequest& request, std::span<std::byte> result) noexcept override;
  [[nodiscard]] std::uint64_t failed() const { return failed_; }

 private:
  Workbench& bench_;
  std::uint64_t failed_ = 0;
};

/// How long a job takes in virtual time: upper ends of what the industrial PC needs (tests/bench).
[[nodiscard]] Duration virtual_duration(JobKind kind);

}  // namespace firstlook
