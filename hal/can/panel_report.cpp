/// What the panel says of itself, and what to do when it does not work.
#include <cstring>

#include "hal/can/can_panel.hpp"

namespace firstlook::can {
namespace {

void tell_bus(const RemoteIo& io, hal::DeviceReport& report) {
  const std::string_view name = io.options().interface;
  switch (io.bus_trouble()) {
    case BusTrouble::kNone:
      report.detail.set("{} was not opened yet", name);
      break;
    case BusTrouble::kNoCan:
      report.detail.set("this kernel has no CAN sockets");
      report.remedy.set("Load the modules: modprobe can_raw, and the driver of the CAN adapter.");
      break;
    case BusTrouble::kNoInterface:
      report.detail.set("there is no network interface {}", name);
      report.remedy.set(
          "Plug in the CAN adapter; `ip -brief link` lists the interfaces. Another name belongs in "
          "panel.can_interface.");
      break;
    case BusTrouble::kDown:
      report.detail.set("the interface {} is down", name);
      report.remedy.set("ip link set {} up type can bitrate 250000 restart-ms 100, with the panel's bit rate.", name);
      break;
    case BusTrouble::kRefused:
      report.detail.set("{}: {}", name, std::strerror(io.bus_error()));
      report.remedy.set("Check that the program may open CAN sockets, and that {} is a CAN interface.", name);
      break;
  }
}

void tell_silence(const RemoteIo& io, hal::DeviceReport& report) {
  const auto& o = io.options();
  if (io.other_node() != 0) {
    report.detail.set("node {} does not answer; node {} does", o.node, io.other_node());
    report.remedy.set("Set the panel's address switches to {}, or panel.node_id to {}.", o.node, io.other_node());
  } else if (io.error_passive() || io.counters().unacknowledged > 0 || io.counters().sends_put_off > 0) {
    report.detail.set("nobody on {} acknowledges our frames", o.interface);
    report.remedy.set(
        "Panel and interface need the same bit rate (ip -details link show {}), two resistors of 120 ohm, CAN_H on "
        "CAN_H, and the panel its power.",
        o.interface);
  } else {
    report.detail.set("node {} does not answer to a reset", o.node);
    report.remedy.set("Check the panel's power, its address switches ({}), its bit rate and the cable.", o.node);
  }
}

void tell_refusal(const Refusal& refusal, hal::DeviceReport& report) {
  const ObjectAddress& at = refusal.address;
  switch (refusal.kind) {
    case Refusal::Kind::kNone:
      break;
    case Refusal::Kind::kDeviceType:
      report.detail.set("its device type is {} (1000h: {:08X}h), not 401 for inputs and outputs",
                        refusal.found & 0xFFFF, refusal.found);
      report.remedy.set("Another kind of device has the panel's number: give each its own, or correct panel.node_id.");
      break;
    case Refusal::Kind::kVendor:
    case Refusal::Kind::kProduct:
      report.detail.set("its {} is {:08X}h, expected {:08X}h",
                        refusal.kind == Refusal::Kind::kVendor ? "vendor (1018h:1)" : "product code (1018h:2)",
                        refusal.found, refusal.expected);
      report.remedy.set(
          "Mount the expected module, or correct panel.vendor_id, panel.product_code and, by its data sheet, the "
          "numbers of inputs and outputs.");
      break;
    case Refusal::Kind::kMapping:
      report.detail.set("{:04X}h:{} maps {:08X}h, needed {:08X}h, and cannot be changed", at.index, at.sub,
                        refusal.found, refusal.expected);
      report.remedy.set("Set the module to its default mapping of CiA 401, or use one that can be mapped.");
      break;
    case Refusal::Kind::kAborted:
      report.detail.set("it refuses object {:04X}h:{}: {}", at.index, at.sub, abort_text(refusal.found));
      report.remedy.set("Restore the module's defaults (1011h), and compare it with hal/can/firstlook_panel.eds.");
      break;
    case Refusal::Kind::kSilent:
      report.detail.set("it does not answer for object {:04X}h:{}", at.index, at.sub);
      report.remedy.set("Switch the panel off and on; look for a second master on the bus.");
      break;
  }
}

std::string_view loss_text(LossCause cause) {
  switch (cause) {
    case LossCause::kNone:
      return "";
    case LossCause::kHeartbeat:
      return "no heartbeat came any more; ";
    case LossCause::kRestarted:
      return "it restarted by itself; ";
    case LossCause::kLeftOperational:
      return "it left its operational state; ";
    case LossCause::kBusOff:
      return "the bus broke down; ";
    case LossCause::kInterface:
      return "the interface went away; ";
  }
  return "";
}

/// Missing until it worked once, lost from then on.
hal::DeviceState absent(const RemoteIo& io) {
  return io.counters().losses > 0 ? hal::DeviceState::kLost : hal::DeviceState::kMissing;
}

}  // namespace

hal::DeviceReport CanPanel::report(Instant now) const {
  hal::DeviceReport report;
  const RemoteIoCounters& n = io_.counters();
  report.device.set("{} node {}", options_.io.interface, options_.io.node);
  switch (io_.step()) {
    case NodeStep::kNoBus:
      report.state = io_.bus_trouble() == BusTrouble::kNone ? hal::DeviceState::kStarting : absent(io_);
      tell_bus(io_, report);
      break;
    case NodeStep::kBusOff:
      report.state = absent(io_);
      report.detail.set("{} is off the bus after too many errors", options_.io.interface);
      report.remedy.set(
          "Check for a short circuit, termination and bit rate; restart it with: ip link set {} type can restart.",
          options_.io.interface);
      break;
    case NodeStep::kAwaitingBoot:
      // The first reset may still be answered.
      report.state = n.losses == 0 && io_.resets() <= 1 ? hal::DeviceState::kStarting : absent(io_);
      tell_silence(io_, report);
      break;
    case NodeStep::kConfiguring:
    case NodeStep::kStarting:
      report.state = hal::DeviceState::kStarting;
      report.detail.set("is being configured");
      break;
    case NodeStep::kRefused:
      report.state = io_.refusal().kind == Refusal::Kind::kSilent ? absent(io_) : hal::DeviceState::kUnsuitable;
      tell_refusal(io_.refusal(), report);
      break;
    case NodeStep::kOperational:
      report.state = hal::DeviceState::kReady;
      report.detail.set("CiA 401, vendor {:08X}h, product {:08X}h{}{}", io_.vendor(), io_.product(),
                        stop_ ? "; its stop button is pressed, or the wire broken" : "",
                        io_.watches_us() ? "" : "; keeps its light when this computer is gone");
      break;
  }
  if (report.state == hal::DeviceState::kLost) {
    const auto what = report.detail;
    report.detail.set("{}{}", loss_text(io_.last_loss()), what.view());
  }
  if (io_.operational()) report.add("heartbeat_age_s", (now - io_.last_heard()).seconds());
  const auto count = [&](std::string_view name, std::uint64_t value) { report.add(name, static_cast<double>(value)); };
  count("frames_in", n.frames_in);
  count("frames_out", n.frames_out);
  count("losses", n.losses);
  count("node_restarts", n.node_restarts);
  count("interface_losses", n.interface_losses);
  count("bus_off", n.bus_off);
  count("error_passive", n.error_passive);
  count("bus_errors", n.bus_errors);
  count("overflows", n.overflows);
  count("sdo_timeouts", n.sdo_timeouts);
  count("sdo_aborts", n.sdo_aborts);
  count("emergencies", n.emergencies);
  count("sends_put_off", n.sends_put_off);
  count("presses_lost", events_lost_);
  report.add("stop_pressed", stop_ ? 1 : 0);
  report.add("enabling_switch", enabling_ ? 1 : 0);
  return report;
}

}  // namespace firstlook::can
