/// The map: log-odds of occupancy for each voxel of a dense grid, and what safety rule 1 must know about it.
/// Log-odds are OctoMap's default model (0.7, 0.4, 0.1192, 0.971) in units of log-odds 0.8473 / 23.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "algorithms/kinematics/arm_model.hpp"
#include "algorithms/mapping/grid_geometry.hpp"
#include "algorithms/mapping/safe_zone.hpp"
#include "platform/core/transform.hpp"

namespace firstlook {

inline constexpr std::int8_t kUnknownLogOdds = -128;
inline constexpr int kHitLogOdds = 23;                                    ///< p = 0.7
inline constexpr int kMissLogOdds = -11;                                  ///< p = 0.4
inline constexpr int kLogOddsMin = -54;                                   ///< p = 0.1192
inline constexpr int kLogOddsMax = 95;                                    ///< p = 0.971
inline constexpr int kKnownFreeLogOdds = -22;                             ///< safety rule 1: two misses
inline constexpr double kLogOddsUnit = 0.8472978603872037 / kHitLogOdds;  ///< ln(0.7 / 0.3) / 23

enum class VoxelClass : std::uint8_t { kUnknown, kFree, kOccupied };

/// Free below log-odds 0, occupied from 0, as OctoMap.
[[nodiscard]] constexpr VoxelClass classify(std::int8_t log_odds) {
  if (log_odds == kUnknownLogOdds) return VoxelClass::kUnknown;
  return log_odds >= 0 ? VoxelClass::kOccupied : VoxelClass::kFree;
}

struct VoxelCounts {
  std::size_t unknown = 0;
  std::size_t free = 0;
  std::size_t occupied = 0;
  bool operator==(const VoxelCounts&) const = default;
};

/// An axis-aligned box in base coordinates; bounds may be infinite.
struct AxisBox {
  Eigen::Vector3d low_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d high_m = Eigen::Vector3d::Zero();
};

/// All points p with normal . p > offset_m; base frame, unit normal.
struct HalfSpace {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
  double offset_m = 0;
};

/// The eighths of one voxel (octants.hpp), one bit each.
struct Octants {
  std::uint8_t surface = 0;  ///< a surface was hit here, and no ray has crossed it since
  std::uint8_t crossed = 0;  ///< a ray has crossed it, and no surface was hit here since
  [[nodiscard]] std::uint8_t not_crossed() const { return static_cast<std::uint8_t>(~crossed); }
};

/// What one frame changed.
struct FrameChange {
  std::size_t voxels_missed = 0;      ///< seen free in this frame
  std::size_t voxels_hit = 0;         ///< seen occupied in this frame
  std::size_t voxels_discovered = 0;  ///< unknown before
  std::size_t zone_revoked = 0;       ///< safe zone voxels that this frame's hits took away
};

/// Two poses count as different when the camera moved or turned at least this much (safety rule 1).
inline constexpr double kDifferentPoseMin_m = 0.02;
inline constexpr double kDifferentPoseMin_rad = 0.03490658503988659;  // 2 degrees

/// One writer, no locks: jobs that touch the map run one after the other. Memory is taken at construction only.
/// Copying copies everything (use assignment between maps of one geometry to reuse memory).
class VoxelMap {
 public:
  enum class Planes : std::uint8_t {
    kAll,
    kWithOpenRays,  ///< and where rays without a return passed (open_rays.hpp): two bytes more a voxel
    kLogOddsOnly,   ///< a tenth of the memory; nothing is ever known free and there is no safe zone: for offline maps
  };
  explicit VoxelMap(const GridGeometry& geometry, Planes planes = Planes::kAll);
  /// A map from elsewhere, kLogOddsOnly. @param log_odds  geometry.count() values: kUnknownLogOdds or within the clamps
  VoxelMap(const GridGeometry& geometry, std::vector<std::int8_t> log_odds);

  /// Bytes that a map of this geometry occupies.
  [[nodiscard]] static std::size_t required_bytes(const GridGeometry& geometry, Planes planes = Planes::kAll);

  [[nodiscard]] const GridGeometry& geometry() const { return geometry_; }
  [[nodiscard]] std::size_t size() const { return log_odds_.size(); }

  [[nodiscard]] std::int8_t log_odds(std::size_t index) const { return log_odds_[index]; }
  [[nodiscard]] std::span<const std::int8_t> log_odds() const { return log_odds_; }
  [[nodiscard]] VoxelClass voxel_class(std::size_t index) const { return classify(log_odds_[index]); }
  /// The class of the voxel that holds a point of base; unknown outside the grid and for points that are not finite.
  [[nodiscard]] VoxelClass class_at(const Eigen::Vector3d& point_m) const;
  [[nodiscard]] VoxelCounts counts() const;

  /// Safety rule 1: log-odds at most -22, seen free from two different poses, no hit in the latest frame that saw the
  /// voxel, seen within `free_max_age_s` before `now_s` (a stamp in the future is refused), seen since
  /// forget_known_free(), and every octant crossed by a ray since a surface was hit there.
  [[nodiscard]] bool known_free(std::size_t index, double now_s, double free_max_age_s) const;

  /// Whether the latest frame that saw the voxel is too old at `at_s`.
  [[nodiscard]] bool expires(std::size_t index, double at_s, double free_max_age_s) const {
    return has_motion_planes() && at_s - static_cast<double>(seen_s_[index]) > free_max_age_s;
  }

  /// One byte for each voxel, 1 where motion may be: known free or intact safe zone, and not blocked.
  /// @param out size() bytes
  void free_mask(double now_s, double free_max_age_s, std::span<std::uint8_t> out) const;

