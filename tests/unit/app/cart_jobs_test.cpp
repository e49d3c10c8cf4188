#include "app/jobs/cart_jobs.hpp"

#include <catch2/catch.hpp>
#include <limits>
#include <memory>

#include "algorithms/mapping/octree_writer.hpp"
#include "algorithms/vision/camera_model.hpp"
#include "app/report/map_files.hpp"
#include "app/shell/event_codec.hpp"
#include "platform/core/random.hpp"
#include "platform/journal/archive.hpp"
#include "platform/memory/allocation_guard.hpp"
#include "tests/support/mock_color_camera.hpp"
#include "tests/support/mock_depth_camera.hpp"
#include "tests/support/sanitized_builds.hpp"
#include "tests/support/temporary_folder.hpp"

namespace firstlook {
namespace {

constexpr CameraIntrinsics kColor{640, 480, 525, 525, 319.5, 239.5};
const JointVector kStart{0, -1.57, 1.57, -1.57, -1.57, 0};  // the simulated cell's, rounded

/// The flange's camera looks at a board 0.7 m ahead of where the arm starts; the depth camera at a wall.
class Bench {
 public:
  explicit Bench(std::optional<StoredCalibration> stored = std::nullopt, const std::string& prior_map = "none",
                 const std::string& planes = "none")
      : color_(kColor), workers_(2) {
    config_.map.prior = prior_map;
    config_.map.planes = planes;
    color_.color = {10, 120, 230};
    color_.corners = [this](const hal::Frame& frame, int) {
      JointVector q = at_rad_;
      q[0] += swing_rad * static_cast<double>(frame.sequence % 7);
      return seen_from(q);
    };
    const Pose base_T_camera = forward(arm_, kStart).flange().pose() * flange_T_camera_;
    Pose camera_T_board = Pose::Identity();
    camera_T_board.translation() = Eigen::Vector3d(0, 0, 0.7) - board_.center();
    base_T_board_ = base_T_camera * camera_T_board;
    if (stored) config_.safe_zone = {1.0, 1.5};  // room to go for views
    auto bench =
        Workbench::make(config_, {kStart, Transform<Camera, Depth>(), std::move(stored)}, color_, depth_, workers_);
    REQUIRE(bench);
    bench_ = std::move(*bench);
    jobs_.emplace(*bench_);
  }

  struct Outcome {
    bool done = false;
    Fault failed = Fault::kInternal;
    std::uint64_t refused = 0;
    std::span<const std::byte> result;
  };
  /// Runs a job as the runner does: inside its heap allowance.
  template <typename Arguments>
  Outcome execute(JobKind kind, const Arguments& arguments, std::size_t heap_bytes = memory::kJobHeapBytes) {
    request_->kind = static_cast<std::uint16_t>(kind);
    request_->size = static_cast<std::uint32_t>(pack(arguments, std::span<std::byte>(request_->arguments)));
    Outcome outcome;
    std::size_t size = 0;
    {
      const memory::JobHeapScope heap(heap_bytes);
      size = jobs_->execute(*request_, result_);
      outcome.refused = heap.refused();
    }
    ByteReader reader(std::span<const std::byte>(result_).first(size));
    reader(outcome.done);
    if (!outcome.done) reader(outcome.failed);
    REQUIRE(reader.ok());
    outcome.result = std::span<const std::byte>(result_).subspan(1, size - 1);
    return outcome;
  }
  template <typename JobResult, typename Arguments>
  JobResult result_of(JobKind kind, const Arguments& arguments) {
    const Outcome outcome = execute(kind, arguments);
    REQUIRE(outcome.done);
    JobResult result;
    REQUIRE(unpack(outcome.result, result));
    return result;
  }

