/// What only the simulated cell knows: what its integrator would have typed in, and the truth that a job is graded
/// against. Nothing that decides includes this.
#pragma once

#include "app/config/config.hpp"
#include "app/report/run_record.hpp"
#include "app/shell/cart.hpp"
#include "hal/sim/grader.hpp"
#include "hal/sim/simulated_cell.hpp"

namespace firstlook {

/// What the program holds for free, as the grader of the simulated cell asks for it.
class KnownFree final : public sim::KnownFreeView {
 public:
  explicit KnownFree(const PublishedSpace& space) : space_(space) {}
  [[nodiscard]] const GridGeometry& geometry() const override { return space_.geometry(); }
  [[nodiscard]] bool free_for_motion(std::size_t voxel) const override { return space_.free_for_motion(voxel); }
  [[nodiscard]] bool zone_revoked(std::size_t voxel) const override { return space_.zone_revoked(voxel); }
  [[nodiscard]] bool known(std::size_t voxel) const override { return space_.known(voxel); }
  [[nodiscard]] std::uint32_t revision() const override { return space_.revision(); }

 private:
  const PublishedSpace& space_;
};

/// The configuration of a simulated cell: what its integrator would have typed in.
void describe_cell(const sim::CellDescription& cell, Config& config);

/// Grades the finished job against the truth of the simulated cell.
void grade(sim::Grader& grader, const Cart& cart, const Config& config, RunRecord& record);

}  // namespace firstlook
