#include "algorithms/mapping/room_planes.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "platform/core/random.hpp"

namespace firstlook {
namespace {

constexpr int kPlanesMax = 6;              // of a room
constexpr int kTrials = 150;               // voxels whose surroundings propose a plane
constexpr std::size_t kSampleMax = 20000;  // voxels that a proposal is counted on
constexpr double kThickness_m = 0.04;      // to either side, or one and a half voxels where that is more
constexpr double kAreaMin_m2 = 0.4;
constexpr double kShareMin = 0.04;      // of all occupied voxels
constexpr double kBeyondMax = 0.05;     // of the other voxels: on the far side
constexpr double kFreeBeforeMin = 0.5;  // of the plane: free voxels before it, on the near side
constexpr double kTouchingMax = 0.3;    // of a piece: voxels beside occupied ones off the plane
constexpr double kPieceMin = 0.1;       // of the plane's largest piece
constexpr std::uint8_t kInSlab = 1, kInPiece = 2;
constexpr int kNeighborhood = 3;  // voxels to each side

struct Plane {
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  double offset_m = 0;
  [[nodiscard]] double height_m(const Eigen::Vector3d& p) const { return normal.dot(p) - offset_m; }
};

/// Least squares through points; `flatness` is the smallest eigenvalue over the next.
struct PlaneFit {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
  double count = 0;

  void add(const Eigen::Vector3d& p) {
    sum += p;
    squares += p * p.transpose();
    ++count;
  }
  [[nodiscard]] Plane solve(double& flatness) const {
    const Eigen::Vector3d mean = sum / count;
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(squares / count - mean * mean.transpose());
    flatness = solver.eigenvalues()[0] / std::max(1e-12, solver.eigenvalues()[1]);
    const Eigen::Vector3d normal = solver.eigenvectors().col(0);
    return {normal, normal.dot(mean)};
  }
};

class RoomPlanes {
 public:
  RoomPlanes(const VoxelMap& map, std::span<const std::size_t> occupied)
      : map_(map),
        occupied_(occupied),
        plane_of_(occupied.size(), 0),
        is_open_(map.size(), false),
        slab_mark_(map.size(), 0),
        thickness_m_(std::max(kThickness_m, 1.5 * map.geometry().resolution_m)) {
    centers_m_.reserve(occupied.size());
    for (const std::size_t index : occupied) {
      centers_m_.push_back(map.geometry().center_m(map.geometry().voxel_at(index)));
      is_open_[index] = true;
    }
  }

  std::vector<std::uint8_t> find() {
    for (int number = 1; number <= kPlanesMax; ++number) {
      if (!take_best(static_cast<std::uint8_t>(number))) break;
    }
    return plane_of_;
  }

 private:
  bool take_best(std::uint8_t number) {
    std::vector<std::size_t> open;  // places in occupied_
    for (std::size_t i = 0; i < occupied_.size(); ++i)
      if (plane_of_[i] == 0) open.push_back(i);
    if (open.empty()) return false;
    const std::size_t stride = std::max<std::size_t>(1, open.size() / kSampleMax);
    Random random(number);
    Plane best;
    std::size_t most = 0;
    for (int trial = 0; trial < kTrials; ++trial) {
      const std::size_t seed = open[static_cast<std::size_t>(random.below(static_cast<int>(open.size())))];
      Plane plane;
      if (!propose(seed, plane)) continue;
      std::size_t near = 0, above = 0, below = 0;
      for (std::size_t i = 0; i < open.size(); i += stride) {
        const double height_m = plane.height_m(centers_m_[open[i]]);
        near += std::abs(height_m) <= thickness_m_;
        (height_m > thickness_m_ ? above : below) += std::abs(height_m) > thickness_m_;
      }
      if (near <= most || beyond_too_many(above, below)) continue;
      most = near;
      best = plane;
    }
    return most > 0 && accept(open, best, number);
  }

  static bool beyond_too_many(std::size_t above, std::size_t below) {
    return static_cast<double>(std::min(above, below)) > kBeyondMax * static_cast<double>(above + below);
  }

  /// The plane through the open voxels around one of them.
  bool propose(std::size_t seed, Plane& plane) const {
    const GridGeometry& g = map_.geometry();
    const Eigen::Vector3i v = g.voxel_at(occupied_[seed]);
    PlaneFit fit;
    for (int z = -kNeighborhood; z <= kNeighborhood; ++z) {
      for (int y = -kNeighborhood; y <= kNeighborhood; ++y) {
        for (int x = -kNeighborhood; x <= kNeighborhood; ++x) {
          const Eigen::Vector3i n = v + Eigen::Vector3i(x, y, z);
          if (g.contains(n) && is_open_[g.index(n)]) fit.add(g.center_m(n));
        }
      }
    }
    double flatness = 1;
    if (fit.count < 2 * kNeighborhood * kNeighborhood) return false;
    plane = fit.solve(flatness);
    return flatness < 0.2;
  }

