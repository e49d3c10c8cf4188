#include "algorithms/view_planning/explore.hpp"

#include <catch2/catch.hpp>
#include <thread>

#include "algorithms/view_planning/remaining_reason.hpp"
#include "algorithms/view_planning/sweep.hpp"
#include "tests/unit/view_planning/small_world.hpp"

using namespace firstlook;
using namespace firstlook::test;

namespace {

/// Indices dealt out to two threads.
constexpr auto run_on_two = [](int n, IndexedBody body) {
  const auto half = [&](int worker) {
    for (int i = worker; i < n; i += 2) body(i, worker);
  };
  std::thread other(half, 1);
  half(0);
  other.join();
};

Truth room_with_wall() {
  Truth truth = Truth::room();
  truth.add_box({0.65, -0.4, -0.3}, {0.75, 0.4, 0.4});  // a screen in front of the arm
  return truth;
}
const Eigen::Vector3d kPocketLow(0.8, -0.3, 0.1);  // behind it
const Eigen::Vector3d kPocketHigh(1.0, 0.3, 0.35);

/// Looks, and tells the chooser about it.
void look_and_remember(SmallWorld& world, ViewChooser& chooser, const Path& path) {
  world.follow(path);
  chooser.remember_look(world.context(), world.q);
}

/// What it knows then is enough to move in.
void look_from_two_places(SmallWorld& world) {
  world.look(world.q);
  JointVector beside = world.q;
  beside[0] += 0.2;
  world.look(beside);
  world.update();
}

void sweep(SmallWorld& world, ViewChooser& chooser) {
  SweepProgress progress = plan_sweep(world.arm, world.q, 0.99);
  world.look(world.q);
  world.update();
  for (;;) {
    const auto step =
        next_sweep_step(progress, world.context(), chooser.gain(), chooser.first_worker(), chooser.planner(), world.q);
    REQUIRE(step);
    if (step->done) return;
    look_and_remember(world, chooser, step->path);
  }
}

}  // namespace

TEST_CASE("exploration sees behind the screen, keeps to known free space, and ends with a certificate", "[explore]") {
  SmallWorld world(room_with_wall());
  ViewChooser chooser(world.map.geometry(), world.sensor, 320, 2);
  sweep(world, chooser);
  const double pocket_after_sweep = world.coverage(kPocketLow, kPocketHigh);
  std::vector<double> coverage{world.coverage()};
  ExploreOptions options;
  ViewChoice choice;
  for (options.step = 0; options.step < 60; ++options.step) {
    const auto chosen = chooser.choose(world.context(), world.q, options, run_on_two);
    REQUIRE(chosen);
    choice = *chosen;
    if (choice.outcome != ViewChoice::Outcome::kChosen) break;
    REQUIRE(choice.path.waypoints.front() == world.q);
    REQUIRE(choice.path.waypoints.back() == choice.target);
    REQUIRE(world.entries_into_unknown(choice.path) == 0);
    look_and_remember(world, chooser, choice.path);
    coverage.push_back(world.coverage());
  }
  std::string curve;
  for (const double c : coverage) curve += fmt::format(" {:.3f}", c);
  const auto clusters = find_remaining(world.map, world.zone, options.gain_min);
  const auto reasons = explain_remaining(world.context(), chooser.gain(), clusters);
  for (const auto& r : reasons) {
    curve += fmt::format("\n{} voxels {} at {:.2f} {:.2f} {:.2f}", r.voxels, to_string(r.reason), r.center_m.x(),
                         r.center_m.y(), r.center_m.z());
  }
  INFO("coverage over views:" << curve << "\npocket " << pocket_after_sweep << " -> "
                              << world.coverage(kPocketLow, kPocketHigh) << ", unreached "
                              << choice.certificate.unreached << ", best " << choice.certificate.gain_best);
  REQUIRE(choice.outcome == ViewChoice::Outcome::kComplete);
  REQUIRE(choice.certificate.random_samples >= 500);
  REQUIRE(choice.certificate.gain_best < options.gain_min);
  REQUIRE(choice.certificate.clusters == static_cast<int>(clusters.size()));
  REQUIRE(pocket_after_sweep < 0.5);
  REQUIRE(world.coverage(kPocketLow, kPocketHigh) > 0.85);
  REQUIRE(coverage.back() > 0.95);
}

