#include "algorithms/mapping/voxel_map.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <vector>

namespace firstlook {
namespace {

constexpr double kMaxAge_s = 600;

Transform<Base, Depth> pose_at(double x_m, double turn_rad = 0) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(turn_rad, Eigen::Vector3d::UnitY())), {x_m, 0, 0}};
}

// A map of 4 x 4 x 4 voxels of 5 cm with frames that see one voxel.
struct SmallMap {
  VoxelMap map{GridGeometry{0.05, {0, 0, 0}, {4, 4, 4}}};
  FrameChange see(bool hit, std::size_t index, const Transform<Base, Depth>& pose, double stamp_s) {
    std::vector<std::uint64_t> none(1, 0), bits(1, 1ULL << index);
    if (!hit) map.note_crossed(index, 0xFF);
    return hit ? map.apply(none, bits, pose, stamp_s) : map.apply(bits, none, pose, stamp_s);
  }
  FrameChange miss(std::size_t index, const Transform<Base, Depth>& pose, double stamp_s) {
    return see(false, index, pose, stamp_s);
  }
  FrameChange hit(std::size_t index, const Transform<Base, Depth>& pose, double stamp_s) {
    return see(true, index, pose, stamp_s);
  }
};

}  // namespace

TEST_CASE("hits and misses step as OctoMap's and stop at the clamps", "[mapping]") {
  SmallMap m;
  CHECK(m.map.voxel_class(3) == VoxelClass::kUnknown);
  CHECK(m.miss(3, pose_at(0), 1).voxels_discovered == 1);
  CHECK(m.map.log_odds(3) == -11);
  CHECK(m.hit(3, pose_at(0), 1).voxels_discovered == 0);
  CHECK(m.map.log_odds(3) == 12);
  CHECK(m.map.voxel_class(3) == VoxelClass::kOccupied);
  for (int i = 0; i < 300; ++i) m.hit(3, pose_at(0), 1);
  CHECK(m.map.log_odds(3) == 95);
  for (int i = 0; i < 300; ++i) m.miss(3, pose_at(0), 1);
  CHECK(m.map.log_odds(3) == -54);
  CHECK(classify(0) == VoxelClass::kOccupied);
  CHECK(classify(-1) == VoxelClass::kFree);
  CHECK(m.map.counts() == VoxelCounts{63, 1, 0});
}

TEST_CASE("occupied wins over free in one frame", "[mapping]") {
  SmallMap m;
  const std::vector<std::uint64_t> both(1, 0b1100), hits(1, 0b0100);
  const FrameChange change = m.map.apply(both, hits, pose_at(0), 1);
  CHECK(change.voxels_missed == 1);
  CHECK(change.voxels_hit == 1);
  CHECK(m.map.log_odds(2) == 23);
  CHECK(m.map.log_odds(3) == -11);
}

TEST_CASE("two frames from two poses make a voxel known free", "[mapping][safety]") {
  SmallMap m;
  m.miss(0, pose_at(0), 10);
  CHECK_FALSE(m.map.known_free(0, 10, kMaxAge_s));
  m.miss(0, pose_at(0.03), 11);
  CHECK(m.map.known_free(0, 11, kMaxAge_s));
  CHECK_FALSE(m.map.known_free(1, 11, kMaxAge_s));
}

TEST_CASE("any number of frames from one pose frees nothing", "[mapping][safety]") {
  SmallMap m;
  for (int i = 0; i < 50; ++i) m.miss(0, pose_at(0), i);
  CHECK(m.map.log_odds(0) == -54);
  CHECK_FALSE(m.map.known_free(0, 50, kMaxAge_s));
}

TEST_CASE("poses differ by 2 cm or 2 degrees", "[mapping][safety]") {
  const double degree = 0.017453292519943295;
  const auto free_after = [](const Transform<Base, Depth>& second) {
    SmallMap m;
    m.miss(0, pose_at(0), 1);
    m.miss(0, second, 2);
    return m.map.known_free(0, 2, kMaxAge_s);
  };
  CHECK_FALSE(free_after(pose_at(0.0199)));
  CHECK(free_after(pose_at(0.0201)));
  CHECK_FALSE(free_after(pose_at(0, 1.99 * degree)));
  CHECK(free_after(pose_at(0, 2.01 * degree)));
}

