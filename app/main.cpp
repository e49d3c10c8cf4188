/// firstlook: the only file that names concrete devices.
#include <algorithm>
#include <cctype>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <cstring>
#include <exception>
#include <filesystem>
#include <string>
#include <system_error>

#include "app/cli/cli.hpp"
#include "app/config/arm_file.hpp"
#include "app/config/board_config.hpp"
#include "app/machine/state_table.hpp"
#include "app/report/result_json.hpp"
#include "app/report/run_files.hpp"
#include "app/shell/calibration_recording.hpp"
#include "app/shell/cart.hpp"
#include "app/shell/job_settings.hpp"
#include "app/shell/replay.hpp"
#include "hal/sim/faults.hpp"
#include "hal/sim/simulated_cell.hpp"
#include "hal/sim/ur_controller/tcp_service.hpp"
#include "platform/linux/files.hpp"
#include "platform/linux/process.hpp"
#include "platform/linux/terminal.hpp"
#include "platform/memory/allocation_guard.hpp"

namespace firstlook {
namespace {

enum ExitCode { kDone = 0, kUsage = 2, kData = 3, kDevice = 4, kRejected = 5, kStopped = 6, kInternal = 70 };

int exit_code_of(const Error& error) {
  switch (error.fault) {
    case Fault::kUsage:
      return kUsage;
    case Fault::kDeviceMissing:
      return kDevice;
    case Fault::kInternal:
      return kInternal;
    default:
      return kData;
  }
}

int exit_code_of(const Ending& ending) {
  switch (ending.outcome) {
    case Outcome::kDone:
      return kDone;
    case Outcome::kCalibrationRejected:
      return kRejected;
    case Outcome::kSafelyStopped:
      return kStopped;
    case Outcome::kFaulted:
      return ending.fault == Fault::kDeviceMissing ? kDevice : kInternal;
  }
  return kInternal;
}

int fail(const Error& error) {
  std::fprintf(stderr, "firstlook: %s\n", describe(error).c_str());
  return exit_code_of(error);
}

/// What the program holds for free, as the grader of the simulated cell asks for it.
class KnownFree final : public sim::KnownFreeView {
 public:
  explicit KnownFree(const PublishedSpace& space) : space_(space) {}
  [[nodiscard]] const GridGeometry& geometry() const override { return space_.geometry(); }
  [[nodiscard]] bool free_for_motion(std::size_t voxel) const override { return space_.free_for_motion(voxel); }
  [[nodiscard]] bool zone_revoked(std::size_t voxel) const override { return space_.zone_revoked(voxel); }
  [[nodiscard]] bool known(std::size_t voxel) const override { return space_.known(voxel); }
  [[nodiscard]] std::uint32_t revision() const override { return space_.revision(); }

