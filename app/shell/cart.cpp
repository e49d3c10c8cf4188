#include "app/shell/cart.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "algorithms/mapping/moveit_scene.hpp"
#include "algorithms/mapping/octree_writer.hpp"
#include "algorithms/mapping/ply_writer.hpp"
#include "app/cli/small_commands.hpp"
#include "app/config/load_config.hpp"
#include "app/report/checkpoint.hpp"
#include "app/report/color_picture.hpp"
#include "app/report/done_text.hpp"
#include "app/report/object_picture.hpp"
#include "app/shell/event_codec.hpp"
#include "app/shell/event_worth.hpp"
#include "app/shell/job_settings.hpp"
#include "platform/linux/files.hpp"
#include "platform/linux/process.hpp"
#include "platform/linux/wakeup.hpp"
#include "platform/memory/allocation_guard.hpp"

namespace firstlook {
namespace {

constexpr double kEndingWithin_s = 120;  // for the report's files; a slow disk takes some seconds

/// Phases that result.json names: the outermost states, those within Running, and the parts of Calibrate and Conclude
/// instead of these two. Explore stays whole: its parts last for seconds and come back for every view.
bool is_phase(StateId state) {
  const auto has_phases = [](StateId s) {
    return s == StateId::kRunning || s == StateId::kCalibrate || s == StateId::kConclude;
  };
  const StateId parent = state_row(state).parent;
  return !has_phases(state) && (parent == StateId::kNone || has_phases(parent));
}

/// Which link carries the camera, as far as the joints told it, what views from there cannot tell, and what would.
std::string camera_link_text(const Ending& ending) {
  const int low = ending.camera_link_low, high = ending.camera_link_high;
  std::string text = fmt::format(": it is on link {}", low);
  if (high > low) text += fmt::format(" to {}", high);
  if (low == 1) {
    text +=
        "; on link 1 joint 1 alone moves it, and views about one axis leave its place along that axis and its turn "
        "about it open: a board whose place in the base is known, or a mount beyond joint 2, would tell them";
  }
  if (high > 1) {
    text +=
        fmt::format("; on link {} joints 1 to {} move it about two axes or more, so that views could tell all of it",
                    std::max(low, 2), std::max(low, 2));
  }
  return text + "; only a camera on the last link is calibrated so far: mount it on the flange";
}

std::string reason_text(const RunRecord& record, const Ending& ending, std::string_view blocked_by) {
  if (!ending.has_fault) return done_text(record);
  const FaultRow& row = fault_row(ending.fault);
  std::string where = ending.camera_link_low > 0 ? camera_link_text(ending) : std::string();
  if (ending.fault == Fault::kStartBlocked && !blocked_by.empty()) where += fmt::format("; {}", blocked_by);
  return fmt::format("E{} {}{}", static_cast<int>(ending.fault), row.text, where);
}

std::optional<PlanesRecord> planes_record(std::uint64_t looks, const VoxelMap& map, const MapPlanes& planes) {
  if (!planes.choice().any()) return std::nullopt;
  return PlanesRecord{count_planes(map, planes), looks};
}

}  // namespace

Result<std::unique_ptr<Cart>> Cart::make(const Config& config, const CartOptions& options, const CellFacts& facts,
                                         const CartDevices& devices, RunFolder& folder, Narrator& narrator) {
  auto cart = std::unique_ptr<Cart>(new Cart(config, options, devices, folder, narrator));
  auto bench = Workbench::make(cart->config_, facts, devices.color, devices.depth, *cart->workers_);
  if (!bench) return std::unexpected(bench.error());
  cart->bench_ = std::move(*bench);
  if (const Status made = folder.make(); !made) return std::unexpected(made.error());
  auto journal = JournalWriter::create_file(folder.file("journal.flj"),
                                            {version_text(), journal_config(cart->config_, options.scope)});
  if (!journal) return std::unexpected(journal.error());
  cart->journal_ = std::move(*journal);
  // The clock starts when all memory is taken: the devices' time is the loop's.
  if (options.real_time) {
    cart->clock_ = std::make_unique<RealClock>();
  } else {
    cart->clock_ = std::make_unique<VirtualClock>();
  }
  cart->jobs_ = std::make_unique<CartJobs>(*cart->bench_, [raw = cart.get()] { raw->checkpoint_calibration(); });
  cart->runner_ = std::make_unique<JobRunner>(*cart->jobs_, *cart->clock_,
                                              options.real_time ? JobMode::kThreaded : JobMode::kVirtual);
  cart->loop_.reset(new EventLoop(*cart->clock_, cart->journal_.get(), *cart, cart->timers_, *cart->runner_));
  cart->arm_source_.emplace(devices.arm, cart->bench_->arm(), cart->bench_->published());
  // The arm first: whatever else comes in the same turn finds its newest report.
  EventSource* const sources[] = {
      &*cart->arm_source_,  &cart->color_source_,  &cart->depth_source_, &cart->pendant_source_,
      &cart->panel_source_, &cart->device_source_, &cart->host_};
  for (EventSource* source : sources) cart->loop_->add_source(*source);
  cart->loop_->set_watchdog(cart->status_.watchdog());
  cart->machine_.emplace(machine_settings(cart->config_, options.scope), cart->decisions_);
  auto share = memory::PoolShare::take(memory::Pool::kApplication, sizeof(Cart));
  if (!share) return std::unexpected(share.error());
  cart->share_ = std::move(*share);
  return cart;
}

Cart::Cart(const Config& config, const CartOptions& options, const CartDevices& devices, RunFolder& folder,
           Narrator& narrator)
    : config_(config),
      options_(options),
      devices_(devices),
      folder_(folder),
      narrator_(narrator),
      workers_(std::make_unique<WorkerPool>(config.workers)),
      status_(config.cell),
      color_source_(devices.color),
      depth_source_(devices.depth),
      pendant_source_(devices.pendant, OperatorDevice::kPendant),
      panel_source_(devices.panel, OperatorDevice::kPanel),
      device_source_(devices.telling),
      decisions_(*this, this),
      started_(utc_date_text()),
      wall_start_s_(static_cast<double>(monotonic_ns()) * 1e-9) {}

Cart::~Cart() = default;

Status Cart::run() {
  machine_->start(clock_->now());
  memory::seal();
  const Status status = loop_->run();
  loop_allocations_ = memory::loop_allocations_after_seal();
  memory::unseal();
  if (loop_allocations_ > 0) memory::print_first_loop_allocation(2);
  const Instant now = clock_->now();
  if (!phases_.empty() && !ended_) phases_.back().end = now;
  loop_.reset();
  job_heap_peak_bytes_ = runner_->counters().heap_peak_bytes;
  runner_.reset();  // waits for a job that still works on what the record is made of
  status_.ending(seconds(kEndingWithin_s));
  if (began_) {
    status_.text("writing the report");
  } else {
    status_.leave_file();  // why it came to nothing, until it is started again
  }
  if (checkpoint_failure_) {
    narrator_.line(fmt::format("warning   no checkpoint of the calibration: {}", describe(*checkpoint_failure_)),
                   Priority::kWarning);
  }
  if (const Status closed = journal_->close(now); !closed) return closed;
  return status;
}

// ---- events

Worth Cart::worth(const Event& event) const { return worth_of(machine_->state(), event.kind); }

void Cart::on_event(const Event& event) {
  const auto machine_event = decode_event(event.kind, event.bytes());
  if (!machine_event) return;  // the loop's own faults are in the journal
  note_waiting(event.time);
  if (const auto* done = std::get_if<JobCompleted>(&*machine_event)) {
    bench_->published().take();
    if (done->number == awaited_job_) awaited_job_ = 0;
    if (done->number == awaited_look_) awaited_look_ = 0;
  }
  if (const auto* report = std::get_if<ArmReported>(&*machine_event)) arm_moves_ = report->state.moving;
  machine_->on_event(event.time, *machine_event);
}

void Cart::note_waiting(Instant now) {
  if (!arm_moves_ && (awaited_job_ != 0 || awaited_look_ != 0)) stall_s_ += (now - waited_until_).seconds();
  waited_until_ = now;
}

void Cart::end_of_turn(Instant now) {
  if (stop_signal_received()) host_.ask_shutdown(Fault::kProgramStopped);
  if (!options_.real_time) {
    if (machine_->state() == StateId::kReady && now.seconds() > options_.virtual_wait_max_s) {
      host_.ask_shutdown(Fault::kNotStarted);
    }
    if (now.seconds() > options_.virtual_time_max_s) host_.ask_shutdown(Fault::kTookTooLong);
  }
  if (device_source_.take_news()) tell_devices(now);
  if (ended_) loop_->stop();
}

void Cart::tell_devices(Instant now) {
  FixedVector<MissingDevice, kCartDevices> missing;
  for (const ToldDevice& device : device_source_.told()) {
    if (device.absent) missing.push_back({name_of(device.device), &device.report});
  }
  status_.missing({missing.data(), missing.size()});
  for (const ToldDevice& device : device_source_.told()) {
    if (!device.changed) continue;
    const hal::DeviceReport& report = device.report;
    std::array<char, 640> line;
    const auto end = fmt::format_to_n(line.data(), line.size(), "[{:7.1f} s]   {} {} {}: {}{}{}", now.seconds(),
                                      name_of(device.device), report.device.view(), hal::name_of(report.state),
                                      report.detail.view(), report.remedy.empty() ? "" : ". ", report.remedy.view());
    narrator_.line({line.data(), std::min(end.size, line.size())},
                   device.absent ? Priority::kWarning : Priority::kInfo);
  }
}

// ---- decisions

void Cart::decision(DecisionKind kind, Instant now, std::span<const std::byte> bytes) {
  journal_->decision(static_cast<std::uint16_t>(kind), now, bytes);
}

void Cart::begin_job(Instant now) {
  began_ = true;
  const Status begun = folder_.begin();
  if (begun) return;
  std::array<char, 320> line;
  const auto end = fmt::format_to_n(line.data(), line.size(), "[{:7.1f} s]   the run's folder cannot get its name: {}",
                                    now.seconds(), begun.error().detail());
  narrator_.line({line.data(), std::min(end.size, line.size())}, Priority::kError);
  host_.ask_shutdown(begun.error().fault);
}

void Cart::state_entered(Instant now, StateId state) {
  if (!began_ && is_within(state, StateId::kRunning)) begin_job(now);
  if (!is_phase(state)) return;
  status_.state(state_row(state).name, state == StateId::kReady);
  if (!phases_.empty() && !ended_) phases_.back().end = now;
  if (!phases_.full() && !ended_) phases_.push_back({state, now, now});
  std::array<char, 96> line;
  const auto end = fmt::format_to_n(line.data(), line.size(), "[{:7.1f} s] {}", now.seconds(), state_row(state).name);
  narrator_.line({line.data(), std::min(end.size, line.size())});
}

void Cart::move_arm(Instant now, const hal::Segment& segment) {
  if (const Status moved = devices_.arm.move(segment, now); !moved) host_.refused(moved.error().fault);
}

void Cart::stop_arm(Instant now) { devices_.arm.stop(now); }

void Cart::start_job(Instant now, JobKind kind, std::uint32_t number, std::span<const std::byte> arguments) {
  if (kind != JobKind::kIntegrate) {
    if (kind != JobKind::kColorLook) awaited_job_ = number;
  } else if (IntegrateArguments integrate; unpack(arguments, integrate) && integrate.at_view) {
    awaited_look_ = number;
  }
  submit(kind, number, arguments, now);
}

void Cart::checkpoint_calibration() {
  RunRecord record;
  fill_calibration(record);
  folder_.sync();
  if (const Status written = write_checkpoint(folder_.path(), calibration_of_run(record)); !written)
    checkpoint_failure_ = written.error();
}

void Cart::submit(JobKind kind, std::uint32_t number, std::span<const std::byte> arguments, Instant now) {
  request_.kind = static_cast<std::uint16_t>(kind);
  request_.number = number;
  request_.on_map_strand = true;  // every job reads or writes the workbench
  request_.virtual_duration = virtual_duration(kind);
  request_.size = static_cast<std::uint32_t>(arguments.size());
  std::copy(arguments.begin(), arguments.end(), request_.arguments.begin());
  // The machine has few jobs at a time, but in real time those that a pause left behind may still run.
  if (!runner_->submit(request_, now)) host_.ask_shutdown(Fault::kQueueFull);
}

void Cart::set_timer(Instant, MachineTimer timer, Instant due) { timers_.set(static_cast<std::uint32_t>(timer), due); }

void Cart::cancel_timer(Instant, MachineTimer timer) { timers_.cancel(static_cast<std::uint32_t>(timer)); }

void Cart::show(Instant now, std::string_view text) {
  devices_.pendant.show(text);
  status_.text(text);
  std::array<char, 128> line;
  const auto end = fmt::format_to_n(line.data(), line.size(), "[{:7.1f} s]   {}", now.seconds(), text);
  const std::string_view shown(line.data(), std::min(end.size, line.size()));
  if (narrator_.on_terminal()) {
    narrator_.progress(shown);
  } else {
    narrator_.line(shown);
  }
}

void Cart::light(Instant, hal::Light light) { devices_.panel.light(light); }

/// A job like the others, because one that works on the map may be running. The machine does not wait for it.
void Cart::forget_known_free(Instant now) {
  constexpr std::array<std::byte, 1> kNone{};
  submit(JobKind::kForgetKnownFree, 0, kNone, now);
}

void Cart::stop_recorded(Instant now, Fault cause) {
  if (!stops_.full()) stops_.push_back({now, cause});
  status_.fault(cause);
  std::array<char, 160> line;
  const auto end = fmt::format_to_n(line.data(), line.size(), "[{:7.1f} s]   E{} {}", now.seconds(),
                                    static_cast<int>(cause), fault_row(cause).text);
  narrator_.line({line.data(), std::min(end.size, line.size())}, Priority::kWarning);
}

void Cart::finished(Instant now, const Ending& ending) {
  ending_ = ending;
  if (!phases_.empty()) phases_.back().end = now;
  ended_ = true;
}

// ---- the record

MappingRecord Cart::mapping_record() const {
  MappingRecord m;
  m.resolution_m = config_.map.resolution_m;
  m.views = bench_->mapping_views();
  m.voxels = bench_->zone_counts();
  m.grid_voxels = bench_->map().counts();
  m.remaining = bench_->remaining();
  m.since_prior = bench_->change_since_prior();
  m.frames_integrated = bench_->frames_integrated();
  m.frames_refused = bench_->frames_refused();
  m.frames_refused[static_cast<std::size_t>(FrameFlaw::kPoseUnknown)] = machine_->depth_frames_unposed();
  m.infinite_pixels = bench_->infinite_pixels();
  m.pixels_left_out = bench_->pixels_left_out();
  m.pixels_fitted = bench_->pixels_fitted();
  m.holes = bench_->holes();
  if (const VoxelMap* fine = bench_->fine_map()) m.fine = FineMapRecord{fine->geometry().resolution_m, fine->counts()};
  m.occupied_forgotten = bench_->occupied_forgotten();
  return m;
}

SafetyRecord Cart::safety_record() const {
  const auto if_finite = [](double value) { return std::isfinite(value) ? std::optional(value) : std::nullopt; };
  SafetyRecord safety;
  safety.clearance = bench_->clearance_terms();
  safety.min_clearance_calibrating_m = if_finite(arm_source_->least_distance_calibrating_m());
  safety.min_clearance_mapping_m = if_finite(arm_source_->least_distance_mapping_m());
  for (const MotionStop& stop : stops_) {
    const auto cause = fmt::format("E{} {}", static_cast<int>(stop.cause), fault_row(stop.cause).text);
    safety.stops.push_back({stop.time.seconds(), cause});
  }
  return safety;
}

MemoryRecord Cart::memory_record() const {
  MemoryRecord memory;
  memory.budget_bytes = static_cast<std::uint64_t>(config_.memory.budget_mib) * memory::kMiB;
  memory.peak_bytes = memory::peak_bytes();
  memory.loop_allocations_after_seal = loop_allocations_;
  for (const memory::BudgetRow& row : memory::kBudget) {
    memory.pools.push_back(
        {std::string(row.name), row.bytes(), memory::peak_bytes(row.pool), memory::is_standing(row.pool)});
  }
  return memory;
}

WallRecord Cart::wall_record() const {
  WallRecord wall;
  wall.started = started_;
  wall.total_s = static_cast<double>(monotonic_ns()) * 1e-9 - wall_start_s_;
  wall.stall_s = stall_s_;
  wall.real_time = options_.real_time;
  wall.rss_bytes = resident_bytes();
  wall.job_heap_peak_bytes = job_heap_peak_bytes_;
  wall.library_bytes = resident_file_bytes();
  wall.workers = config_.workers;
  for (std::uint16_t kind = 1; kind <= static_cast<std::uint16_t>(kLastJobKind); ++kind) {
    const JobTimes& times = jobs_->times(static_cast<JobKind>(kind));
    if (times.count == 0) continue;
    wall.jobs.push_back(
        {std::string(name_of(static_cast<JobKind>(kind))), times.count, times.total_s, times.longest_s});
  }
  return wall;
}

template <typename Draw>
std::vector<MapPicture> Cart::with_map_pictures(Draw draw) const {
  const VoxelMap swept = bench_->map_after_sweep();
  const std::vector<CameraPlace> places = bench_->camera_places();
  return draw(MapPictureInputs{bench_->map(), bench_->swept() ? &swept : nullptr, bench_->zone(), places,
                               bench_->board_outlines_m()});
}

void Cart::fill_calibration(RunRecord& record) const {
  record.hand_eye = bench_->hand_eye();
  record.solver = config_.calibration.solver;
  record.intrinsics = bench_->camera();
  record.alignment = bench_->alignment();
  record.verified = bench_->verified();
  record.provenance.arm_model = bench_->arm().name.view();
  record.provenance.kinematics = kinematics_checksum(bench_->arm());
}

RunRecord Cart::record() const {
  RunRecord r;
  r.outcome = ending_.outcome;
  r.seed = config_.seed;
  r.cell = config_.cell;
  for (const PhasePassed& phase : phases_) {
    r.phases.push_back({std::string(state_row(phase.state).name), phase.start.seconds(), phase.end.seconds()});
  }
  r.decisions_hash = hash_text(journal_->decisions_hash());
  fill_calibration(r);
  if (bench_->targets().size() > 1) {
    for (const NamedTarget& target : bench_->targets()) r.target_names.push_back(target.name);
  }
  r.calibration_views = bench_->calibration_records();
  if (bench_->mapped()) {
    r.mapping = mapping_record();
    r.map_pictures = with_map_pictures([](const MapPictureInputs& inputs) { return map_pictures(inputs); });
    r.mapping->objects = find_objects(bench_->map(), collision_class);
    bench_->label_objects(r.mapping->objects);
    r.mapping->planes = planes_record(bench_->looks_colored(), bench_->map(), bench_->planes());
    if (const auto& colors = bench_->planes().color)
      for (MapPicture& picture : color_pictures(bench_->map(), *colors, r.mapping->objects))
        r.map_pictures.push_back(std::move(picture));
    for (MapPicture& picture : object_pictures(bench_->map(), r.mapping->objects))
      r.map_pictures.push_back(std::move(picture));
    r.mapping->objects.id_of.clear();
  }
  r.safety = safety_record();
  for (const MotionStop& stop : stops_) r.faults.push_back({stop.time.seconds(), stop.cause, ""});
  r.memory = memory_record();
  r.provenance.version = version_text();
  r.provenance.config_yaml = print_config(config_);
  r.wall = wall_record();
  r.reason = reason_text(r, ending_, bench_->blocked_by());
  if (ending_.has_fault) r.remedy = fault_row(ending_.fault).remedy;
  return r;
}

std::vector<MapPicture> Cart::pictures_of_part(const NamedPart& part, const std::string& after_sweep,
                                               const std::string& at_end) const {
  if (!bench_->mapped()) return {};
  return with_map_pictures(
      [&](const MapPictureInputs& inputs) { return part_pictures(inputs, part, after_sweep, at_end); });
}

MapFiles Cart::map_files() const {
  MapFiles files;
  if (!bench_->mapped()) return files;
  const auto into = [](std::string& text) {
    return [&text](std::span<const std::byte> bytes) {
      text.append(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    };
  };
  auto bt = into(files.collision_map_bt);
  write_bt(bench_->map(), collision_class, kOctreeDepth, bt);
  auto ot = into(files.map_ot);
  write_ot(bench_->map(), kOctreeDepth, ot);
  auto ply = into(files.map_ply);
  write_ply(bench_->map(), false, ply, bench_->planes());
  if (const auto& colors = bench_->planes().color) {
    auto color_ot = into(files.color_map_ot);
    write_color_ot(bench_->map(), *colors, kOctreeDepth, color_ot);
  }
  if (const VoxelMap* fine = bench_->fine_map()) {
    auto fine_bt = into(files.fine_map_bt);
    write_bt(*fine, octomap_class, kOctreeDepth, fine_bt);
  }
  files.occupied = merge_occupied(bench_->map(), collision_class);
  return files;
}

}  // namespace firstlook