TEST_CASE("creeping and coming back do not make one pose two", "[mapping][safety]") {
  SmallMap m;
  m.miss(0, pose_at(0), 1);
  for (int i = 1; i <= 19; ++i) m.miss(0, pose_at(0.001 * i), 1);  // steps of 1 mm, never 2 cm from the first
  CHECK_FALSE(m.map.known_free(0, 1, kMaxAge_s));
  m.miss(1, pose_at(0.5), 2);  // elsewhere: another voxel
  m.miss(0, pose_at(0.0), 3);  // and back
  CHECK_FALSE(m.map.known_free(0, 3, kMaxAge_s));
  m.miss(0, pose_at(0.0225), 4);  // beyond 2 cm even of the frames that shared the first pose's id
  CHECK(m.map.known_free(0, 4, kMaxAge_s));
}

TEST_CASE("more poses than the table holds never make one pose two", "[mapping][safety]") {
  SmallMap m;
  for (int i = 0; i < 5000; ++i) m.miss(1, pose_at(1 + 0.01 * i), 1);
  m.miss(0, pose_at(100), 2);  // shares an id with the farthest pose, 50 m off
  m.miss(0, pose_at(100), 3);
  m.miss(0, pose_at(100.001), 4);
  CHECK_FALSE(m.map.known_free(0, 4, kMaxAge_s));
}

TEST_CASE("a hit in the latest frame blocks whatever the log-odds say", "[mapping][safety]") {
  SmallMap m;
  for (int i = 0; i < 6; ++i) m.miss(0, pose_at(0.05 * i), 1);
  REQUIRE(m.map.known_free(0, 1, kMaxAge_s));
  m.hit(0, pose_at(0), 2);
  CHECK(m.map.log_odds(0) == -31);  // still at most -22
  CHECK_FALSE(m.map.known_free(0, 2, kMaxAge_s));
  m.miss(0, pose_at(0), 3);
  CHECK(m.map.known_free(0, 3, kMaxAge_s));
}

TEST_CASE("log-odds above -22 are not known free", "[mapping][safety]") {
  SmallMap m;
  m.miss(0, pose_at(0), 1);
  m.hit(0, pose_at(0), 1);
  m.miss(0, pose_at(0.1), 2);
  m.miss(0, pose_at(0.2), 2);
  m.miss(0, pose_at(0.3), 2);
  CHECK(m.map.log_odds(0) == -21);
  CHECK_FALSE(m.map.known_free(0, 2, kMaxAge_s));
  m.miss(0, pose_at(0.4), 2);
  CHECK(m.map.known_free(0, 2, kMaxAge_s));
}

TEST_CASE("what was seen too long ago, or in the future, is not known free", "[mapping][safety]") {
  SmallMap m;
  m.miss(0, pose_at(0), 100);
  m.miss(0, pose_at(0.1), 100);
  CHECK(m.map.known_free(0, 700, 600));
  CHECK_FALSE(m.map.known_free(0, 701, 600));
  CHECK_FALSE(m.map.known_free(0, 99, 600));
  CHECK_FALSE(m.map.known_free(0, std::numeric_limits<double>::quiet_NaN(), 600));
}

TEST_CASE("after a stop nothing is known free until it is seen free again", "[mapping][safety]") {
  SmallMap m;
  for (const std::size_t voxel : {0u, 1u}) {
    m.miss(voxel, pose_at(0), 1);
    m.miss(voxel, pose_at(0.1), 1);
  }
  m.map.forget_known_free();
  CHECK_FALSE(m.map.known_free(0, 1, kMaxAge_s));
  m.hit(0, pose_at(0.1), 2);
  CHECK_FALSE(m.map.known_free(0, 2, kMaxAge_s));
  m.miss(1, pose_at(0.1), 2);
  CHECK(m.map.known_free(1, 2, kMaxAge_s));
  CHECK_FALSE(m.map.known_free(0, 2, kMaxAge_s));
}

TEST_CASE("a hit on the bolted base leaves the safe zone as it is, one beside it does not", "[mapping][safety]") {
  VoxelMap map(GridGeometry::covering({-1, -1, -0.5}, {1, 1, 1.5}, 0.05));
  map.set_safe_zone({0.5, 1.15, -0.02});
  map.note_fixed_body({.a = {0, 0, 0.05}, .b = {0, 0, 0.1}, .radius_m = 0.075, .link = 0}, 0.02);
  const auto at = [&](double x, double y, double z) { return map.geometry().index(map.geometry().voxel({x, y, z})); };
  const std::size_t base = at(0.076, 0.024, 0.024);
  const std::size_t beside = at(0.151, 0.024, 0.024);
  REQUIRE(map.is_fixed_body(base));
  REQUIRE_FALSE(map.is_fixed_body(beside));
  std::vector<std::uint64_t> none(VoxelMap::bit_words(map.geometry())), hit = none;
  for (const std::size_t i : {base, beside}) hit[i / 64] |= 1ULL << (i % 64);
  CHECK(map.apply(none, hit, pose_at(0), 1).zone_revoked == 1);
  CHECK(map.in_intact_safe_zone(base));
  CHECK_FALSE(map.in_intact_safe_zone(beside));
  map.set(base, VoxelClass::kOccupied, 2);
  CHECK(map.in_intact_safe_zone(base));
}