TEST_CASE("one seed gives one choice, with one worker and with two", "[explore]") {
  SmallWorld world(room_with_wall());
  ViewChooser one(world.map.geometry(), world.sensor, 200, 1);
  ViewChooser two(world.map.geometry(), world.sensor, 200, 2);
  look_from_two_places(world);
  ExploreOptions options;
  options.seed = 7;
  const auto a = one.choose(world.context(), world.q, options, run_serially);
  const auto b = two.choose(world.context(), world.q, options, run_on_two);
  REQUIRE(a);
  REQUIRE(b);
  REQUIRE(a->outcome == ViewChoice::Outcome::kChosen);
  REQUIRE(a->target == b->target);
  REQUIRE(a->utility_per_s == b->utility_per_s);
  REQUIRE(a->path.waypoints.size() == b->path.waypoints.size());
  REQUIRE(a->gain.unknown == b->gain.unknown);
  REQUIRE(a->considered == b->considered);
  options.seed = 8;
  const auto c = one.choose(world.context(), world.q, options, run_serially);
  REQUIRE(c);
  REQUIRE_FALSE(c->target == a->target);
}

TEST_CASE("small steps from the best candidates find better views", "[explore]") {
  SmallWorld world(room_with_wall());
  look_from_two_places(world);
  double with = 0, without = 0;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    ViewChooser chooser(world.map.geometry(), world.sensor, 100, 1);
    ViewChooser stepping(world.map.geometry(), world.sensor, 100, 1);
    ExploreOptions options;
    options.seed = seed;
    options.refined = 0;
    const auto plain = chooser.choose(world.context(), world.q, options, run_serially);
    options.refined = 16;
    const auto refined = stepping.choose(world.context(), world.q, options, run_serially);
    REQUIRE(plain);
    REQUIRE(refined);
    REQUIRE(refined->outcome == ViewChoice::Outcome::kChosen);
    CHECK(world.entries_into_unknown(refined->path) == 0);
    with += refined->utility_per_s;
    without += plain->utility_per_s;
  }
  CHECK(with > 1.1 * without);
}

TEST_CASE("a view that only makes room for motion is taken when it does so quickly", "[explore]") {
  SmallWorld world(room_with_wall());
  look_from_two_places(world);
  ViewChooser chooser(world.map.geometry(), world.sensor, 320, 2);
  ExploreOptions options;
  options.again_min = options.again_few = 1;
  options.gain_min = 1'000'000;  // nothing tells enough: room is all that counts
  const auto rate = [&](const ViewChoice& choice) {
    const double s = choice.path.duration_s + options.timing.settle_s + options.timing.look_s;
    return (choice.gain.again - choice.gain.doubtful_again) / (options.timing.limits.body_speed_m_s * s);
  };
  options.again_per_m = 0;
  const auto any = chooser.choose(world.context(), world.q, options, run_on_two);
  REQUIRE(any);
  REQUIRE(any->outcome == ViewChoice::Outcome::kChosen);
  int quick = 0;
  for (const double share : {0.2, 0.9, 1.5, 100.0}) {
    options.again_per_m = share * rate(*any);
    const auto choice = chooser.choose(world.context(), world.q, options, run_on_two);
    REQUIRE(choice);
    if (choice->outcome != ViewChoice::Outcome::kChosen) continue;
    ++quick;
    CHECK(rate(*choice) >= options.again_per_m);
  }
  CHECK(quick >= 2);
  CHECK(quick < 4);
}

TEST_CASE("what was good and not chosen stands for the next choice", "[explore]") {
  SmallWorld world(room_with_wall());
  look_from_two_places(world);
  ViewChooser chooser(world.map.geometry(), world.sensor, 10, 1, 300);
  double remembering = 0, forgetting = 0;
  ExploreOptions options;
  options.refined = 0;
  options.certificate_samples = 300;
  for (options.step = 0; options.step < 12; ++options.step) {
    ViewChooser fresh(world.map.geometry(), world.sensor, 10, 1, 300);
    const auto one = chooser.choose(world.context(), world.q, options, run_serially);
    const auto other = fresh.choose(world.context(), world.q, options, run_serially);
    REQUIRE(one);
    REQUIRE(other);
    REQUIRE(one->outcome == ViewChoice::Outcome::kChosen);
    CHECK(world.entries_into_unknown(one->path) == 0);
    CHECK(one->utility_per_s >= other->utility_per_s);
    remembering += one->utility_per_s;
    forgetting += other->utility_per_s;
  }
  INFO(remembering << " and " << forgetting);
  CHECK(remembering > 1.01 * forgetting);
}

