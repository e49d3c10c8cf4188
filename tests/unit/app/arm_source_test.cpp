#include <catch2/catch.hpp>

#include "app/shell/device_sources.hpp"
#include "tests/support/mock_robot_arm.hpp"

using namespace firstlook;

namespace {

const GridGeometry kGrid = GridGeometry::covering({-1.5, -1.5, -0.3}, {1.5, 1.5, 1.5}, 0.1);

/// All free, or nothing at all.
void publish(PublishedSpace& published, const ArmModel& arm, bool free) {
  const std::vector<std::uint8_t> voxels(kGrid.count(), free ? PublishedSpace::kFreeVoxel : std::uint8_t{0});
  DistanceField field(kGrid, 0.6);
  field.update(voxels);
  FreeSpace space;
  space.zone_intact = false;
  space.field = &field;
  published.publish(space, body_with_camera(arm, Transform<Flange, Camera>()), Clearance{0.05, 0.01}, voxels);
}

class Arm {
 public:
  explicit Arm(const PublishedSpace& published) : source_(device_, model_, published) {}
  /// The guardian's margin with the next report.
  double margin_m() {
    now_ = now_ + mock::MockRobotArm::kPeriod;
    EventQueue queue;
    REQUIRE(source_.collect(now_, queue));
    std::optional<ArmReported> last;
    for (; !queue.empty(); queue.pop()) {
      ArmReported report;
      REQUIRE(queue.front().kind == ArmReported::kKind);
      REQUIRE(unpack(queue.front().bytes(), report));
      last = report;
    }
    REQUIRE(last);
    return last->guardian_margin_m;
  }
  mock::MockRobotArm& device() { return device_; }
  const ArmModel& model() const { return model_; }

 private:
  ArmModel model_ = *find_arm_model("ur5");
  mock::MockRobotArm device_{default_start(*find_arm_model("ur5"))};
  ArmSource source_;
  Instant now_{};
};

}  // namespace

TEST_CASE("a standing arm is judged anew when the space around it changes, a moving one at each report", "[safety]") {
  const ArmModel model = *find_arm_model("ur5");
  PublishedSpace published(kGrid, 0.6);
  publish(published, model, true);
  published.take();
  Arm arm(published);
  const double margin_m = arm.margin_m();
  REQUIRE(margin_m > 0);
  CHECK(arm.margin_m() == margin_m);
  publish(published, model, false);
  CHECK(arm.margin_m() == margin_m);  // not taken yet
  published.take();
  CHECK(arm.margin_m() < 0);
  publish(published, model, true);
  published.take();
  CHECK(arm.margin_m() == margin_m);
  JointVector elsewhere = default_start(model);
  elsewhere[1] += 0.7;
  arm.device().set_position(elsewhere);
  CHECK(arm.margin_m() != margin_m);
}

TEST_CASE("what is published is what was written last, with its three bits, however often it changes hands",
          "[safety]") {
  const ArmModel model = *find_arm_model("ur5");
  PublishedSpace published(kGrid, 0.6);
  std::vector<std::uint8_t> voxels(kGrid.count(), 0);
  for (std::uint32_t round = 1; round <= 4; ++round) {
    for (std::size_t i = 0; i < voxels.size(); ++i) voxels[i] = static_cast<std::uint8_t>((i + round) % 8);
    DistanceField field(kGrid, 0.6);
    field.update(voxels);
    FreeSpace space;
    if (round != 3) space.field = &field;
    published.publish(space, body_with_camera(model, Transform<Flange, Camera>()), Clearance{0.05, 0.01}, voxels);
    published.take();
    CHECK(published.revision() == round);
    CHECK(published.mapped() == (round != 3));
    if (round != 3) CHECK(std::ranges::equal(published.space().field->values(), field.values()));
    for (const std::size_t i : {std::size_t{0}, std::size_t{5}, std::size_t{777}}) {
      const auto bits = static_cast<unsigned>((i + round) % 8);
      CHECK(published.free_for_motion(i) == ((bits & 1U) != 0));
      CHECK(published.zone_revoked(i) == ((bits & 2U) != 0));
      CHECK(published.known(i) == ((bits & 4U) != 0));
    }
  }
}