TEST_CASE("the safe zone holds whole voxels, and hits revoke them one by one", "[mapping][safety]") {
  VoxelMap map(GridGeometry::covering({-1, -1, -0.5}, {1, 1, 1.5}, 0.05));
  const SafeZone zone{0.5, 1.15, -0.02};
  map.set_safe_zone(zone);
  std::vector<std::uint8_t> mask(map.size());
  map.free_mask(0, kMaxAge_s, mask);
  std::size_t inside = 0;
  for (std::size_t i = 0; i < map.size(); ++i) {
    const Eigen::Vector3d c = map.geometry().center_m(map.geometry().voxel_at(i));
    bool whole = true;
    for (int corner = 0; corner < 8; ++corner) {
      const Eigen::Vector3d p = c + 0.025 * Eigen::Vector3d((corner & 1) != 0 ? 1 : -1, (corner & 2) != 0 ? 1 : -1,
                                                            (corner & 4) != 0 ? 1 : -1);
      whole = whole && zone.depth_m(p) >= -1e-9;
    }
    REQUIRE((mask[i] != 0) == whole);
    inside += whole;
  }
  CHECK(inside > 5000);
  CHECK(map.counts().unknown == map.size());  // a mask of its own: the map knows nothing

  const std::size_t target = map.geometry().index(map.geometry().voxel({0.21, 0.01, 0.51}));
  std::vector<std::uint64_t> none(VoxelMap::bit_words(map.geometry())), hit = none;
  hit[target / 64] |= 1ULL << (target % 64);
  CHECK(map.apply(none, hit, pose_at(0), 1).zone_revoked == 1);
  CHECK_FALSE(map.in_intact_safe_zone(target));
  CHECK(map.in_intact_safe_zone(target + 1));
  map.apply(hit, none, pose_at(0), 2);
  map.free_mask(2, kMaxAge_s, mask);
  CHECK(mask[target] == 0);  // one miss does not give it back
  for (int i = 0; i < 5; ++i) map.apply(hit, none, pose_at(0.1 * i), 3);
  map.free_mask(3, kMaxAge_s, mask);
  CHECK(mask[target] == 0);  // nobody has looked through all of it
  map.note_crossed(target, 0xFE);
  map.free_mask(3, kMaxAge_s, mask);
  CHECK(mask[target] == 0);
  map.note_crossed(target, 0x01);
  map.free_mask(3, kMaxAge_s, mask);
  CHECK(mask[target] == 1);  // known free by rule 1
  CHECK_FALSE(map.in_intact_safe_zone(target));
  map.set_safe_zone(zone);
  CHECK(map.in_intact_safe_zone(target));
}

TEST_CASE("keep-out regions are never free", "[mapping][safety]") {
  VoxelMap map(GridGeometry{0.1, {0, 0, 0}, {10, 10, 10}});
  for (std::size_t i = 0; i < map.size(); ++i) map.set(i, VoxelClass::kFree, 0);
  const double infinite = std::numeric_limits<double>::infinity();
  map.block(AxisBox{{0.35, 0.2, -infinite}, {0.5, 0.41, infinite}});
  map.block(HalfSpace{Eigen::Vector3d(0, 1, 1).normalized(), std::sqrt(2) * 0.85});
  std::vector<std::uint8_t> mask(map.size());
  map.free_mask(0, kMaxAge_s, mask);
  for (std::size_t i = 0; i < map.size(); ++i) {
    const Eigen::Vector3i v = map.geometry().voxel_at(i);
    const bool in_box = v.x() >= 3 && v.x() <= 4 && v.y() >= 2 && v.y() <= 4;
    const bool behind = v.y() + v.z() + 2 > 17;  // the far corner, in tenths
    REQUIRE((mask[i] == 0) == (in_box || behind));
    REQUIRE(map.blocked(i) == (in_box || behind));
  }
}