  /// A frame of either camera, taken now with the arm at `q`.
  PosedFrame frame(hal::FrameStream& camera, const JointVector& q) {
    at_rad_ = q;
    now_ = now_ + milliseconds(100);
    const auto newest = camera.poll(now_);
    REQUIRE(newest);
    return {*newest, q};
  }
  DetectArguments look(BoardLook purpose, const JointVector& q) {
    DetectArguments arguments;
    arguments.purpose = purpose;
    arguments.frames.push_back(frame(color_, q));
    return arguments;
  }
  IntegrateArguments depth_look(const JointVector& q) {
    IntegrateArguments arguments;
    arguments.frame = frame(depth_, q);
    arguments.now_s = now_.seconds();
    arguments.at_view = true;
    arguments.arm_rad = q;
    return arguments;
  }
  ColorArguments color_of(const PosedFrame& depth) { return {frame(color_, depth.at_rad), depth}; }
  [[nodiscard]] FromHere here(std::uint32_t step = 0) const { return {kStart, step, now_.seconds()}; }

  /// Takes views all around until the calibration can be solved.
  void take_views() {
    Random random(7);
    int taken = 0;
    for (int attempt = 0; attempt < 2000 && taken < 12; ++attempt) {
      JointVector q = kStart;
      for (int joint = 0; joint < 6; ++joint) q[joint] += random.uniform(-0.3, 0.3);
      if (seen_from(q)->corners_px.empty()) continue;
      if (result_of<DetectResult>(JobKind::kDetectBoard, look(BoardLook::kCollect, q)).found) ++taken;
    }
    REQUIRE(taken == 12);
  }
  void calibrate() {
    take_views();
    REQUIRE(result_of<SolveResult>(JobKind::kSolve, NoArguments{}).solved);
    REQUIRE(result_of<ValidateResult>(JobKind::kValidate, NoArguments{}).accepted);
  }
  /// Looks and goes where the verification wants to, until it has views enough. Returns how many views it took.
  int take_verification_views() {
    JointVector at = kStart;
    int views = result_of<DetectResult>(JobKind::kDetectBoard, look(BoardLook::kVerify, at)).found ? 1 : 0;
    for (std::uint32_t step = 0; step < 20; ++step) {
      const auto choice = result_of<VerificationViewResult>(JobKind::kNextVerificationView, FromHere{at, step, 0});
      if (choice.target_met || !choice.found) break;
      at = choice.path.back().target_rad;
      if (result_of<DetectResult>(JobKind::kDetectBoard, look(BoardLook::kVerify, at)).found) ++views;
    }
    return views;
  }
  double swing_rad = 0;  ///< of the base joint, from frame to frame
  DetectArguments look_at_three(BoardLook purpose, std::uint32_t looks) {
    DetectArguments arguments = look(purpose, kStart);
    for (int i = 0; i < 2; ++i) arguments.frames.push_back(frame(color_, kStart));
    arguments.looks = looks;
    return arguments;
  }
  [[nodiscard]] const Workbench& bench() const { return *bench_; }
  mock::MockDepthCamera& depth() { return depth_; }
  mock::MockColorCamera& color() { return color_; }
  CartJobs& jobs() { return *jobs_; }

 private:
  [[nodiscard]] std::optional<hal::CornerObservation> seen_from(const JointVector& q) const {
    const Pose base_T_camera = forward(arm_, q).flange().pose() * flange_T_camera_;
    const Pose camera_T_board = base_T_camera.inverse(Eigen::Isometry) * base_T_board_;
    Random noise(mix64(static_cast<std::uint64_t>(1e6 * (q[0] + 2 * q[3] + 3 * q[5] + 100))));
    hal::CornerObservation seen;
    for (int i = 0; i < board_.corners(); ++i) {
      const auto pixel = project(kColor, camera_T_board * board_.corner(i));
      if (!pixel || !in_image(kColor, *pixel, 10)) return hal::CornerObservation{};
      seen.corners_px.push_back({static_cast<float>(pixel->x() + 0.05 * noise.normal()),
                                 static_cast<float>(pixel->y() + 0.05 * noise.normal())});
    }
    return seen;
  }

