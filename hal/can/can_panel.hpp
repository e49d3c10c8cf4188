/// The panel on the cart as a CiA 401 node: buttons, tower light, buzzer.
///
/// None of this is a safety function. The stop button of the panel asks the program to stop; what must stop a machine
/// for sure is wired to the robot's own safety inputs. The enabling switch is an input that is shown, and decides
/// nothing.
#pragma once

#include <cstdint>
#include <optional>

#include "hal/api/device_report.hpp"
#include "hal/api/operator_devices.hpp"
#include "hal/can/remote_io.hpp"

namespace firstlook::can {

/// Where a button or lamp is connected: the number of its bit, counted from 0 at the lowest of the first byte; -1:
/// there is none.
struct PanelWiring {
  int start = 0;
  int stop = 1;
  int confirm = 2;
  int enabling = 3;
  bool stop_opens = true;  ///< its contact opens when it is pressed, so that a broken wire reads as pressed
  int red = 0;
  int amber = 1;
  int green = 2;
  int buzzer = 3;
};

/// The bits that show a light, and the buzzer.
[[nodiscard]] std::uint64_t output_bits(const PanelWiring& wiring, hal::Light light, bool buzzing);

/// A contact that bounces. A press counts when it has lasted, and is stamped with its begin.
class Debouncer {
 public:
  explicit Debouncer(Duration settle) : settle_(settle) {}
  /// Takes the level as it is; nothing is pressed by it.
  void start(bool level) { level_ = settled_ = level; }
  void change(bool level, Instant stamp) {
    if (level == level_) return;
    level_ = level;
    since_ = stamp;
  }
  /// The begin of a press, once, when it has lasted until `now`.
  [[nodiscard]] std::optional<Instant> pressed(Instant now);
  [[nodiscard]] bool settled() const { return settled_; }
  [[nodiscard]] bool bouncing() const { return level_ != settled_; }

 private:
  Duration settle_;
  bool level_ = false;
  bool settled_ = false;
  Instant since_{};
};

struct CanPanelOptions {
  RemoteIoOptions io;
  PanelWiring wiring;
  Duration debounce = milliseconds(20);  ///< contacts of push buttons bounce for some milliseconds
  Duration buzz = milliseconds(700);     ///< when the light turns red
};

/// hal::Panel over a RemoteIo. start gives kPlay, stop kStop, confirm kConfirm. A button that is held when the node
/// comes up counts only after it was released, but for stop, which counts at once and without debouncing. A panel that
/// is lost gives kLost once.
class CanPanel final : public hal::Panel, public hal::ReportingDevice {
 public:
  CanPanel(SystemCalls& system, const CanPanelOptions& options);

  [[nodiscard]] std::optional<hal::OperatorEvent> poll(Instant now) override;
  [[nodiscard]] Instant next_due() const override;
  void light(hal::Light light) override;
  [[nodiscard]] hal::DeviceReport report(Instant now) const override;

  [[nodiscard]] const RemoteIo& io() const { return io_; }
  /// Whether the enabling switch is held; false while the panel is not there.
  [[nodiscard]] bool enabling() const { return enabling_; }

 private:
  void take(const InputReport& report);
  void settle_buttons(Instant now);
  void press(Instant stamp, hal::OperatorAction action);
  void show(Instant now);

  CanPanelOptions options_;
  RemoteIo io_;
  Debouncer start_, confirm_;
  bool stop_ = false;
  bool enabling_ = false;
  FixedVector<hal::OperatorEvent, 16> events_;
  std::uint64_t events_lost_ = 0;
  hal::Light light_ = hal::Light::kOff;
  bool buzz_asked_ = false;
  Instant buzz_until_{};
  std::uint64_t shown_ = 0;
  bool shown_once_ = false;
  Instant last_turn_{};
};

}  // namespace firstlook::can
