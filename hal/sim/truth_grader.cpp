#include "hal/sim/truth_grader.hpp"

#include <Eigen/Cholesky>
#include <algorithm>

#include "algorithms/kinematics/self_collision.hpp"
#include "platform/core/ensure.hpp"
#include "platform/memory/allocation_guard.hpp"

namespace firstlook::sim {
namespace {

using Vector6d = Eigen::Matrix<double, 6, 1>;

/// (t_truth - t_estimate, Log(R_truth R_estimate^T)) in the flange frame.
Vector6d difference(const Pose& truth, const Pose& estimate) {
  const Eigen::AngleAxisd turn(Eigen::Matrix3d(truth.linear() * estimate.linear().transpose()));
  Vector6d d;
  d << truth.translation() - estimate.translation(), turn.angle() * turn.axis();
  return d;
}

bool in_region(const NamedRegion& region, const Eigen::Vector3d& p) {
  return (p.array() >= region.low_m.array()).all() && (p.array() <= region.high_m.array()).all();
}

constexpr double kSurfaceTolerance = 1.5;  // voxels from a middle to matter in the next voxel

/// Whether the voxel or one that touches it is marked.
bool any_around(const GridGeometry& geometry, const Eigen::Vector3i& voxel, std::span<const std::uint8_t> marks) {
  for (int z = -1; z <= 1; ++z) {
    for (int y = -1; y <= 1; ++y) {
      for (int x = -1; x <= 1; ++x) {
        const Eigen::Vector3i at = voxel + Eigen::Vector3i(x, y, z);
        if (geometry.contains(at) && marks[geometry.index(at)] != 0) return true;
      }
    }
  }
  return false;
}

}  // namespace

TruthGrader::TruthGrader(const Truth& truth, WorkerPool& workers)
    : truth_(truth),
      monitor_(truth.arm, true_capsules(truth.arm, truth.link, truth.link_T_camera), base_allowance(truth.arm),
               truth.space.zone, *truth.world),
      workers_(workers) {}

void TruthGrader::watch(const KnownFreeView* view) {
  const memory::SimulationScope simulation;
  monitor_.watch(view);
  known_times_.watch(view);
}

const ObservableSet& TruthGrader::observable(const GridGeometry& geometry, const ObservableOptions& options) {
  if (!known_ || !(known_->geometry == geometry) || !(known_->options == options)) {
    ObservableProblem problem;
    problem.arm = &truth_.arm;
    problem.world = truth_.world;
    problem.geometry = geometry;
    problem.body = body_with_camera(truth_.arm, true_flange_T_camera());
    problem.true_capsules = true_capsules(truth_.arm, truth_.link, truth_.link_T_camera);
    problem.flange_T_depth = true_flange_T_camera() * truth_.camera_T_depth;
    problem.sensor = truth_.depth;
    problem.space = truth_.space;
    problem.start_rad = truth_.start_rad;
    problem.seed = truth_.seed;
    problem.options = options;
    known_ = Known{geometry, options, observable_set(problem, workers_)};
  }
  return known_->set;
}

std::vector<RegionFigure> TruthGrader::regions(const FinalClaims& claims) {
  const memory::SimulationScope simulation;
  std::vector<RegionFigure> figures;
  if (claims.map == nullptr || !camera_on_flange()) return figures;
  const GridGeometry& geometry = claims.map->geometry();
  const ObservableSet& set = observable(geometry, claims.observable);
  for (const NamedRegion& region : truth_.regions) {
    RegionFigure figure{region.name, region.low_m, region.high_m};
    for (std::size_t i = 0; i < set.seen.size(); ++i) {
      if (set.seen[i] == 0 || !in_region(region, geometry.center_m(geometry.voxel_at(i)))) continue;
      ++figure.observable;
      if (claims.map->voxel_class(i) != VoxelClass::kUnknown) ++figure.known;
    }
    if (figure.observable > 0) {
      figure.known_fraction = static_cast<double>(figure.known) / static_cast<double>(figure.observable);
    }
    figures.push_back(figure);
  }
  return figures;
}

void TruthGrader::grade_hand_eye(const FinalClaims& claims, TruthFigures& figures) const {
  if (!claims.flange_T_camera || !camera_on_flange()) return;
  const Vector6d d = difference(truth_.link_T_camera, claims.flange_T_camera->pose());
  figures.hand_eye_error_mm = 1e3 * d.head<3>().norm();
  figures.hand_eye_error_mrad = 1e3 * d.tail<3>().norm();
  const Eigen::LDLT<Eigen::Matrix<double, 6, 6>> factors(claims.covariance);
  if (factors.isPositive() && factors.vectorD().minCoeff() > 0) {
    figures.hand_eye_mahalanobis2 = d.dot(factors.solve(d));
  }
}

void TruthGrader::grade_alignment(const FinalClaims& claims, TruthFigures& figures) const {
  if (claims.camera_T_depth) {
    const Vector6d d = difference(truth_.camera_T_depth.pose(), claims.camera_T_depth->pose());
    figures.depth_camera_error_mm = 1e3 * d.head<3>().norm();
    figures.depth_camera_error_mrad = 1e3 * d.tail<3>().norm();
  }
  if (claims.color_offset_s) figures.color_stamps_error_s = truth_.color_clock_s + *claims.color_offset_s;
  if (claims.depth_offset_s) figures.depth_stamps_error_s = truth_.depth_clock_s + *claims.depth_offset_s;
}

void TruthGrader::grade_map(const FinalClaims& claims, TruthFigures& figures) {
  if (claims.map == nullptr || !camera_on_flange()) return;
  const VoxelMap& map = *claims.map;
  const GridGeometry& geometry = map.geometry();
  const ObservableSet& set = observable(geometry, claims.observable);
  std::size_t known = 0;
  std::uint64_t false_free = 0;
  for (std::size_t i = 0; i < map.size(); ++i) {
    if (set.seen[i] != 0 && map.voxel_class(i) != VoxelClass::kUnknown) ++known;
    if (map.known_free(i, claims.now_s, claims.free_max_age_s) &&
        truth_.world->inside(geometry.center_m(geometry.voxel_at(i)))) {
      ++false_free;
    }
  }
  figures.observable_voxels = set.voxels;
  figures.known_95_s = known_times_.time_s(set.seen, 0.95);
  figures.known_99_s = known_times_.time_s(set.seen, 0.99);
  if (set.voxels > 0) figures.coverage_of_observable = static_cast<double>(known) / static_cast<double>(set.voxels);
  figures.false_free_voxels = false_free;
  figures.false_occupied_fraction = false_occupied_fraction(claims);
  figures.regions = regions(claims);
}

double TruthGrader::false_occupied_fraction(const FinalClaims& claims) const {
  const VoxelMap& map = *claims.map;
  const GridGeometry& geometry = map.geometry();
  std::vector<std::uint8_t> matter;
  truth_.world->matter(geometry, matter);
  std::size_t asked = 0, wrong = 0;
  const Capsules placed = place(truth_.arm.body, forward(truth_.arm, truth_.start_rad));
  for (std::size_t i = 0; i < map.size(); ++i) {
    if (!claims.reach_zone.empty() && claims.reach_zone[i] == 0) continue;
    ++asked;
    if (map.voxel_class(i) != VoxelClass::kOccupied) continue;
    const Eigen::Vector3i voxel = geometry.voxel_at(i);
    const bool base = std::ranges::any_of(placed, [&](const Capsule& capsule) {
      const Eigen::Vector3d center_m = geometry.center_m(voxel);
      const double within_m = capsule.radius_m + kSurfaceTolerance * geometry.resolution_m;
      return capsule.link == 0 && segment_distance_m(center_m, center_m, capsule.a, capsule.b) < within_m;
    });
    wrong += !base && !any_around(geometry, voxel, matter) ? 1 : 0;
  }
  return asked == 0 ? 0 : static_cast<double>(wrong) / static_cast<double>(asked);
}

TruthFigures TruthGrader::grade(const FinalClaims& claims) {
  const memory::SimulationScope simulation;
  TruthFigures figures;
  figures.contacts = monitor_.contacts();
  figures.unknown_entries = monitor_.unknown_entries();
  figures.body_checks = monitor_.checks();
  grade_hand_eye(claims, figures);
  grade_alignment(claims, figures);
  grade_map(claims, figures);
  return figures;
}

}  // namespace firstlook::sim
