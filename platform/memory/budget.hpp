/// The memory page: every pool of the program with its count, size, owner and reason, and who has taken how much of it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <utility>

#include "platform/core/result.hpp"

namespace firstlook::memory {

inline constexpr std::size_t kKiB = 1024;
inline constexpr std::size_t kMiB = 1024 * kKiB;

/// One row of the page; the order is that of kBudget.
enum class Pool : std::uint8_t {
  kVoxelPlanes,
  kDistanceField,
  kGuardianSnapshot,
  kDepthFrames,
  kColorFrames,
  kPlannerNodes,
  kViewCandidates,
  kEventQueue,
  kJournal,
  kJobBuffers,
  kCalibrationViews,
  kApplication,
  kReportBuffers,
  kThreadStacks,
  kJobHeap,
  kLibraryPages,
  kColorSlots,
  kDepthSlots,
};

struct BudgetRow {
  Pool pool;
  std::string_view name;
  std::size_t count;
  std::size_t bytes_each;
  std::string_view owner;
  std::string_view reason;
  [[nodiscard]] constexpr std::size_t bytes() const { return count * bytes_each; }
};

inline constexpr std::size_t kThreadStackBytes = 512 * kKiB;
inline constexpr std::size_t kThreadsMax = 8;  ///< loop, map strand, free worker, pool threads, library threads
inline constexpr std::size_t kJobHeapBytes = 32 * kMiB;  ///< each of the two threads that run jobs

// clang-format off
inline constexpr std::array kBudget = {
    BudgetRow{Pool::kVoxelPlanes,      "voxel map planes",    1,  24 * kMiB,        "map strand",  "log-odds, hits, frames, times; 2 million voxels: 3 x 3 x 1.8 m at 2 cm"},
    BudgetRow{Pool::kDistanceField,    "distance field",      1,  16 * kMiB,        "map strand",  "distance and sweep buffers for the same grid"},
    BudgetRow{Pool::kGuardianSnapshot, "guardian snapshots",  2,  4 * kMiB,         "loop",        "the map as the guardian checks it, and the next one being written"},
    BudgetRow{Pool::kDepthFrames,      "depth frames",        3,  640 * 480 * 2,    "jobs",        "one being captured, one being integrated, one for the report"},
    BudgetRow{Pool::kColorFrames,      "colour frames",       4,  1920 * 1080,      "jobs",        "a grey picture, and one in colours, of a camera of full HD"},
    BudgetRow{Pool::kPlannerNodes,     "planner nodes",       2,  2 * kMiB,         "jobs",        "two trees of RRT-Connect"},
    BudgetRow{Pool::kViewCandidates,   "view candidates",     1,  4 * kMiB,         "jobs",        "configurations, what rays meet and the room around it, visibility masks"},
    BudgetRow{Pool::kEventQueue,       "event queue",         1,  1280 * kKiB,      "loop",        "64 events of 16 KiB with their heads"},
    BudgetRow{Pool::kJournal,          "journal buffer",      1,  1 * kMiB,         "loop",        "records between two writes to the disk"},
    BudgetRow{Pool::kJobBuffers,       "job buffers",         8,  32 * kKiB,        "loop, jobs",  "arguments (8 KiB) and result (16 KiB) of each outstanding job"},
    BudgetRow{Pool::kCalibrationViews, "calibration views",   64, 48 * kKiB,        "jobs",        "joints, corners and poses of each view, of each target in it"},
    BudgetRow{Pool::kApplication,      "application",         1,  4 * kMiB,         "loop",        "machine, guardian, records of phases, stops and views"},
    BudgetRow{Pool::kReportBuffers,    "report buffers",      1,  16 * kMiB,        "report",      "pictures and text of the report; pictures of calibration views"},
    BudgetRow{Pool::kThreadStacks,     "thread stacks",       kThreadsMax, kThreadStackBytes, "all", "created at boot"},
    BudgetRow{Pool::kJobHeap,          "job heap allowance",  2,  kJobHeapBytes,    "jobs",        "what OpenCV and Eigen allocate inside a job; more fails the job"},
    BudgetRow{Pool::kLibraryPages,     "library pages",       1,  45 * kMiB,        "all",         "code and data of the shared libraries under mlockall, as measured"},
    BudgetRow{Pool::kColorSlots,       "colour camera slots", 6,  1920 * 1080 * 2,  "loop",        "the last frames of a real camera, as its driver gave them: 6 of full HD, 32 of 640 x 480; none in a simulated cell"},
    BudgetRow{Pool::kDepthSlots,       "depth camera slots",  32, 640 * 480 * 2,    "loop",        "the same of a real depth camera"},
};
// clang-format on

inline constexpr std::size_t kBudgetBytes = 256 * kMiB;

[[nodiscard]] constexpr std::size_t budget_total_bytes() {
  std::size_t total = 0;
  for (const BudgetRow& row : kBudget) total += row.bytes();
  return total;
}
[[nodiscard]] constexpr bool budget_rows_in_order() {
  for (std::size_t i = 0; i < kBudget.size(); ++i) {
    if (static_cast<std::size_t>(kBudget[i].pool) != i) return false;
  }
  return true;
}
static_assert(budget_total_bytes() <= kBudgetBytes, "the pools do not fit the budget");
static_assert(budget_rows_in_order());

[[nodiscard]] constexpr const BudgetRow& budget_row(Pool pool) { return kBudget[static_cast<std::size_t>(pool)]; }

/// Takes `bytes` of a pool. Error: kOutOfMemory with the numbers when the row is exceeded; then nothing is taken.
[[nodiscard]] Status account(Pool pool, std::size_t bytes);
/// Gives back what account() took.
void release(Pool pool, std::size_t bytes);
/// Rows that are declared, not counted: they stand whole from boot whatever is used of them.
[[nodiscard]] constexpr bool is_standing(Pool pool) {
  return pool == Pool::kThreadStacks || pool == Pool::kJobHeap || pool == Pool::kLibraryPages;
}
/// Takes the standing rows: thread stacks, job heap, library pages. So the peak does not depend on the number of
/// workers. Error: kOutOfMemory when part of one is taken already.
[[nodiscard]] Status account_standing_rows();
[[nodiscard]] std::size_t accounted_bytes(Pool pool);
/// High-water mark of one pool.
[[nodiscard]] std::size_t peak_bytes(Pool pool);
/// Sum of the high-water marks of all pools: independent of the order in which threads take and give back.
[[nodiscard]] std::size_t peak_bytes();
/// Forgets all accounts and peaks: for a process that runs several jobs one after the other.
void reset_accounts();

/// What an owner holds of a pool; gives it back at the end of its life. Movable.
class PoolShare {
 public:
  PoolShare() = default;
  [[nodiscard]] static Result<PoolShare> take(Pool pool, std::size_t bytes);
  PoolShare(PoolShare&& other) noexcept : pool_(other.pool_), bytes_(std::exchange(other.bytes_, 0)) {}
  PoolShare& operator=(PoolShare&& other) noexcept {
    std::swap(pool_, other.pool_);
    std::swap(bytes_, other.bytes_);
    return *this;
  }
  PoolShare(const PoolShare&) = delete;
  PoolShare& operator=(const PoolShare&) = delete;
  ~PoolShare() {
    if (bytes_ != 0) release(pool_, bytes_);
  }
  [[nodiscard]] std::size_t bytes() const { return bytes_; }

 private:
  PoolShare(Pool pool, std::size_t bytes) : pool_(pool), bytes_(bytes) {}
  Pool pool_ = Pool::kApplication;
  std::size_t bytes_ = 0;
};

}  // namespace firstlook::memory
