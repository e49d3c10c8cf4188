#include "hal/sim/observable_set.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "algorithms/mapping/distance_field.hpp"
#include "algorithms/mapping/reach_zone.hpp"
#include "algorithms/motion/certificate.hpp"
#include "hal/sim/body_image.hpp"
#include "hal/sim/random_streams.hpp"
#include "hal/sim/ray_geometry.hpp"
#include "platform/core/ensure.hpp"
#include "platform/core/random.hpp"

namespace firstlook::sim {
namespace {

constexpr double kFieldMax_m = 0.6;         // farther obstacles do not matter for an edge
constexpr double kRaySpacing_voxels = 0.8;  // between neighbouring rays where they end
constexpr int kRoundsMax = 40;
constexpr int kGrownShare = 3;  // one of three samples is drawn near what was reached with the others
constexpr double kGrownSigma_rad = 0.35;

/// One configuration of the roadmap.
struct Node {
  JointVector q_rad;
  bool reached = false;
  bool looked = false;
  int reached_in_pass = -1;
};

/// Normalised image points through which an ideal sensor's rays go.
struct RayGrid {
  std::vector<double> x, y;  ///< of the columns, of the rows
};

RayGrid sensor_rays(const CameraIntrinsics& sensor, double range_m, double voxel_m) {
  const double step_m = kRaySpacing_voxels * voxel_m / range_m;  // at unit depth
  const double left = (-0.5 - sensor.cx) / sensor.fx, right = (sensor.width - 0.5 - sensor.cx) / sensor.fx;
  const double top = (-0.5 - sensor.cy) / sensor.fy, bottom = (sensor.height - 0.5 - sensor.cy) / sensor.fy;
  const int columns = std::min(sensor.width, static_cast<int>(std::ceil((right - left) / step_m)));
  const int rows = std::min(sensor.height, static_cast<int>(std::ceil((bottom - top) / step_m)));
  RayGrid rays;
  for (int column = 0; column < columns; ++column) rays.x.push_back(left + (right - left) * (column + 0.5) / columns);
  for (int row = 0; row < rows; ++row) rays.y.push_back(top + (bottom - top) * (row + 0.5) / rows);
  return rays;
}

class Fixpoint {
 public:
  Fixpoint(const ObservableProblem& problem, WorkerPool& workers)
      : problem_(problem),
        workers_(workers),
        random_(problem.seed, kObservableStream),
        field_(problem.geometry, kFieldMax_m),
        rays_(sensor_rays(problem.sensor, problem.options.sensor_range_trusted_m, problem.geometry.resolution_m)),
        seen_(problem.geometry.count(), 0),
        free_(problem.geometry.count(), 0),
        seen_by_(static_cast<std::size_t>(workers.workers()), seen_) {
    problem_.world->matter(problem_.geometry, matter_);
    ENSURE(5011, matter_.size() == seen_.size());
    space_ = problem_.space;
    space_.field = &field_;
    for (int joint = 0; joint < problem_.arm->joints; ++joint) {
      for (const LeverArms& levers : problem_.body.levers) {
        weight_m_[static_cast<std::size_t>(joint)] =
            std::max(weight_m_[static_cast<std::size_t>(joint)], levers[static_cast<std::size_t>(joint)]);
      }
    }
    free_safe_zone();
  }

  ObservableSet run() {
    const int uniform = problem_.options.samples - problem_.options.samples / kGrownShare;
    nodes_.push_back({problem_.start_rad, true, false, 0});
    for (int i = 1; i < uniform; ++i) nodes_.push_back({sample_uniform()});
    ObservableSet result;
    bool grown = false;
    while (result.rounds < kRoundsMax) {
      ++result.rounds;
      field_.update(free_);
      const int before = reached_count();
      reach_all();
      const bool news = look_from_reached();
      if (news || reached_count() > before) continue;
      if (grown) break;
      grow(problem_.options.samples / kGrownShare);  // once more, around what was reached
      grown = true;
    }
    finish(result);
    return result;
  }