  Config config_;
  ArmModel arm_ = *find_arm_model("ur5");
  BoardSpec board_{9, 6, 0.03};
  Pose flange_T_camera_ = Pose(Eigen::Translation3d(0, -0.07, 0.06));
  Pose base_T_board_ = Pose::Identity();
  JointVector at_rad_ = kStart;
  Instant now_{};
  mock::MockColorCamera color_;
  mock::MockDepthCamera depth_;
  WorkerPool workers_;
  std::unique_ptr<Workbench> bench_;
  std::optional<CartJobs> jobs_;
  std::unique_ptr<JobRequest> request_ = std::make_unique<JobRequest>();
  std::array<std::byte, kJobResultBytesMax> result_{};
};

/// What a good calibration of the bench would have left.
StoredCalibration stored_calibration() {
  StoredCalibration c;
  c.accepted = true;
  c.arm_model = "ur5";
  c.kinematics = kinematics_checksum(*find_arm_model("ur5"));
  c.flange_T_camera = Transform<Flange, Camera>(Pose(Eigen::Translation3d(0, -0.07, 0.06)));
  c.covariance = 1e-8 * Matrix6d::Identity();
  c.corner_sigma_px = 0.05;
  c.arm_sigma = {1e-4, 2e-4};
  c.intrinsics = kColor;
  c.solver = "park-martin";
  c.views = c.views_given = 16;
  return c;
}

/// Lets the 1st, 2nd, 3rd and then rarer and rarer allocation of the job fail, until it gets by without. Each time the
/// job fails with kOutOfMemory, or whoever allocated could do without; the process is there afterwards.
template <typename MakeArguments>
void fail_every_allocation(Bench& bench, JobKind kind, MakeArguments arguments) {
  int failures = 0;
  for (std::uint64_t nth = 1;; nth += 1 + nth * test::kTrialDivisor / 8) {
    const auto asked = arguments();
    memory::fail_job_allocation(nth);
    const Bench::Outcome outcome = bench.execute(kind, asked);
    memory::fail_job_allocation(0);
    INFO(name_of(kind) << ", allocation " << nth);
    if (outcome.refused == 0) {
      CHECK(outcome.done);
      break;
    }
    if (!outcome.done) {
      ++failures;
      CHECK(outcome.failed == Fault::kOutOfMemory);
    }
  }
  CHECK(bench.jobs().failed() >= static_cast<std::uint64_t>(failures));
}

}  // namespace

TEST_CASE("no failed allocation of a job before the calibration ends the process", "[jobs]") {
  Bench bench;
  fail_every_allocation(bench, JobKind::kLocateViews, [&] { return bench.here(); });
  fail_every_allocation(bench, JobKind::kIdentifyMotions, [&] { return bench.here(); });
  fail_every_allocation(bench, JobKind::kNextCalibrationView, [&] { return bench.here(); });
  fail_every_allocation(bench, JobKind::kPlan, [&] {
    PlanArguments plan;
    plan.from_rad = kStart;
    plan.to_rad = kStart;
    plan.to_rad[0] += 0.4;
    return plan;
  });
  fail_every_allocation(bench, JobKind::kDetectBoard, [&] { return bench.look(BoardLook::kLocate, kStart); });
}

TEST_CASE("no failed allocation of a calibration job ends the process", "[jobs]") {
  Bench bench;
  bench.take_views();
  fail_every_allocation(bench, JobKind::kNextCalibrationView, [&] { return bench.here(3); });
  fail_every_allocation(bench, JobKind::kNextCalibrationView, [&] {
    FromHere here = bench.here(4);
    here.after_look = true;
    return here;
  });
  fail_every_allocation(bench, JobKind::kSolve, [] { return NoArguments{}; });
  fail_every_allocation(bench, JobKind::kValidate, [] { return NoArguments{}; });
}

TEST_CASE("no failed allocation of a verification ends the process", "[jobs]") {
  Bench bench(stored_calibration());
  bench.take_verification_views();
  fail_every_allocation(bench, JobKind::kNextVerificationView, [&] { return bench.here(3); });
  fail_every_allocation(bench, JobKind::kVerifyCalibration, [] { return NoArguments{}; });
}

TEST_CASE("the right stored calibration is verified on a few views and gives the clearance", "[jobs]") {
  Bench bench(stored_calibration());
  const int views = bench.take_verification_views();
  CHECK(views >= 3);
  CHECK(views <= 5);
  const auto result = bench.result_of<VerifyResult>(JobKind::kVerifyCalibration, NoArguments{});
  for (const std::string& reason : bench.bench().hand_eye()->reasons) UNSCOPED_INFO(reason);
  CHECK(result.accepted);
  CHECK(result.chi2 < result.chi2_limit);
  CHECK(result.clearance_m > 0.05);
  const HandEyeResult& hand_eye = *bench.bench().hand_eye();
  CHECK(hand_eye.verdict == Verdict::kAccepted);
  CHECK(hand_eye.reasons.empty());
  CHECK(hand_eye.views == 16);  // of the solve that made it
  CHECK(hand_eye.holdout_rms_px == result.residual_rms_px);
  REQUIRE(bench.bench().verified());
  CHECK(bench.bench().verified()->verification->views.size() == static_cast<std::size_t>(views));
  CHECK(bench.bench().calibration_records().size() == static_cast<std::size_t>(views));
  // The board stands where it did: it can be looked at again at the end of the job.
  const auto check = bench.result_of<CheckBoardResult>(JobKind::kCheckBoard, bench.look(BoardLook::kConclude, kStart));
  CHECK(check.seen == 1);
  CHECK(check.moved == 0);
}

TEST_CASE("a picture that moves is no view, unless it never stands still", "[jobs]") {
  Bench bench;
  bench.swing_rad = 0.0005;  // 0.3 px or more
  auto seen = bench.result_of<DetectResult>(JobKind::kDetectBoard, bench.look_at_three(BoardLook::kCollect, 1));
  CHECK_FALSE(seen.still);
  CHECK_FALSE(seen.found);
  CHECK(seen.moved_px > 0.2);
  CHECK(bench.bench().calibration_records().empty());
  seen = bench.result_of<DetectResult>(JobKind::kDetectBoard, bench.look_at_three(BoardLook::kCollect, kLooksMax));
  CHECK_FALSE(seen.still);
  CHECK(seen.found);
  bench.swing_rad = 1e-5;  // the noise is another, the place the same
  seen = bench.result_of<DetectResult>(JobKind::kDetectBoard, bench.look_at_three(BoardLook::kCollect, 2));
  CHECK(seen.still);
  CHECK(seen.found);
  bench.swing_rad = 0.01;  // the frames do not even agree
  seen = bench.result_of<DetectResult>(JobKind::kDetectBoard, bench.look_at_three(BoardLook::kCollect, kLooksMax));
  CHECK_FALSE(seen.still);
  CHECK_FALSE(seen.found);
  const auto records = bench.bench().calibration_records();
  REQUIRE(records.size() == 2);
  CHECK_FALSE(records[0].settling->still);
  CHECK(records[0].settling->looks == static_cast<int>(kLooksMax));
  CHECK(records[1].settling->still);
  CHECK(records[1].settling->looks == 2);
  CHECK(records[1].settling->scatter_px == Approx(0.05).epsilon(0.2));
}

TEST_CASE("frames that the camera no longer holds say nothing of the board: another look", "[jobs]") {
  Bench bench;
  const auto forget = [&bench](const DetectArguments& look, std::initializer_list<std::size_t> which) {
    for (const std::size_t i : which) bench.color().lose(look.frames[i].frame.sequence);
  };
  auto look = bench.look_at_three(BoardLook::kCollect, 1);
  forget(look, {0, 1, 2});
  auto seen = bench.result_of<DetectResult>(JobKind::kDetectBoard, look);
  CHECK_FALSE(seen.found);
  CHECK_FALSE(seen.still);
  look = bench.look_at_three(BoardLook::kCollect, 2);
  forget(look, {0, 2});
  seen = bench.result_of<DetectResult>(JobKind::kDetectBoard, look);
  CHECK_FALSE(seen.found);
  CHECK_FALSE(seen.still);
  look = bench.look_at_three(BoardLook::kCollect, 3);
  forget(look, {0});  // most are there
  seen = bench.result_of<DetectResult>(JobKind::kDetectBoard, look);
  CHECK(seen.found);
  CHECK(seen.still);
}

TEST_CASE("a stored calibration of another mount is rejected, with figure and limit", "[jobs]") {
  StoredCalibration other = stored_calibration();
  Vector6d error = Vector6d::Zero();
  SECTION("5 mm") { error[1] = 0.005; }
  SECTION("1 degree") { error[3] = 0.01745; }
  SECTION("so wrong that the board is not where it says") { error[4] = 0.6; }
  other.flange_T_camera = Transform<Flange, Camera>(perturb(other.flange_T_camera.pose(), error));
  Bench bench(other);
  CHECK(bench.take_verification_views() >= 3);
  const auto result = bench.result_of<VerifyResult>(JobKind::kVerifyCalibration, NoArguments{});
  CHECK_FALSE(result.accepted);
  CHECK(result.chi2 > result.chi2_limit);
  CHECK(result.clearance_m == 0);
  CHECK_FALSE(bench.bench().clearance_terms());
  const HandEyeResult& hand_eye = *bench.bench().hand_eye();
  CHECK(hand_eye.verdict == Verdict::kRejected);
  REQUIRE_FALSE(hand_eye.reasons.empty());
  CHECK_THAT(hand_eye.reasons[0], Catch::Matchers::Contains("chi-square") && Catch::Matchers::Contains("allowed"));
  CHECK_FALSE(bench.bench().verified()->calibration.accepted);
}

TEST_CASE("a stored calibration that is too vague, or seen too little, is rejected", "[jobs]") {
  StoredCalibration vague = stored_calibration();
  SECTION("vague") {
    vague.covariance *= 1000;
    Bench bench(vague);
    bench.take_verification_views();
    CHECK_FALSE(bench.result_of<VerifyResult>(JobKind::kVerifyCalibration, NoArguments{}).accepted);
    CHECK_THAT(bench.bench().hand_eye()->reasons[0], Catch::Matchers::Contains("sigma of translation"));
  }
  SECTION("two views") {
    Bench bench(vague);
    JointVector turned = kStart;
    turned[5] += 0.4;
    for (const JointVector& q : {kStart, turned}) {
      CHECK(bench.result_of<DetectResult>(JobKind::kDetectBoard, bench.look(BoardLook::kVerify, q)).found);
    }
    CHECK_FALSE(bench.result_of<VerifyResult>(JobKind::kVerifyCalibration, NoArguments{}).accepted);
    CHECK_THAT(bench.bench().hand_eye()->reasons[0], Catch::Matchers::Contains("2 usable views"));
    CHECK_FALSE(bench.bench().verified()->verification);
    CHECK(bench.bench().calibration_records().size() == 2);
  }
}

TEST_CASE("no failed allocation of a mapping job ends the process", "[jobs]") {
  Bench bench;
  bench.calibrate();
  double wall_m = 1.2;
  fail_every_allocation(bench, JobKind::kIntegrate, [&] {
    bench.depth().wall_m = wall_m += 0.01;  // a picture that does not repeat itself
    return bench.depth_look(kStart);
  });
  fail_every_allocation(bench, JobKind::kNextSweepView, [&] { return bench.here(1); });
  fail_every_allocation(bench, JobKind::kNextView, [&] { return bench.here(2); });
  fail_every_allocation(bench, JobKind::kNextView, [&] {
    FromHere here = bench.here(3);
    here.after_look = true;
    return here;
  });
  fail_every_allocation(bench, JobKind::kCertifyPath, [&] {
    PlanArguments plan;
    plan.from_rad = plan.to_rad = kStart;
    plan.phase = MotionPhase::kMapping;
    return plan;
  });
  fail_every_allocation(bench, JobKind::kCheckBoard, [&] { return bench.look(BoardLook::kConclude, kStart); });
  fail_every_allocation(bench, JobKind::kSummarize, [] { return NoArguments{}; });
  fail_every_allocation(bench, JobKind::kForgetKnownFree, [] { return NoArguments{}; });
}

TEST_CASE("a path that was foreseen is not certified once nothing says what for", "[jobs]") {
  Bench bench;
  bench.calibrate();
  PlanArguments plan;
  plan.from_rad = plan.to_rad = kStart;
  plan.phase = MotionPhase::kMapping;
  CHECK(bench.result_of<PlanResult>(JobKind::kCertifyPath, plan).found);
  plan.foreseen = true;
  CHECK_FALSE(bench.result_of<PlanResult>(JobKind::kCertifyPath, plan).found);
}

TEST_CASE("jobs are counted and timed by their kind, failed ones too", "[jobs]") {
  Bench bench;
  bench.calibrate();
  const JobTimes& solve = bench.jobs().times(JobKind::kSolve);
  CHECK(solve.count == 1);
  CHECK(solve.total_s > 0);
  CHECK(solve.longest_s == solve.total_s);
  CHECK_FALSE(bench.execute(JobKind::kSolve, NoArguments{}, 4096).done);
  CHECK(solve.count == 2);
  CHECK(solve.longest_s < solve.total_s);
  CHECK(bench.jobs().times(JobKind::kDetectBoard).count >= 12);
  CHECK(bench.jobs().times(JobKind::kIntegrate).count == 0);
}

TEST_CASE("a job beyond its heap allowance fails with the memory's fault, and the next one is done", "[jobs]") {
  Bench bench;
  bench.take_views();
  const Bench::Outcome starved = bench.execute(JobKind::kSolve, NoArguments{}, 4096);
  CHECK(starved.refused > 0);
  REQUIRE_FALSE(starved.done);
  CHECK(starved.failed == Fault::kOutOfMemory);
  CHECK(bench.jobs().failed() == 1);
  CHECK(bench.result_of<SolveResult>(JobKind::kSolve, NoArguments{}).solved);
}

TEST_CASE("the machine hears of a failed job through the loop's queue", "[jobs]") {
  Bench bench;
  bench.take_views();
  VirtualClock clock;
  JobRunner runner(bench.jobs(), clock, JobMode::kVirtual, 4096);
  auto request = std::make_unique<JobRequest>();
  request->kind = static_cast<std::uint16_t>(JobKind::kSolve);
  request->number = 5;
  request->size = static_cast<std::uint32_t>(pack(NoArguments{}, std::span<std::byte>(request->arguments)));
  REQUIRE(runner.submit(*request, clock.now()));
  EventQueue queue;
  runner.collect(clock.now(), queue);
  REQUIRE_FALSE(queue.empty());
  const auto event = decode_event(queue.front().kind, queue.front().bytes());
  REQUIRE(event);
  const auto* const done = std::get_if<JobCompleted>(&*event);
  REQUIRE(done != nullptr);
  CHECK(done->number == 5);
  CHECK(done->failed == Fault::kOutOfMemory);
  CHECK(runner.counters().refused_allocations > 0);
}

TEST_CASE("a depth picture that repeats itself is frozen, one with hardly a return is not", "[jobs]") {
  Bench bench;
  bench.calibrate();
  const auto integrate = [&] {
    return bench.result_of<IntegrateResult>(JobKind::kIntegrate, bench.depth_look(kStart));
  };
  const IntegrateResult first = integrate();
  CHECK(first.used);
  CHECK_FALSE(first.frozen);
  const IntegrateResult again = integrate();
  CHECK(again.frozen);
  CHECK_FALSE(again.used);
  bench.depth().wall_m = 1.6;
  CHECK_FALSE(integrate().frozen);
  for (const std::size_t few : {0, 1, 6}) {
    bench.depth().paint = [few](const hal::Frame&, ImageView<std::uint16_t> image) {
      std::ranges::fill(image.pixels(), std::uint16_t{0});
      std::ranges::fill(image.pixels().first(few), std::uint16_t{1600});
    };
    CHECK_FALSE(integrate().frozen);
    CHECK_FALSE(integrate().frozen);
  }
}

TEST_CASE("the voxels that a look hit take the colours of the frame beside it", "[jobs][planes]") {
  Bench bench(std::nullopt, "none", "color,sensor");
  bench.calibrate();
  bench.depth().wall_m = 0.6;  // inside the map
  const MapPlanes& planes = bench.bench().planes();
  const auto colored = [&] {
    std::size_t count = 0;
    for (std::size_t i = 0; i < bench.bench().map().size(); ++i) {
      const auto color = planes.color->at(i);
      count += color ? 1 : 0;
      if (color) REQUIRE(*color == Rgb{10, 120, 230});
      if (color) REQUIRE(bench.bench().map().voxel_class(i) == VoxelClass::kOccupied);
    }
    return count;
  };
  const auto points = [&](const ColorArguments& arguments) {
    return bench.result_of<ColorResult>(JobKind::kColorLook, arguments).points;
  };
  const IntegrateArguments look = bench.depth_look(kStart);
  CHECK(points(bench.color_of(look.frame)) == 0);  // nothing was integrated yet
  REQUIRE(bench.result_of<IntegrateResult>(JobKind::kIntegrate, look).used);
  ColorArguments moved = bench.color_of(look.frame);
  moved.color.at_rad[0] += 0.01;
  CHECK(points(moved) == 0);
  ColorArguments other = bench.color_of(look.frame);
  other.depth.frame.sequence += 1;
  CHECK(points(other) == 0);
  CHECK(colored() == 0);
  CHECK(bench.bench().looks_colored() == 0);
  CHECK(points(bench.color_of(look.frame)) > 100);
  CHECK(colored() > 3);
  CHECK(bench.bench().looks_colored() == 1);

  const VoxelMap& map = bench.bench().map();
  for (std::size_t i = 0; i < map.size(); ++i)
    REQUIRE(planes.sensor->at(i) == (map.voxel_class(i) == VoxelClass::kUnknown ? 0 : 1));
}

TEST_CASE("colours are asked of a camera that has some, and take their memory at boot", "[jobs][planes]") {
  mock::MockColorCamera color(kColor);
  mock::MockDepthCamera depth;
  WorkerPool workers(1);
  Config config;
  const CellFacts facts{kStart, {}, std::nullopt};
  const auto voxel_bytes = [&] {
    memory::reset_accounts();
    const auto bench = Workbench::make(config, facts, color, depth, workers);
    REQUIRE(bench);
    return memory::accounted_bytes(memory::Pool::kVoxelPlanes);
  };
  const std::size_t without = voxel_bytes();
  const std::size_t voxels = 60 * 60 * 36;
  config.map.planes = "label,sensor";
  CHECK(voxel_bytes() == without + 5 * voxels);
  config.map.planes = "color";
  const auto refused = Workbench::make(config, facts, color, depth, workers);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().fault == Fault::kConfigBadValue);
  CHECK(refused.error().detail() == "map.planes: color: the colour camera delivers grey values only");
  color.color = {1, 2, 3};
  CHECK(voxel_bytes() == without + 16 * voxels);

