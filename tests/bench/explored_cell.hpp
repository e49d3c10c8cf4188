/// A simulated cell that is explored with the library alone, without the job around it: for figures about views.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "algorithms/mapping/insertion.hpp"
#include "algorithms/view_planning/explore.hpp"
#include "algorithms/view_planning/sweep.hpp"
#include "hal/sim/observable_set.hpp"
#include "hal/sim/renderer.hpp"
#include "hal/sim/scene_history.hpp"

namespace firstlook::bench {

inline constexpr int kWorthVoxels = 12;  ///< as a job's explore.cluster_voxels_min

/// What a job has after its calibration: the arm in the cell, the map, and where it may move. The sensor is the fast
/// one; depth and hand-eye transform are true.
class ExploredCell {
 public:
  /// @param candidates_max, workers_max  as ViewChooser's
  ExploredCell(const std::string& cell, std::uint64_t seed, int candidates_max, int workers_max);
  ExploredCell(const ExploredCell&) = delete;
  ExploredCell& operator=(const ExploredCell&) = delete;

  [[nodiscard]] const DepthSensor& sensor() const { return inserter_.sensor(); }
  [[nodiscard]] const GridGeometry& geometry() const { return map_.geometry(); }
  [[nodiscard]] const JointVector& joints() const { return q_; }
  [[nodiscard]] ViewContext context() const { return context_of(map_, zone_); }
  /// How the next view is planned, as a job tries one after the other: with room to spare, with what the speed needs,
  /// and slowly, where a new hit has come too near to the arm for more.
  enum class Pace : std::uint8_t { kRoomy, kNormal, kSlow };
  void set_pace(Pace pace);
  [[nodiscard]] const ViewTiming& timing() const { return timing_; }

  [[nodiscard]] ViewChooser& chooser() { return chooser_; }

  /// Goes along a path and looks at its end; also every half second on the way when asked.
  void follow(const Path& path, bool looks_on_the_way);
  /// The sweep that a job begins with.
  void sweep(bool looks_on_the_way);

  /// What can be observed here, and where there is matter: the truth, for grading and for views that know it. Call it
  /// first of all when `way` is wanted.
  /// @param observable  of this cell; when empty it is found, which takes some seconds, and kept there
  void find_truth(WorkerPool& workers, std::optional<sim::ObservableSet>& observable);
  /// As context(), for a chooser that expects what a look will tell: what can be observed is the zone, and matter that
  /// cannot be seen into stops rays. A surface whose voxels are all observable is thin: rays end there, and it counts
  /// nothing, unless `surfaces_count`. Lives until the next call.
  [[nodiscard]] ViewContext omniscient_context(bool surfaces_count);

  /// How far it has come.
  struct Reached {
    double time_s = 0;  ///< moves, settling, looking
    int stops = 0;
  };
  struct Way {
    std::optional<Reached> to_95, to_99;  ///< of what can be observed
    double coverage = 0;
    Reached end;
  };
  [[nodiscard]] const Way& way() const { return way_; }

 private:
  [[nodiscard]] ViewContext context_of(const VoxelMap& map, const std::vector<std::uint8_t>& zone) const;
  [[nodiscard]] Transform<Flange, Depth> mount() const;
  [[nodiscard]] sim::ObservableProblem observable_problem() const;
  void look();
  void note_coverage();
  [[nodiscard]] bool touches_inside(std::size_t index) const;

  sim::Scene scene_;
  sim::Renderer renderer_;
  sim::SceneWorld world_;
  ArmModel arm_;
  Body body_;
  Clearance normal_, slow_;
  Clearance clearance_;  ///< of the pace
  ViewTiming timing_;
  VoxelMap map_;
  DistanceField field_;
  std::vector<std::uint8_t> free_, zone_;
  Inserter inserter_;
  FreeSpace space_;
  ViewChooser chooser_;
  JointVector start_, q_;
  double now_s_ = 0;
  sim::ObservableSet observable_;
  std::vector<std::uint8_t> matter_, inside_;  ///< matter; voxels of it that cannot be observed
  std::optional<VoxelMap> foreseen_;
  Way way_;
};

}  // namespace firstlook::bench