  /// Fits the plane to all that is near it, and takes it when it bounds the room.
  bool accept(const std::vector<std::size_t>& open, Plane plane, std::uint8_t number) {
    for (int round = 0; round < 3; ++round) {
      PlaneFit fit;
      for (const std::size_t i : open)
        if (std::abs(plane.height_m(centers_m_[i])) <= thickness_m_) fit.add(centers_m_[i]);
      double flatness = 1;
      if (fit.count < 3) return false;
      plane = fit.solve(flatness);
    }
    std::vector<std::size_t> slab;
    std::size_t above = 0, below = 0;
    for (const std::size_t i : open) {
      const double height_m = plane.height_m(centers_m_[i]);
      if (std::abs(height_m) <= thickness_m_) slab.push_back(i);
      (height_m > thickness_m_ ? above : below) += std::abs(height_m) > thickness_m_;
    }
    if (beyond_too_many(above, below) || above + below == 0) return false;
    const std::vector<std::size_t> near = surfaces_of(slab);
    if (static_cast<double>(near.size()) < kShareMin * static_cast<double>(occupied_.size())) return false;
    if (!seen_from(near, above >= below ? plane.normal : Eigen::Vector3d(-plane.normal), plane)) return false;
    for (const std::size_t i : near) {
      plane_of_[i] = number;
      is_open_[occupied_[i]] = false;
    }
    return true;
  }

  /// The connected pieces of a slab that are surfaces, not slices through something that stands across it.
  std::vector<std::size_t> surfaces_of(const std::vector<std::size_t>& slab) {
    for (const std::size_t i : slab) slab_mark_[occupied_[i]] = kInSlab;
    std::vector<std::vector<std::size_t>> pieces;
    std::size_t largest = 0;
    for (const std::size_t first : slab) {
      if (slab_mark_[occupied_[first]] != kInSlab) continue;
      std::vector<std::size_t> piece = {occupied_[first]};
      slab_mark_[occupied_[first]] = kInPiece;
      std::size_t touching = 0;
      for (std::size_t next = 0; next < piece.size(); ++next) {
        bool touches = false;
        for_each_neighbor(piece[next], [&](std::size_t index) {
          touches = touches || (is_open_[index] && slab_mark_[index] == 0);
          if (slab_mark_[index] != kInSlab) return;
          slab_mark_[index] = kInPiece;
          piece.push_back(index);
        });
        touching += touches;
      }
      if (static_cast<double>(touching) > kTouchingMax * static_cast<double>(piece.size())) continue;
      largest = std::max(largest, piece.size());
      pieces.push_back(std::move(piece));
    }
    for (const std::size_t i : slab) slab_mark_[occupied_[i]] = 0;
    std::vector<std::size_t> kept;
    for (const std::vector<std::size_t>& piece : pieces) {
      if (static_cast<double>(piece.size()) < kPieceMin * static_cast<double>(largest)) continue;
      for (const std::size_t index : piece)
        kept.push_back(static_cast<std::size_t>(std::ranges::lower_bound(occupied_, index) - occupied_.begin()));
    }
    std::ranges::sort(kept);
    return kept;
  }

  template <typename Visit>
  void for_each_neighbor(std::size_t index, Visit visit) const {
    const GridGeometry& g = map_.geometry();
    const Eigen::Vector3i v = g.voxel_at(index);
    for (int i = 0; i < 27; ++i) {
      const Eigen::Vector3i n = v + Eigen::Vector3i(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1);
      if (i != 13 && g.contains(n)) visit(g.index(n));
    }
  }

  /// Whether the plane is large enough, and mostly free before it on the side of `toward`.
  bool seen_from(const std::vector<std::size_t>& near, const Eigen::Vector3d& toward, const Plane& plane) const {
    const GridGeometry& g = map_.geometry();
    const double before_m = thickness_m_ + 1.5 * g.resolution_m;
    // Each cell of the plane once: voxels in several layers fall into one.
    int across = 0;
    toward.cwiseAbs().maxCoeff(&across);
    std::size_t cells = 0, free = 0;
    const auto key = [&](const Eigen::Vector3i& v) {
      Eigen::Vector3i flat = v;
      flat[across] = 0;
      return g.index(flat);
    };
    std::vector<std::pair<std::size_t, std::size_t>> by_cell;
    by_cell.reserve(near.size());
    for (const std::size_t i : near) by_cell.emplace_back(key(g.voxel_at(occupied_[i])), i);
    std::ranges::sort(by_cell);
    for (std::size_t n = 0; n < by_cell.size(); ++n) {
      if (n > 0 && by_cell[n].first == by_cell[n - 1].first) continue;
      ++cells;
      const Eigen::Vector3d& center = centers_m_[by_cell[n].second];
      const double lift_m = before_m - plane.height_m(center) * toward.dot(plane.normal);
      free += map_.class_at(center + lift_m * toward) == VoxelClass::kFree;
    }
    const double cell_m2 = g.resolution_m * g.resolution_m / std::abs(toward[across]);
    return static_cast<double>(cells) * cell_m2 >= kAreaMin_m2 &&
           static_cast<double>(free) >= kFreeBeforeMin * static_cast<double>(cells);
  }

  const VoxelMap& map_;
  std::span<const std::size_t> occupied_;
  std::vector<std::uint8_t> plane_of_;
  std::vector<bool> is_open_;
  std::vector<std::uint8_t> slab_mark_;  // for each voxel of the map, of the slab that is looked at
  std::vector<Eigen::Vector3d> centers_m_;
  double thickness_m_;
};

}  // namespace

std::vector<std::uint8_t> find_room_planes(const VoxelMap& map, std::span<const std::size_t> occupied) {
  return RoomPlanes(map, occupied).find();
}

}  // namespace firstlook