  // A finer map that just fits does not together with planes.
  config.map.fine_resolution_m = 0.009;
  config.map.fine_low_m = config.map.low_m;
  config.map.fine_high_m = config.map.high_m;
  config.map.planes = "none";
  CHECK(voxel_bytes() > without);
  config.map.planes = "color,label,sensor";
  const auto full = Workbench::make(config, facts, color, depth, workers);
  REQUIRE_FALSE(full);
  CHECK(full.error().fault == Fault::kMapTooLarge);
  const std::string_view why = full.error().detail();
  CHECK(why.find("0.05 m with map.planes and the finer map need ") != std::string_view::npos);
  CHECK(why.ends_with(" MiB, the budget holds 24.0 MiB"));
  memory::reset_accounts();
}

TEST_CASE("broken frames and frames of an uncertain pose change nothing and are counted by kind", "[jobs][safety]") {
  Bench bench;
  bench.calibrate();
  double wall_m = 1.2;
  const auto integrate = [&](IntegrateArguments arguments) {
    bench.depth().wall_m = wall_m += 0.01;
    return bench.result_of<IntegrateResult>(JobKind::kIntegrate, arguments).used;
  };
  REQUIRE(integrate(bench.depth_look(kStart)));
  const VoxelCounts before = bench.bench().map().counts();
  const auto refused = [&](FrameFlaw flaw) { return bench.bench().frames_refused()[static_cast<std::size_t>(flaw)]; };

  IntegrateArguments nowhere = bench.depth_look(kStart);
  nowhere.frame.at_rad[2] = std::numeric_limits<double>::quiet_NaN();
  CHECK_FALSE(integrate(nowhere));
  CHECK(refused(FrameFlaw::kBadPose) == 1);

  IntegrateArguments early = bench.depth_look(kStart);
  early.frame.frame.stamp = Instant{} + milliseconds(1);
  CHECK_FALSE(integrate(early));
  CHECK(refused(FrameFlaw::kStampBackwards) == 1);

  IntegrateArguments gone = bench.depth_look(kStart);
  gone.frame.frame.sequence += 5;
  CHECK_FALSE(integrate(gone));
  CHECK(refused(FrameFlaw::kUnreadable) == 1);

  IntegrateArguments blurred = bench.depth_look(kStart);
  blurred.frame.velocity_rad_s = JointVector{0.3, 0, 0, 0, 0, 0};
  blurred.frame.reports_apart_s = 0.3;  // reports were lost
  CHECK_FALSE(integrate(blurred));
  CHECK(refused(FrameFlaw::kPoseUncertain) == 1);

  for (const double units_per_m : {1.0, 1e6}) {
    bench.depth().stated_units_per_m = units_per_m;
    CHECK_FALSE(integrate(bench.depth_look(kStart)));
  }
  CHECK(refused(FrameFlaw::kWrongScale) == 2);
  bench.depth().stated_units_per_m = 1000;

  CHECK(bench.bench().map().counts() == before);
  CHECK(bench.bench().frames_integrated() == 1);
  bench.depth().paint = [](const hal::Frame&, ImageView<std::uint16_t> image) {
    std::ranges::fill(image.pixels(), std::uint16_t{65535});
  };
  CHECK(integrate(bench.depth_look(kStart)));
  CHECK(bench.bench().map().counts() == before);  // infinity clears nothing
  CHECK(bench.bench().infinite_pixels() == 64 * 48);
  bench.depth().paint = nullptr;
  blurred = bench.depth_look(kStart);
  blurred.frame.velocity_rad_s = JointVector{0.3, 0, 0, 0, 0, 0};
  blurred.frame.reports_apart_s = 0.008;
  CHECK(integrate(blurred));
}