  /// Safety rule 2: voxels entirely inside the cylinder count as free for motion until a hit. Replaces an earlier zone
  /// and forgets its revocations. Log-odds stay untouched.
  void set_safe_zone(const SafeZone& zone);
  /// Voxels that parts of the arm which never move fill at least in part (within `margin_m`): hits there are the arm
  /// itself, seen at its edge, and leave the safe zone as it is.
  void note_fixed_body(const Capsule& capsule, double margin_m);
  [[nodiscard]] bool is_fixed_body(std::size_t index) const {
    return has_motion_planes() && (flags_[index] & kFixedBody) != 0;
  }
  [[nodiscard]] bool in_intact_safe_zone(std::size_t index) const;
  [[nodiscard]] bool zone_revoked(std::size_t index) const;

  /// Every voxel that the obstacle touches is never free for motion: keep-out regions and the cart's own box.
  void block(const AxisBox& box);
  void block(const HalfSpace& half_space);
  [[nodiscard]] bool blocked(std::size_t index) const;

  /// Safety rule 7, after a stop, long pause or restart: nothing is known free until it is seen free again.
  void forget_known_free();

  [[nodiscard]] Octants octants(std::size_t index) const { return has_motion_planes() ? octants_[index] : Octants{}; }
  /// Whether a surface was hit in a part of the voxel that no ray has crossed since, whatever its log-odds say.
  [[nodiscard]] bool holds_surface(std::size_t index) const { return octants(index).surface != 0; }
  void note_surface(std::size_t index, unsigned octant) {
    if (!has_motion_planes()) return;
    octants_[index].surface = static_cast<std::uint8_t>(octants_[index].surface | 1U << octant);
    octants_[index].crossed = static_cast<std::uint8_t>(octants_[index].crossed & ~(1U << octant));
  }
  void note_crossed(std::size_t index, std::uint8_t crossed) {
    if (!has_motion_planes()) return;
    octants_[index].surface = static_cast<std::uint8_t>(octants_[index].surface & ~crossed);
    octants_[index].crossed = static_cast<std::uint8_t>(octants_[index].crossed | crossed);
  }
  [[nodiscard]] bool has_motion_planes() const { return !flags_.empty(); }

  /// Applies one frame: one update for each voxel, occupied before free, none at a clamp.
  /// @param missed, hit  bit i of word i / 64 is voxel 64 * first_word + i; nothing happens outside these words
  /// @param stamp_s      not negative; kept in whole seconds
  FrameChange apply(std::span<const std::uint64_t> missed, std::span<const std::uint64_t> hit,
                    const Transform<Base, Depth>& base_T_depth, double stamp_s, std::size_t first_word = 0);
  [[nodiscard]] static std::size_t bit_words(const GridGeometry& geometry) { return (geometry.count() + 63) / 64; }

  /// Safety rule 9: one miss for voxels that open rays of this pose and of an earlier, different one pass. Voxels that
  /// were hit, still hold a surface, or are suspect stay as they are. Needs Planes::kWithOpenRays.
  /// @param passed  none of them updated by the frame itself; voxels that were not missed are taken out
  FrameChange apply_open(std::span<std::uint64_t> passed, const Transform<Base, Depth>& base_T_depth, double stamp_s);
  /// From now on open rays clear none of these voxels: something dark may stand there.
  void suspect(std::span<const std::uint64_t> voxels);

  /// Occupied voxels that no frame saw for longer than `max_age_s` become unknown, never free. @return how many
  std::size_t forget_old_occupied(double now_s, double max_age_s);

  /// Sets a voxel at its clamp (or unknown) as if two poses had seen it at `stamp_s`: for maps that come from
  /// elsewhere.
  void set(std::size_t index, VoxelClass voxel_class, double stamp_s);

 private:
  /// Frames near one reference pose share an id; the radii say how far its frames strayed from the reference.
  struct SeenFrom {
    Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
    Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
    double radius_m = 0;
    double radius_rad = 0;
  };
  enum Flag : std::uint8_t {
    kFreeFromTwoPoses = 1,
    kHitInLatestFrame = 2,
    kInSafeZone = 4,
    kZoneRevoked = 8,
    kBlocked = 16,
    kForgotten = 32,
    kFixedBody = 64,
    kSuspect = 128,
  };

  /// The frame being applied.
  struct Frame {
    std::uint16_t pose_id = 0;
    std::uint32_t stamp_s = 0;
  };

  [[nodiscard]] Frame begin_frame(const Transform<Base, Depth>& base_T_depth, double stamp_s);
  std::uint16_t pose_id(const Transform<Base, Depth>& base_T_depth);
  void mark_different_poses(const Transform<Base, Depth>& base_T_depth);
  void miss(std::size_t index, const Frame& frame, FrameChange& change);
  void hit(std::size_t index, const Frame& frame, FrameChange& change);

  GridGeometry geometry_;
  std::vector<std::int8_t> log_odds_;
  std::vector<std::uint8_t> flags_;
  std::vector<Octants> octants_;
  std::vector<std::uint16_t> first_free_pose_;  ///< index into poses_ plus 1; 0 is none
  std::vector<std::uint16_t> first_open_pose_;  ///< the same of open rays
  std::vector<std::uint32_t> seen_s_;           ///< stamp of the latest frame that saw the voxel
  std::vector<SeenFrom> poses_;
  std::vector<std::uint8_t> different_;  ///< for each pose: does the current frame differ from it?
};

}  // namespace firstlook
