#include "app/wiring/run_job.hpp"

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <string>
#include <system_error>
#include <vector>

#include "app/cli/exit_codes.hpp"
#include "app/machine/state_table.hpp"
#include "app/report/checkpoint.hpp"
#include "app/report/result_json.hpp"
#include "app/report/run_files.hpp"
#include "app/shell/calibration_recording.hpp"
#include "app/shell/cart.hpp"
#include "app/shell/job_settings.hpp"
#include "app/shell/narrate_result.hpp"
#include "app/wiring/job_site.hpp"
#include "app/wiring/real_devices.hpp"
#include "app/wiring/run_check.hpp"
#include "platform/linux/process.hpp"
#include "platform/memory/allocation_guard.hpp"

namespace firstlook {
namespace {

constexpr const char* kRunsFolder = "runs";  // where runs go that name no folder

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

/// With --resume: the run that a power cut ended between its calibration and its end, if there is one.
std::optional<CutOffRun> run_to_resume(const RunCommand& command, Narrator& narrator) {
  if (!command.resume) return std::nullopt;
  std::optional<CutOffRun> cut_off = newest_cut_off_run(kRunsFolder);
  if (cut_off) {
    narrator.line(
        fmt::format("{} was cut off after its calibration: Play tests that calibration and maps", cut_off->folder));
  }
  return cut_off;
}

/// The cart, and what its memory took at boot.
struct Booted {
  std::unique_ptr<Cart> cart;
  std::int64_t heap_bytes = 0;
};

Result<Booted> boot(const Config& config, const CartOptions& options, const CellFacts& facts, JobSite& site,
                    RunFolder& folder, Narrator& narrator) {
  const memory::JobHeapScope heap(memory::kHeapUncapped);
  auto made = Cart::make(config, options, facts, site.devices(), folder, narrator);
  if (!made) return std::unexpected(made.error());
  return Booted{std::move(*made), heap.outstanding_bytes()};
}

/// Whether the job came further than to wait for its start.
bool job_began(const RunRecord& record) {
  constexpr StateId kBefore[] = {StateId::kBoot, StateId::kReady, StateId::kStopped, StateId::kFaulted};
  return std::ranges::any_of(record.phases, [&](const PhaseRecord& phase) {
    return std::ranges::none_of(kBefore, [&](StateId state) { return phase.name == state_row(state).name; });
  });
}

/// All files of the run; behind them its checkpoint is of no use any more.
Status write_run(const RunCommand& command, const Config& config, const std::string& folder, const Cart& cart,
                 const RunRecord& record) {
  if (command.record) {
    if (const Status written = write_calibration_recording(folder + "/dataset", record, config); !written)
      return written;
  }
  if (const Status written = write_run_files(folder, record, cart.map_files()); !written) return written;
  remove_checkpoint(folder);
  return {};
}

/// A service that waits for its job has a folder only when it begins.
Result<RunFolder> run_folder(const RunCommand& command, const Config& config) {
  if (!command.out.empty()) return RunFolder::named(command.out);
  if (command.resume) return RunFolder::waiting(kRunsFolder, config.seed);
  return RunFolder::named(fmt::format("{}/{}-{}", kRunsFolder, utc_date_for_name(), config.seed));
}

/// Of a real cart; "none" where the configuration names no robot on the network.
std::string_view robot_of(const Config& config) {
  return names_network_robot(config) ? std::string_view(config.robot.host) : "none";
}

/// A service that cannot be opened says so until it is started again: why, and of every device what it needs.
/// @param asked  devices that opening has asked already
void tell_what_is_missing(const Config& config, const std::vector<CheckedDevice>& asked, const Error& error,
                          Narrator& narrator) {
  ServiceStatus status(robot_of(config));
  if (!status.heard()) return;
  const auto tell = [&](const std::vector<CheckedDevice>& devices) {
    status.state(state_row(StateId::kBoot).name, false);
    status.text(error.detail());
    status.fault(error.fault);
    FixedVector<MissingDevice, 8> missing;
    for (const CheckedDevice& device : devices) {
      if (device.report.state != hal::DeviceState::kReady && !missing.full())
        missing.push_back({device.role, &device.report});
    }
    status.missing({missing.data(), missing.size()});
  };
  // Asking takes some seconds, in which what a start before has left says more.
  if (!status.told_before()) tell(asked);
  std::vector<CheckedDevice> devices = asked;
  Config others = config;
  for (const CheckedDevice& device : asked) {
    if (device.role == kPanelRole) others.panel.can_interface = "none";
  }
  if (const auto answered = ask_real_devices(others, narrator))
    devices.insert(devices.end(), answered->begin(), answered->end());
  tell(devices);
  status.leave_file();
}

Result<std::unique_ptr<JobSite>> open_site(const RunCommand& command, Config& config, Narrator& narrator) {
  if (!names_real_cart(config)) return open_simulated_site(command, config, narrator);
  std::vector<CheckedDevice> asked;
  auto site = open_real_site(command, config, narrator, asked);
  if (!site) tell_what_is_missing(config, asked, site.error(), narrator);
  return site;
}

std::string where(const RunCommand& command, const LoadedConfig& loaded) {
  const Config& config = loaded.config;
  if (names_real_cart(config)) return fmt::format("running on the real cart, robot {}", robot_of(config));
  const bool configured = command.cell_given || !loaded.file.empty();
  return fmt::format("{}running in the simulated cell {}", configured ? "" : "no configuration: ", config.cell);
}

}  // namespace

int run_job(const RunCommand& command) {
  const auto loaded = load_config(command.sources);
  if (!loaded) return fail(loaded.error());
  Config config = loaded->config;
  Narrator narrator;
  narrator.line(where(command, *loaded));
  if (command.resume && command.scope != RunScope::kEverything) {
    return fail(failure(Fault::kUsage, "--resume goes on with the part that a run lacked: it takes no --only").error());
  }
  auto stored = stored_calibration(command.scope, config);
  if (!stored) return fail(stored.error());
  std::optional<CutOffRun> resumed = run_to_resume(command, narrator);
  if (resumed) *stored = resumed->calibration;
  auto folder = run_folder(command, config);
  if (!folder) return fail(folder.error());
  auto opened = open_site(command, config, narrator);
  if (!opened) return fail(opened.error());
  JobSite& site = **opened;
  if (const Status standing = memory::account_standing_rows(); !standing) return fail(standing.error());
  CellFacts facts = site.facts();
  facts.stored = *stored;
  CartOptions options;
  options.scope = resumed ? RunScope::kMap : command.scope;
  options.real_time = command.real_time || site.in_real_time();
  auto booted = boot(config, options, facts, site, *folder, narrator);
  if (!booted && resumed && booted.error().fault == Fault::kStoredCalibration) {
    narrator.line(fmt::format("not taken up: {}", describe(booted.error())), Priority::kWarning);
    remove_checkpoint(resumed->folder);
    resumed.reset();
    facts.stored.reset();
    options.scope = command.scope;
    booted = boot(config, options, facts, site, *folder, narrator);
  }
  if (!booted) return fail(booted.error());
  Cart& cart = *booted->cart;

  site.begin(cart.published());
  catch_stop_signals();
  const Status ran = cart.run();
  if (!ran) std::fprintf(stderr, "firstlook: %s\n", describe(ran.error()).c_str());

  RunRecord record = cart.record();
  site.finish(cart, config, record, narrator);
  record.wall.boot_heap_bytes = static_cast<std::uint64_t>(std::max<std::int64_t>(0, booted->heap_bytes));
  record.provenance.sensor = command.fast_sensor ? "fast" : "full";
  record.wall.folder = folder->path();
  narrate_result(record, narrator);
  // A service is started again and again, also where a device is missing for days: only jobs leave folders behind.
  if (command.resume && command.out.empty() && !job_began(record)) {
    std::error_code left;
    std::filesystem::remove_all(folder->path(), left);
    return ran ? exit_code_of(cart.ending()) : exit_code_of(ran.error());
  }
  if (const Status written = write_run(command, config, folder->path(), cart, record); !written)
    return fail(written.error());
  // Taken up and brought to its end; one that was stopped is offered again.
  if (resumed && record.outcome != Outcome::kSafelyStopped) remove_checkpoint(resumed->folder);
  narrator.line(fmt::format("report    {}", folder->file("report.html")));
  if (command.json) std::printf("%s", result_json(record).c_str());
  return ran ? exit_code_of(cart.ending()) : exit_code_of(ran.error());
}

}  // namespace firstlook
