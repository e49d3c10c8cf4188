/// One job of the cart: devices, loop, machine, jobs and journal put together. The live side of the decisions.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "app/jobs/cart_jobs.hpp"
#include "app/jobs/workbench.hpp"
#include "app/machine/machine.hpp"
#include "app/report/run_files.hpp"
#include "app/report/run_record.hpp"
#include "app/shell/decision_log.hpp"
#include "app/shell/device_source.hpp"
#include "app/shell/device_sources.hpp"
#include "app/shell/run_folder.hpp"
#include "app/shell/service_status.hpp"
#include "platform/journal/journal.hpp"
#include "platform/linux/terminal.hpp"
#include "platform/loop/event_loop.hpp"

namespace firstlook {

struct CartDevices {
  hal::RobotArm& arm;
  hal::ColorCamera& color;
  hal::DepthCamera& depth;
  hal::Pendant& pendant;
  hal::Panel& panel;
  TellingDevices telling{};  ///< those that tell of themselves
};

struct CartOptions {
  RunScope scope = RunScope::kEverything;
  bool real_time = false;
  // In virtual time nobody is there to lose patience.
  double virtual_time_max_s = 3 * 3600;  ///< a job that takes longer is stopped
  double virtual_wait_max_s = 600;       ///< for Play
};

/// A phase of the job as it happened.
struct PhasePassed {
  StateId state = StateId::kNone;
  Instant start{}, end{};
};

/// A stop of the motion and its cause.
struct MotionStop {
  Instant time{};
  Fault cause = Fault::kInternal;
};

class Cart final : private DecisionSink, private EventHandler, private DecisionLog {
 public:
  /// Takes all memory. Errors: those of Workbench::make and JournalWriter::create_file.
  /// @param folder  of the run, for its journal and checkpoint; outlives the cart
  [[nodiscard]] static Result<std::unique_ptr<Cart>> make(const Config& config, const CartOptions& options,
                                                          const CellFacts& facts, const CartDevices& devices,
                                                          RunFolder& folder, Narrator& narrator);
  ~Cart() override;

  /// Boots, seals the memory, runs the job to its end. Errors: that of the loop (nothing is due any more), kDiskWrite
  /// when the journal could not be written to its end; the job itself went on.
  [[nodiscard]] Status run();

  /// What was recorded; after run().
  [[nodiscard]] RunRecord record() const;
  [[nodiscard]] MapFiles map_files() const;
  /// See part_pictures. Empty when nothing was mapped.
  [[nodiscard]] std::vector<MapPicture> pictures_of_part(const NamedPart& part, const std::string& after_sweep,
                                                         const std::string& at_end) const;
  [[nodiscard]] const Workbench& bench() const { return *bench_; }
  [[nodiscard]] PublishedSpace& published() { return bench_->published(); }
  [[nodiscard]] const Ending& ending() const { return ending_; }

 private:
  Cart(const Config& config, const CartOptions& options, const CartDevices& devices, RunFolder& folder,
       Narrator& narrator);

  // DecisionSink: carries out.
  void state_entered(Instant now, StateId state) override;
  void move_arm(Instant now, const hal::Segment& segment) override;
  void stop_arm(Instant now) override;
  void start_job(Instant now, JobKind kind, std::uint32_t number, std::span<const std::byte> arguments) override;
  void set_timer(Instant now, MachineTimer timer, Instant due) override;
  void cancel_timer(Instant now, MachineTimer timer) override;
  void show(Instant now, std::string_view line) override;
  void light(Instant now, hal::Light light) override;
  void forget_known_free(Instant now) override;
  void stop_recorded(Instant now, Fault cause) override;
  void finished(Instant now, const Ending& ending) override;
  // DecisionLog: records.
  void decision(DecisionKind kind, Instant now, std::span<const std::byte> bytes) override;
  // EventHandler
  [[nodiscard]] Worth worth(const Event& event) const override;
  void on_event(const Event& event) override;
  void end_of_turn(Instant now) override;

  /// The first state behind Ready.
  void begin_job(Instant now);
  /// What a device said has changed: for the status, and in words.
  void tell_devices(Instant now);
  /// On the job's thread, before the machine hears of it: from here on a power cut does not lose the calibration.
  void checkpoint_calibration();
  void submit(JobKind kind, std::uint32_t number, std::span<const std::byte> arguments, Instant now);
  /// Counts the time in which the arm stands and the machine waits for a job.
  void note_waiting(Instant now);

  void fill_calibration(RunRecord& record) const;
  [[nodiscard]] MappingRecord mapping_record() const;
  [[nodiscard]] SafetyRecord safety_record() const;
  [[nodiscard]] MemoryRecord memory_record() const;
  [[nodiscard]] WallRecord wall_record() const;
  template <typename Draw>
  [[nodiscard]] std::vector<MapPicture> with_map_pictures(Draw draw) const;

  Config config_;
  CartOptions options_;
  CartDevices devices_;
  RunFolder& folder_;
  Narrator& narrator_;
  std::unique_ptr<Clock> clock_;
  std::unique_ptr<WorkerPool> workers_;
  std::unique_ptr<Workbench> bench_;
  std::unique_ptr<CartJobs> jobs_;
  std::unique_ptr<JobRunner> runner_;
  std::unique_ptr<JournalWriter> journal_;
  TimerQueue timers_;
  ServiceStatus status_;
  std::unique_ptr<EventLoop> loop_;
  std::optional<ArmSource> arm_source_;
  FrameSource<ColorFrameArrived> color_source_;
  FrameSource<DepthFrameArrived> depth_source_;
  OperatorSource<hal::Pendant> pendant_source_;
  OperatorSource<hal::Panel> panel_source_;
  DeviceSource device_source_;
  HostSource host_;
  LoggedDecisions decisions_;
  std::optional<Machine> machine_;
  JobRequest request_;
  memory::PoolShare share_;  ///< of the memory page, for the cart itself

  // What the report tells.
  std::optional<Error> checkpoint_failure_;  ///< of a job's thread; read after the loop has ended
  FixedVector<PhasePassed, 128> phases_;
  FixedVector<MotionStop, 128> stops_;
  Ending ending_{Outcome::kFaulted, true, Fault::kInternal};
  bool began_ = false, ended_ = false;
  double stall_s_ = 0;
  Instant waited_until_{};
  bool arm_moves_ = false;
  std::uint32_t awaited_job_ = 0;
  std::uint32_t awaited_look_ = 0;  ///< integration of a look
  std::uint64_t loop_allocations_ = 0;
  std::uint64_t job_heap_peak_bytes_ = 0;
  std::string started_;
  double wall_start_s_ = 0;
};

}  // namespace firstlook
