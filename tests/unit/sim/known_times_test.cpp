#include "hal/sim/known_times.hpp"

#include <catch2/catch.hpp>

using namespace firstlook;
using namespace firstlook::sim;

namespace {

class Told final : public KnownFreeView {
 public:
  [[nodiscard]] const GridGeometry& geometry() const override { return geometry_; }
  [[nodiscard]] bool free_for_motion(std::size_t) const override { return false; }
  [[nodiscard]] bool known(std::size_t voxel) const override { return known_[voxel] != 0; }
  [[nodiscard]] std::uint32_t revision() const override { return revision_; }
  void tell(std::size_t first, std::size_t last, std::uint8_t known = 1) {
    for (std::size_t i = first; i < last; ++i) known_[i] = known;
    ++revision_;
  }
  void tell_silently(std::size_t voxel) { known_[voxel] = 1; }

 private:
  GridGeometry geometry_ = GridGeometry::covering({0, 0, 0}, {0.5, 0.5, 0.4}, 0.1);
  std::vector<std::uint8_t> known_ = std::vector<std::uint8_t>(geometry_.count(), 0);
  std::uint32_t revision_ = 7;
};

}  // namespace

TEST_CASE("the time of a share is when the last voxel that it takes became known", "[grader]") {
  Told view;
  KnownTimes times;
  std::vector<std::uint8_t> marks(view.geometry().count(), 0);
  std::fill_n(marks.begin(), 40, std::uint8_t{1});
  CHECK_FALSE(times.time_s(marks, 0.5));
  times.watch(&view);
  view.tell(0, 10);
  times.note(Instant{seconds(1).ns});
  view.tell(0, 30);
  times.note(Instant{seconds(2).ns});
  view.tell_silently(35);  // without a new revision nobody looks
  times.note(Instant{seconds(3).ns});
  CHECK(times.time_s(marks, 0.25) == 1.0);
  CHECK(times.time_s(marks, 0.26) == 2.0);
  CHECK(times.time_s(marks, 0.75) == 2.0);
  CHECK_FALSE(times.time_s(marks, 0.76));
  view.tell(0, 10, 0);  // what was known stays so here
  view.tell(30, 40);
  times.note(Instant{seconds(4).ns});
  CHECK(times.time_s(marks, 1.0) == 4.0);
  CHECK(times.time_s(marks, 0.25) == 1.0);
  times.watch(nullptr);
  CHECK(times.time_s(marks, 1.0) == 4.0);
  CHECK_FALSE(times.time_s(std::vector<std::uint8_t>(3, 1), 0.5));
}