TEST_CASE("outside the grid everything is unknown", "[mapping][hostile]") {
  SmallMap m;
  m.map.set(0, VoxelClass::kOccupied, 0);
  CHECK(m.map.class_at({0.01, 0.01, 0.01}) == VoxelClass::kOccupied);
  const double nan = std::numeric_limits<double>::quiet_NaN(), infinite = std::numeric_limits<double>::infinity();
  for (const double bad : {-0.001, 0.21, 1e300, nan, infinite, -infinite})
    CHECK(m.map.class_at({0.01, bad, 0.01}) == VoxelClass::kUnknown);
}

TEST_CASE("a map of log-odds only never calls anything free for motion", "[mapping][safety]") {
  VoxelMap map(GridGeometry{0.05, {0, 0, 0}, {4, 4, 4}}, VoxelMap::Planes::kLogOddsOnly);
  map.set_safe_zone({10, 10, -5});
  const std::vector<std::uint64_t> all(1, ~0ULL), none(1, 0);
  for (int i = 0; i < 4; ++i) map.apply(all, none, pose_at(i), 1);
  CHECK(map.counts().free == 64);
  std::vector<std::uint8_t> mask(64, 1);
  map.free_mask(1, kMaxAge_s, mask);
  CHECK(mask == std::vector<std::uint8_t>(64, 0));
}

TEST_CASE("occupied voxels that nobody saw for too long become unknown, never free", "[mapping][safety]") {
  SmallMap m;
  m.hit(0, pose_at(0), 10);
  m.hit(1, pose_at(0), 10);
  m.miss(2, pose_at(0), 10);
  m.miss(2, pose_at(0.1), 10);
  m.hit(1, pose_at(0), 40);
  CHECK(m.map.forget_old_occupied(40, 30) == 0);  // not yet older
  CHECK(m.map.forget_old_occupied(41, 30) == 1);
  CHECK(m.map.voxel_class(0) == VoxelClass::kUnknown);
  CHECK(m.map.voxel_class(1) == VoxelClass::kOccupied);
  CHECK(m.map.voxel_class(2) == VoxelClass::kFree);  // free space ages on its own (known_free)
  CHECK_FALSE(m.map.known_free(0, 41, kMaxAge_s));
  // What was forgotten is as if never seen: two poses again.
  m.miss(0, pose_at(0), 42);
  CHECK_FALSE(m.map.known_free(0, 42, kMaxAge_s));
  m.miss(0, pose_at(0.1), 43);
  CHECK(m.map.known_free(0, 43, kMaxAge_s));
}

TEST_CASE("a hit that took a piece of the safe zone away counts on when the voxel is forgotten", "[mapping][safety]") {
  SmallMap m;
  m.map.set_safe_zone({.radius_m = 1, .height_m = 1, .floor_m = 0});
  REQUIRE(m.map.in_intact_safe_zone(0));
  m.hit(0, pose_at(0), 10);
  REQUIRE(m.map.forget_old_occupied(100, 30) == 1);
  CHECK_FALSE(m.map.in_intact_safe_zone(0));
}

TEST_CASE("open rays clear with a second pose only, and neither what was hit nor what is suspect",
          "[mapping][safety]") {
  VoxelMap map({0.05, {0, 0, 0}, {4, 4, 4}}, VoxelMap::Planes::kWithOpenRays);
  const auto open = [&](const Transform<Base, Depth>& pose, double stamp_s) {
    std::vector<std::uint64_t> passed(1, 0b1111);
    map.apply_open(passed, pose, stamp_s);
    return passed[0];
  };
  const std::vector<std::uint64_t> none(1, 0), second(1, 0b0010), third(1, 0b0100);
  map.apply(none, second, pose_at(0), 1);
  map.suspect(third);
  CHECK(open(pose_at(0), 2) == 0);
  CHECK(open(pose_at(0.001), 3) == 0);
  CHECK(open(pose_at(0.1), 4) == 0b1001);
  CHECK(map.voxel_class(0) == VoxelClass::kFree);
  CHECK(map.voxel_class(1) == VoxelClass::kOccupied);
  CHECK(map.voxel_class(2) == VoxelClass::kUnknown);
  // A surface stays in a voxel whose log-odds say free.
  for (int i = 0; i < 5; ++i) map.apply(second, none, pose_at(0), 5);
  map.note_surface(1, 3);
  REQUIRE(map.voxel_class(1) == VoxelClass::kFree);
  CHECK(open(pose_at(0.2), 6) == 0b1001);
}

}  // namespace firstlook