 private:
  const PublishedSpace& space_;
};

/// The arm of a file, and in words what was taken from it.
Result<ArmModel> read_arm(const std::string& path, const Config::Arm& config, Narrator& narrator) {
  const auto read = read_arm_file(path, arm_file_options(config));
  if (!read) return std::unexpected(read.error());
  narrator.line("arm       " + read->summary);
  return read->arm;
}

/// The configuration of a simulated cell: what its integrator would have typed in.
void describe_cell(const sim::CellDescription& cell, Config& config) {
  if (cell.arm_file.empty()) config.arm.model = cell.arm.name.view();
  config.arm.file = cell.arm_file.empty() ? "none" : cell.arm_file;
  config.safe_zone = {cell.safe_zone.radius_m, cell.safe_zone.height_m};
  config.cart.top_m = cell.cart_top_m;
  set_targets(cell.boards, config);
  config.calibration.touch_tip_m = {cell.flange_p_tip_m.x(), cell.flange_p_tip_m.y(), cell.flange_p_tip_m.z()};
  for (const sim::KeepOut& box : cell.keep_out) {
    config.keep_out.push_back(
        {{box.low_m.x(), box.low_m.y(), box.low_m.z()}, {box.high_m.x(), box.high_m.y(), box.high_m.z()}});
  }
  if (cell.camera_envelope_m > 0) config.camera_envelope_radius_m = cell.camera_envelope_m;
  if (cell.map) {
    config.map.low_m = {cell.map->low_m.x(), cell.map->low_m.y(), cell.map->low_m.z()};
    config.map.high_m = {cell.map->high_m.x(), cell.map->high_m.y(), cell.map->high_m.z()};
  }
  if (!config.parking_rad) config.parking_rad = cell.start_rad;
}

/// Pictures of a part that the cell's description names, with what the grader says of it.
void add_part_pictures(const sim::RegionFigure& region, double known_after_sweep, const Cart& cart, RunRecord& record) {
  const auto known = [](double share) { return fmt::format(": {:.0f} % of what can be observed known", 100 * share); };
  std::string name = region.name;
  std::ranges::replace(name, '_', ' ');
  if (!name.empty()) name[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(name[0])));
  for (MapPicture& picture : cart.pictures_of_part({name, region.low_m, region.high_m}, known(known_after_sweep),
                                                   known(region.known_fraction))) {
    record.map_pictures.push_back(std::move(picture));
  }
}

/// What mapping had taken until a moment of the job; empty: that moment never came.
std::optional<TruthRecord::Way> way_to(const std::optional<double>& time_s, const RunRecord& record) {
  const auto sweep = std::ranges::find(record.phases, "Sweep", &PhaseRecord::name);
  if (!time_s || !record.mapping || sweep == record.phases.end()) return std::nullopt;
  const auto views = std::ranges::count_if(record.mapping->views, [&](const MappingViewRecord& view) {
    return view.phase != "end" && view.time_s <= *time_s;
  });
  return TruthRecord::Way{*time_s - sweep->start_s, static_cast<int>(views)};
}

/// Grades the finished job against the truth of the simulated cell.
void grade(sim::Grader& grader, const Cart& cart, const Config& config, RunRecord& record) {
  const Workbench& bench = cart.bench();
  sim::FinalClaims claims;
  if (bench.hand_eye()) {
    claims.flange_T_camera = bench.hand_eye()->flange_T_camera;
    claims.covariance = bench.hand_eye()->covariance;
    claims.camera_T_depth = bench.alignment().depth_camera.mount.camera_T_depth;
    claims.color_offset_s = bench.alignment().color_stamps.offset_s;
    claims.depth_offset_s = bench.alignment().depth_stamps.offset_s;
  }
  if (bench.mapped()) {
    claims.map = &bench.map();
    claims.reach_zone = bench.zone();
  }
  claims.now_s = bench.last_stamp_s();
  claims.free_max_age_s = config.map.free_max_age_s;
  if (bench.clearance_terms()) claims.observable.clearance = bench.clearance_terms()->clearance();
  claims.observable.sensor_range_min_m = config.depth.range_min_m;
  claims.observable.sensor_range_max_m = config.depth.range_max_m;
  claims.observable.sensor_range_trusted_m = config.depth.range_trusted_m;
  claims.observable.zone_floor_m = config.map.low_m[2];
  const sim::TruthFigures figures = grader.grade(claims);
  TruthRecord& truth = record.truth.emplace();
  truth.hand_eye_error_mm = figures.hand_eye_error_mm;
  truth.hand_eye_error_mrad = figures.hand_eye_error_mrad;
  truth.hand_eye_mahalanobis2 = figures.hand_eye_mahalanobis2;
  truth.depth_camera_error_mm = figures.depth_camera_error_mm;
  truth.depth_camera_error_mrad = figures.depth_camera_error_mrad;
  truth.color_stamps_error_s = figures.color_stamps_error_s;
  truth.depth_stamps_error_s = figures.depth_stamps_error_s;
  truth.contacts = figures.contacts;
  truth.unknown_entries = figures.unknown_entries;
  truth.coverage_of_observable = figures.coverage_of_observable;
  truth.to_95 = way_to(figures.known_95_s, record);
  truth.to_99 = way_to(figures.known_99_s, record);
  truth.false_free_voxels = figures.false_free_voxels;
  truth.false_occupied_fraction = figures.false_occupied_fraction;
  if (claims.map == nullptr) return;
  const VoxelMap swept = bench.map_after_sweep();
  claims.map = &swept;
  const auto after_sweep = grader.regions(claims);
  for (std::size_t i = 0; i < figures.regions.size() && i < after_sweep.size(); ++i) {
    const sim::RegionFigure& region = figures.regions[i];
    truth.regions.push_back({region.name, region.observable, after_sweep[i].known_fraction, region.known_fraction});
    add_part_pictures(region, after_sweep[i].known_fraction, cart, record);
  }
}

void narrate_alignment(const AlignmentRecord& alignment, Narrator& narrator) {
  const DepthToColor& depth = *alignment.depth_camera.estimate;
  const Vector7d sigma = alignment.depth_camera.mount.covariance.diagonal().cwiseSqrt();
  std::string line =
      fmt::format("sensors   depth camera {:.2f} ± {:.2f} mm, {:.2f} ± {:.2f} mrad from where it was stated",
                  1e3 * depth.moved.head<3>().norm(), 1e3 * sigma.head<3>().maxCoeff(),
                  1e3 * depth.moved.tail<3>().norm(), 1e3 * sigma.segment<3>(3).maxCoeff());
  const auto add = [&line](std::string_view camera, const StampRecord& stamps) {
    if (!stamps.estimate) return;
    line += fmt::format("; {} stamps {:+.2f} ± {:.2f} ms", camera, 1e3 * stamps.offset_s, 1e3 * stamps.sigma_s);
  };
  add("colour", alignment.color_stamps);
  add("depth", alignment.depth_stamps);
  narrator.line(line);
  if (depth.belief.contradicted()) {
    narrator.line(
        fmt::format("warning   what is stated of the depth camera is wrong: chi-square {:.1f}, allowed {:.1f}",
                    depth.belief.chi2, depth.belief.chi2_limit));
  }
}

void narrate_result(const RunRecord& record, Narrator& narrator) {
  narrator.clear_progress();
  narrator.line(fmt::format("{}: {}", name_of(record.outcome), record.reason));
  if (!record.remedy.empty()) narrator.line("to do     " + record.remedy);
  if (record.hand_eye) {
    const Eigen::Vector3d t = 1000 * record.hand_eye->flange_T_camera.translation();
    const Eigen::Vector3d s = 1000 * record.hand_eye->sigma_translation_m;
    narrator.line(fmt::format("hand-eye  x {:.2f} ± {:.2f}  y {:.2f} ± {:.2f}  z {:.2f} ± {:.2f} mm {}from {} views",
                              t.x(), s.x(), t.y(), s.y(), t.z(), s.z(), record.verified ? "as stored, " : "",
                              record.hand_eye->views));
    if (record.verified && record.verified->verification) {
      const Verification& v = *record.verified->verification;
      narrator.line(fmt::format("verified  on {} views: chi-square {:.1f}, allowed {:.1f}; {:.2f} px, {:.2f} mm RMS",
                                v.views.size(), v.chi2, v.chi2_limit, v.residual_rms_px, v.residual_rms_m * 1e3));
    }
    if (const auto& touched = record.hand_eye->touch_test) {
      narrator.line(fmt::format("touched   camera off by {:.2f} ± {:.2f} mm, {:.2f} ± {:.2f} mrad by {} of {} touches",
                                touched->mean.head<3>().norm() * 1e3, touched->mean_sigma.head<3>().norm() * 1e3,
                                touched->mean.tail<3>().norm() * 1e3, touched->mean_sigma.tail<3>().norm() * 1e3,
                                touched->board.used, touched->board.fits.size()));
    }
    if (record.alignment && record.alignment->depth_camera.estimate) narrate_alignment(*record.alignment, narrator);
    for (const std::string& reason : record.hand_eye->reasons) narrator.line("rejected  " + reason);
  }
  if (record.mapping) {
    const VoxelCounts& v = record.mapping->voxels;
    narrator.line(fmt::format("map       {} free, {} occupied, {} unknown voxels of {} m in reach after {} views",
                              v.free, v.occupied, v.unknown, record.mapping->resolution_m,
                              record.mapping->views.size()));
  }
  if (record.truth) {
    const TruthRecord& t = *record.truth;
    std::string line = "truth     ";
    if (t.hand_eye_error_mm && t.hand_eye_error_mrad) {
      line += fmt::format("hand-eye off by {:.2f} mm, {:.2f} mrad; ", *t.hand_eye_error_mm, *t.hand_eye_error_mrad);
    }
    line += fmt::format("{} contacts, {} entries into unknown space", t.contacts, t.unknown_entries);
    if (record.mapping && t.coverage_of_observable) {
      line += fmt::format("; {:.1f} % of the observable voxels known", 100 * *t.coverage_of_observable);
    }
    narrator.line(line);
  }
}

/// The stored calibration for the scopes that verify one.
Result<std::optional<StoredCalibration>> stored_calibration(RunScope scope, const Config& config) {
  if (scope != RunScope::kMap && scope != RunScope::kVerify) return std::optional<StoredCalibration>();
  if (config.calibration.stored == "none") {
    return failure(Fault::kUsage,
                   "--only {} needs a stored calibration: --calibration FILE, the hand_eye.yaml of a run (`firstlook "
                   "run --only calibrate --out DIR` makes one), or calibration.stored in the configuration",
                   name_of(scope));
  }
  auto read = read_hand_eye(config.calibration.stored);
  if (!read) return std::unexpected(read.error());
  return std::optional(*read);
}

int run_job(const RunCommand& command) {
  auto loaded = load_config(command.sources);
  if (!loaded) return fail(loaded.error());
  Config config = loaded->config;
  Narrator narrator;
  if (!command.cell_given && loaded->file.empty()) {
    narrator.line(fmt::format("no configuration: running in the simulated cell {}", config.cell));
  } else {
    narrator.line(fmt::format("running in the simulated cell {}", config.cell));
  }
  const auto stored = stored_calibration(command.scope, config);
  if (!stored) return fail(stored.error());
  const std::string folder =
      command.out.empty() ? fmt::format("runs/{}-{}", utc_date_for_name(), config.seed) : command.out;
  if (const Status fresh = check_run_folder(folder); !fresh) return fail(fresh.error());

  std::vector<NamedTarget> boards;  // load_config has refused what is no board
  if (names_boards(config)) boards = targets_of(config).value();
  const sim::ArmChoice arm = {config.arm.file == "none" ? "" : config.arm.file,
                              [&](const std::string& path) { return read_arm(path, config.arm, narrator); }};
  auto cell = sim::make_simulated_cell({config.cell, static_cast<std::uint64_t>(config.seed), command.fast_sensor,
                                        command.faults, config.workers, boards, config.depth.sensor, arm});
  if (!cell) return fail(cell.error());
  sim::SimulatedCell& world = **cell;
  describe_cell(world.description(), config);

  if (const Status standing = memory::account_standing_rows(); !standing) return fail(standing.error());
  const CartDevices devices{world.arm(), world.color(), world.depth(), world.pendant(), world.panel()};
  const CellFacts facts{world.description().start_rad, world.description().camera_T_depth, *stored,
                        world.description().arm};
  CartOptions options;
  options.scope = command.scope;
  options.real_time = command.real_time;
  options.journal_path = folder + "/journal.flj";
  std::int64_t boot_heap_bytes = 0;
  auto cart = [&] {
    const memory::JobHeapScope boot(memory::kHeapUncapped);
    auto made = Cart::make(config, options, facts, devices, narrator);
    boot_heap_bytes = boot.outstanding_bytes();
    return made;
  }();
  if (!cart) return fail(cart.error());

  const KnownFree known_free((*cart)->published());
  world.grader().watch(&known_free);
  catch_stop_signals();
  const Status ran = (*cart)->run();
  if (!ran) std::fprintf(stderr, "firstlook: %s\n", describe(ran.error()).c_str());

  RunRecord record = (*cart)->record();
  narrator.line("grading against the simulated cell's truth");
  grade(world.grader(), **cart, config, record);
  world.grader().watch(nullptr);
  record.wall.boot_heap_bytes = static_cast<std::uint64_t>(std::max<std::int64_t>(0, boot_heap_bytes));
  record.provenance.sensor = command.fast_sensor ? "fast" : "full";
  record.wall.folder = folder;
  narrate_result(record, narrator);
  if (command.record) {
    if (const Status written = write_calibration_recording(folder + "/dataset", record, config); !written) {
      return fail(written.error());
    }
  }
  if (const Status written = write_run_files(folder, record, (*cart)->map_files()); !written) {
    return fail(written.error());
  }
  narrator.line(fmt::format("report    {}/report.html", folder));
  if (command.json) std::printf("%s", result_json(record).c_str());
  return ran ? exit_code_of((*cart)->ending()) : exit_code_of(ran.error());
}

/// The faults are the simulated cell's: what it would refuse in every cell is refused once, before the first.
int run_campaign_of(const CampaignCommandOptions& options) {
  if (const auto faults = sim::parse_faults(options.faults); !faults) return fail(faults.error());
  return run_campaign_command(options);
}

/// HOST or HOST:PORT; without one the port of the External Control URCap.
Result<sim::ur::ExternalControl> external_control_of(const std::string& text) {
  const std::size_t colon = text.rfind(':');
  int port = 50002;
  if (colon != std::string::npos) {
    const auto [end, error] = std::from_chars(text.data() + colon + 1, text.data() + text.size(), port);
    if (error != std::errc{} || end != text.data() + text.size() || port < 1 || port > 65535) {
      return failure(Fault::kUsage, "--external-control {}: no port after the colon", text);
    }
  }
  return sim::ur::ExternalControl{text.substr(0, colon), static_cast<std::uint16_t>(port)};
}

int run_ur_sim(const UrSimCommand& command) {
  const auto identity = sim::ur::identify_controller(command.model, command.seed, command.serial);
  if (!identity) return fail(identity.error());
  sim::ur::SimulatedUrOptions options;
  options.running = command.running;
  for (const std::string& path : command.programs) {
    const Result<std::string> script = read_text_file(path, sim::ur::kScriptBytesMax);
    if (!script) return fail(script.error());
    options.programs.push_back({std::filesystem::path(path).stem().string() + ".urp", *script, {}});
  }
  if (!command.external_control.empty()) {
    const auto external = external_control_of(command.external_control);
    if (!external) return fail(external.error());
    options.programs.push_back({"external_control.urp", "", *external});
  }
  sim::ur::SimulatedUr robot(*identity, options);
  catch_stop_signals();
  const Status served = sim::ur::serve_on_tcp(robot, {command.host, command.port_offset});
  if (served) return kDone;
  std::fprintf(
      stderr,
      "firstlook: E%d %s\n      Give --host an address of this computer; a port that is taken: end the program "
      "that has it, or choose another --port-offset. Ports below 1024 need root.\n",
      static_cast<int>(served.error().fault), std::string(served.error().detail()).c_str());
  return exit_code_of(served.error());
}

/// Data that nobody received must not look like success: a full disk shows itself only here.
bool flush_stdout() {
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return true;
  std::fprintf(stderr, "firstlook: E%d cannot write to stdout: %s\n", static_cast<int>(Fault::kDiskWrite),
               std::strerror(errno));
  return false;
}

struct Dispatch {
  int operator()(const RunCommand& c) const { return run_job(c); }
  int operator()(const CalibrateCommandOptions& c) const { return run_calibrate_command(c); }
  int operator()(const MapCommandOptions& c) const { return run_map_command(c); }
  int operator()(const ExportCommandOptions& c) const { return run_export_command(c); }
  int operator()(const BoardCommandOptions& c) const { return run_board_command(c); }
  int operator()(const CampaignCommandOptions& c) const { return run_campaign_of(c); }
  int operator()(const UrSimCommand& c) const { return run_ur_sim(c); }
  int operator()(const ReplayCommand& c) const { return run_replay_command(c.journal); }
  int operator()(const StatesCommand&) const {
    std::fputs(state_diagram().c_str(), stdout);
    return kDone;
  }
  int operator()(const ExplainCommand& c) const { return run_explain_command(c.code); }
  int operator()(const ConfigCommandOptions& c) const { return run_config_command(c); }
};

/// Runs a command. Exceptions end here, with the exit code of what they mean: fmt throws std::system_error when stdout
/// takes nothing more; whatever else comes so far is a fault of the program.
int run(const Command& command) {
  try {
    const int code = std::visit(Dispatch{}, command);
    return flush_stdout() ? code : kData;
  } catch (const std::system_error& refused) {
    std::fprintf(stderr, "firstlook: E%d cannot write: %s\n", static_cast<int>(Fault::kDiskWrite), refused.what());
    return kData;
  } catch (const std::exception& unexpected) {
    std::fprintf(stderr, "firstlook: E%d internal fault: %s\n", static_cast<int>(Fault::kInternal), unexpected.what());
    return kInternal;
  }
}

}  // namespace
}  // namespace firstlook

int main(int argc, char** argv) {
  const auto parsed = firstlook::parse_command_line(argc, argv);
  if (!parsed.command) return parsed.exit_code;
  return firstlook::run(*parsed.command);
}