 private:
  void free_safe_zone() {
    // Voxels entirely inside the cylinder, as the map takes them. Matter in it is revoked by the first look.
    const GridGeometry& g = problem_.geometry;
    for (std::size_t i = 0; i < free_.size(); ++i) {
      const Eigen::Vector3d low = g.center_m(g.voxel_at(i)).array() - 0.5 * g.resolution_m;
      bool inside = true;
      for (int corner = 0; corner < 8 && inside; ++corner) {
        const Eigen::Vector3d p = low + g.resolution_m * Eigen::Vector3d(corner & 1, corner >> 1 & 1, corner >> 2 & 1);
        inside = space_.zone.depth_m(p) >= 0;
      }
      if (!inside) continue;
      if (matter_[i] != 0) space_.zone_intact = false;
      free_[i] = matter_[i] == 0;
    }
  }

  JointVector sample_uniform() {
    JointVector q = JointVector::zero(problem_.arm->joints);
    for (int joint = 0; joint < q.size(); ++joint) {
      const auto j = static_cast<std::size_t>(joint);
      // One turn is enough: every pose of the body lies within it.
      const double low = std::max(problem_.arm->lower_rad[j], -std::numbers::pi);
      const double high = std::min(problem_.arm->upper_rad[j], std::numbers::pi);
      q[joint] = random_.uniform(low, high);
    }
    return q;
  }

  /// New samples near what was reached: they find the ways that uniform samples miss.
  void grow(int count) {
    std::vector<int> reached;
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      if (nodes_[i].reached) reached.push_back(static_cast<int>(i));
    }
    for (int i = 0; i < count; ++i) {
      const int near = reached[static_cast<std::size_t>(random_.below(static_cast<int>(reached.size())))];
      JointVector q = nodes_[static_cast<std::size_t>(near)].q_rad;
      for (int joint = 0; joint < q.size(); ++joint) {
        const auto j = static_cast<std::size_t>(joint);
        q[joint] = std::clamp(q[joint] + kGrownSigma_rad * random_.normal(), problem_.arm->lower_rad[j],
                              problem_.arm->upper_rad[j]);
      }
      nodes_.push_back({q});
    }
  }

  [[nodiscard]] int reached_count() const {
    return static_cast<int>(std::ranges::count_if(nodes_, [](const Node& node) { return node.reached; }));
  }

  [[nodiscard]] double distance_m(const JointVector& a, const JointVector& b) const {
    double sum = 0;
    for (std::size_t j = 0; j < weight_m_.size(); ++j) {
      const double d = weight_m_[j] * (a.values[j] - b.values[j]);
      sum += d * d;
    }
    return std::sqrt(sum);
  }

  /// Passes over all that is not reached until none is added. Within a pass each node looks at the roadmap as it was at
  /// the beginning, so the order and the number of workers do not matter.
  void reach_all() {
    std::vector<std::uint8_t> is_free(nodes_.size(), 0), joins(nodes_.size(), 0);
    const int count = static_cast<int>(nodes_.size());
    const int first_pass = ++pass_;
    workers_.parallel_for(count, [&](int index, int) {
      const auto i = static_cast<std::size_t>(index);
      is_free[i] = nodes_[i].reached || configuration_is_free(*problem_.arm, problem_.body, space_,
                                                              problem_.options.clearance, nodes_[i].q_rad);
    });
    configurations_free_ = static_cast<int>(std::ranges::count(is_free, 1));
    for (bool added = true; added; ++pass_) {
      added = false;
      const bool all = pass_ == first_pass;
      workers_.parallel_for(count, [&](int index, int) {
        const auto i = static_cast<std::size_t>(index);
        joins[i] = !nodes_[i].reached && is_free[i] != 0 && connects(nodes_[i].q_rad, all ? -1 : pass_ - 1);
      });
      for (std::size_t i = 0; i < nodes_.size(); ++i) {
        if (joins[i] == 0) continue;
        nodes_[i].reached = true;
        nodes_[i].reached_in_pass = pass_;
        added = true;
      }
    }
  }

  /// Is there a certified edge from one of the nearest reached nodes? Only from those reached in `pass`, unless it is
  /// -1.
  [[nodiscard]] bool connects(const JointVector& q_rad, int pass) const {
    std::vector<std::pair<double, int>> near;
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      if (!nodes_[i].reached || (pass >= 0 && nodes_[i].reached_in_pass != pass)) continue;
      near.emplace_back(distance_m(q_rad, nodes_[i].q_rad), static_cast<int>(i));
    }
    const auto kept = std::min(near.size(), static_cast<std::size_t>(problem_.options.neighbors));
    std::partial_sort(near.begin(), near.begin() + static_cast<std::ptrdiff_t>(kept), near.end());
    return std::any_of(near.begin(), near.begin() + static_cast<std::ptrdiff_t>(kept), [&](const auto& candidate) {
      return certify(*problem_.arm, problem_.body, space_, problem_.options.clearance,
                     nodes_[static_cast<std::size_t>(candidate.second)].q_rad, q_rad)
          .certified();
    });
  }