TEST_CASE("a prior map makes nothing known and changes no class", "[jobs]") {
  const test::TemporaryFolder folder("firstlook-prior");
  const Config config;
  const GridGeometry grid = GridGeometry::covering(Eigen::Vector3d(config.map.low_m.data()),
                                                   Eigen::Vector3d(config.map.high_m.data()), config.map.resolution_m);
  VoxelMap prior(grid, VoxelMap::Planes::kLogOddsOnly);
  for (std::size_t i = 0; i < prior.size(); ++i)
    prior.set(i, i % 3 == 0 ? VoxelClass::kOccupied : VoxelClass::kFree, 0);
  const std::string file = (folder.path() / "map.ot").string();
  REQUIRE(write_streamed(file, [&](ByteSink sink) { write_ot(prior, kOctreeDepth, sink); }));

  struct Known {
    std::vector<std::int8_t> log_odds;
    std::vector<std::uint8_t> free_before, free_after;
  };
  const auto work = [](Bench& bench) {
    const VoxelMap& map = bench.bench().map();
    Known known{{}, std::vector<std::uint8_t>(map.size()), std::vector<std::uint8_t>(map.size())};
    bench.calibrate();
    CHECK(map.counts().unknown == map.size());
    map.free_mask(bench.bench().last_stamp_s(), 600, known.free_before);
    REQUIRE(bench.result_of<IntegrateResult>(JobKind::kIntegrate, bench.depth_look(kStart)).used);
    map.free_mask(bench.bench().last_stamp_s(), 600, known.free_after);
    known.log_odds.assign(map.log_odds().begin(), map.log_odds().end());
    return known;
  };
  Known without;
  {
    Bench bench;
    without = work(bench);
    CHECK_FALSE(bench.bench().change_since_prior());
  }
  Bench bench(std::nullopt, file);
  const Known with = work(bench);
  CHECK(with.free_before == without.free_before);
  CHECK(with.free_after == without.free_after);
  CHECK(with.log_odds == without.log_odds);
  const MapChange change = bench.bench().change_since_prior().value();
  const VoxelCounts zone = bench.bench().zone_counts();
  CHECK(change.unseen_occupied + change.unseen_free == zone.unknown);
  CHECK(change.gone + change.still_free == zone.free);
  CHECK(change.newly_occupied + change.still_occupied == zone.occupied);
  CHECK(change.gone > 0);
}

}  // namespace firstlook