TEST_CASE("what was good before a look that was foreseen stands once the arm goes for the choice", "[explore]") {
  SmallWorld world(room_with_wall());
  look_from_two_places(world);
  ViewChooser going(world.map.geometry(), world.sensor, 10, 1, 300);
  ViewChooser staying(world.map.geometry(), world.sensor, 10, 1, 300);
  ExploreOptions options;
  options.refined = 0;
  options.certificate_samples = 300;
  options.after_look = true;
  const auto foreseen = going.choose(world.context(), world.q, options, run_serially);
  const auto same = staying.choose(world.context(), world.q, options, run_serially);
  REQUIRE(foreseen);
  REQUIRE(same);
  REQUIRE(foreseen->outcome == ViewChoice::Outcome::kChosen);
  going.adopt(foreseen->gain, going.gain().unknown(), options.gain_min);
  options.after_look = false;
  options.step = 1;
  const auto with = going.choose(world.context(), world.q, options, run_serially);
  const auto without = staying.choose(world.context(), world.q, options, run_serially);
  REQUIRE(with);
  REQUIRE(without);
  REQUIRE(without->outcome == ViewChoice::Outcome::kChosen);
  CHECK(with->considered > without->considered);  // each that stands is one more
  CHECK(with->utility_per_s >= without->utility_per_s);
}

TEST_CASE("an arm with no room to move says that nothing can be reached", "[explore]") {
  SmallWorld world(Truth::room());
  ViewChooser chooser(world.map.geometry(), world.sensor, 100, 1, 300);
  // Free is only what lies within the clearance and less than a voxel's width around the posture it stands in.
  world.space.zone_intact = false;
  const Capsules placed = place(world.body.capsules, forward(world.arm, world.q));
  for (std::size_t i = 0; i < world.free.size(); ++i) {
    const Eigen::Vector3d p = world.map.geometry().center_m(world.map.geometry().voxel_at(i));
    world.free[i] = std::any_of(placed.begin(), placed.end(), [&](const Capsule& c) {
      return segment_distance_m(p, p, c.a, c.b) < c.radius_m + world.clearance.voxels_m + 0.035;
    });
  }
  world.field.update(world.free);
  ExploreOptions options;
  options.certificate_samples = 300;
  const auto choice = chooser.choose(world.context(), world.q, options, run_serially);
  INFO((choice ? "" : describe(choice.error())));
  REQUIRE(choice);
  REQUIRE(choice->outcome == ViewChoice::Outcome::kNothingReachable);
}

TEST_CASE("an arm that does not stand free gets no view", "[explore]") {
  SmallWorld world(Truth::room());
  world.space.zone_intact = false;
  world.space.field = nullptr;
  ViewChooser chooser(world.map.geometry(), world.sensor, 20, 1, 20);
  ExploreOptions options;
  options.certificate_samples = 20;
  const auto choice = chooser.choose(world.context(), world.q, options, run_serially);
  REQUIRE_FALSE(choice);
  REQUIRE(choice.error().fault == Fault::kStartBlocked);
}

TEST_CASE("the view after a look that is still to come: another, and the choice before stands as it was", "[explore]") {
  SmallWorld world(room_with_wall());
  ViewChooser chooser(world.map.geometry(), world.sensor, 200, 1);
  ViewChooser alone(world.map.geometry(), world.sensor, 200, 1);
  look_from_two_places(world);
  ExploreOptions options;
  const auto first = chooser.choose(world.context(), world.q, options, run_serially);
  const auto same = alone.choose(world.context(), world.q, options, run_serially);
  REQUIRE(first);
  REQUIRE(same);
  REQUIRE(first->target == same->target);
  options.step = 1;
  options.after_look = true;
  const auto next = chooser.choose(world.context(), first->target, options, run_serially);
  REQUIRE(next);
  REQUIRE(next->outcome == ViewChoice::Outcome::kChosen);
  CHECK(next->path.waypoints.front() == first->target);
  CHECK(world.entries_into_unknown(next->path) == 0);
  // What the first look tells counts no more.
  GainWorker worker = chooser.gain().worker();
  const ViewGain before = chooser.gain().count(world.context(), next->target, worker);
  CHECK(next->gain.weight() <= before.weight());
  // A look is remembered as if nothing had been chosen meanwhile: one in vain, then the one that was chosen.
  chooser.remember_look(world.context(), first->target);
  alone.remember_look(world.context(), first->target);
  world.follow(first->path);
  chooser.remember_look(world.context(), world.q);
  alone.remember_look(world.context(), world.q);
  for (std::size_t i = 0; i < world.map.geometry().count(); ++i) {
    REQUIRE(chooser.gain().futile().count(i) == alone.gain().futile().count(i));
  }
  options.after_look = false;
  options.step = 2;
  const auto a = chooser.choose(world.context(), world.q, options, run_serially);
  const auto b = alone.choose(world.context(), world.q, options, run_serially);
  REQUIRE(a);
  REQUIRE(b);
  CHECK(a->target == b->target);
  CHECK(a->utility_per_s == b->utility_per_s);
}