  /// Looks from every reached configuration that has not looked yet. True when a voxel became known.
  bool look_from_reached() {
    std::vector<int> fresh;
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      if (nodes_[i].reached && !std::exchange(nodes_[i].looked, nodes_[i].reached))
        fresh.push_back(static_cast<int>(i));
    }
    workers_.parallel_for(static_cast<int>(fresh.size()), [&](int index, int worker) {
      look(nodes_[static_cast<std::size_t>(fresh[static_cast<std::size_t>(index)])].q_rad,
           seen_by_[static_cast<std::size_t>(worker)]);
    });
    bool news = false;
    for (std::vector<std::uint8_t>& seen : seen_by_) {
      for (std::size_t i = 0; i < seen_.size(); ++i) {
        if (seen[i] == 0 || seen_[i] != 0) continue;
        seen_[i] = 1;
        if (matter_[i] == 0) free_[i] = 1;
        news = true;
      }
    }
    return news;
  }

  /// One ideal frame: every ray knows the voxels up to its return, and the one that holds it.
  void look(const JointVector& q_rad, std::vector<std::uint8_t>& seen) const {
    const ObservableOptions& o = problem_.options;
    const LinkFrames frames = forward(*problem_.arm, q_rad);
    const Pose base_T_depth = (frames.flange() * problem_.flange_T_depth).pose();
    const Eigen::Vector3d eye = base_T_depth.translation();
    const BodyImage own(place(problem_.true_capsules, frames), base_T_depth, eye);
    RayRow row(rays_.x.size());
    for (const double y : rays_.y) {
      for (std::size_t i = 0; i < row.size(); ++i) {
        const Eigen::Vector3f d = (base_T_depth.linear() * Eigen::Vector3d(rays_.x[i], y, 1)).cast<float>();
        row.x[i] = d.x(), row.y[i] = d.y(), row.z[i] = d.z();
      }
      problem_.world->trace(eye, row);
      const BodyImage hiding = own.band(y, y);
      for (std::size_t i = 0; i < row.size(); ++i) {
        const double depth_m = row.t[i];
        const Eigen::Vector3d ray(row.x[i], row.y[i], row.z[i]);
        const double length_per_depth = ray.norm(), hit_m = depth_m * length_per_depth;
        if (!(hit_m <= o.sensor_range_max_m) || depth_m < o.sensor_range_min_m) continue;
        BodyHit body;
        if (hiding.intersect(rays_.x[i], y, depth_m, body)) continue;
        const bool marks = hit_m <= o.sensor_range_trusted_m;
        walk_ray(problem_.geometry, eye, ray / length_per_depth, marks ? hit_m + 1e-6 : o.sensor_range_trusted_m,
                 [&](std::size_t voxel) { seen[voxel] = 1; });
      }
    }
  }

  void finish(ObservableSet& result) const {
    result.zone.resize(seen_.size());
    mark_reach_zone(problem_.geometry, *problem_.arm, problem_.body.capsules, problem_.options.zone_margin_m,
                    problem_.options.zone_floor_m, result.zone);
    result.seen = seen_;
    for (std::size_t i = 0; i < seen_.size(); ++i) {
      result.seen[i] = seen_[i] != 0 && result.zone[i] != 0 ? 1 : 0;
      result.voxels += result.seen[i];
    }
    result.configurations_free = configurations_free_;
    result.configurations_reached = reached_count();
  }

  const ObservableProblem& problem_;
  WorkerPool& workers_;
  Random random_;
  DistanceField field_;
  FreeSpace space_;
  RayGrid rays_;
  std::vector<std::uint8_t> seen_, free_, matter_;
  std::vector<std::vector<std::uint8_t>> seen_by_;  ///< one for each worker, joined after each round
  std::vector<Node> nodes_;
  std::array<double, kJointsMax> weight_m_{};
  int pass_ = 0;
  int configurations_free_ = 0;
};

}  // namespace

ObservableSet observable_set(const ObservableProblem& problem, WorkerPool& workers) {
  ENSURE(5012, problem.arm != nullptr && problem.world != nullptr);
  return Fixpoint(problem, workers).run();
}

}  // namespace firstlook::sim
