/// A CiA 401 module as its electronic data sheet describes it, on a simulated bus. It shares no code with the driver.
#pragma once

#include <linux/can.h>

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "platform/core/time.hpp"

namespace firstlook::test {

class SimulatedIoNode {
 public:
  struct Entry {
    std::uint64_t value = 0;
    unsigned bytes = 0;
    bool writable = false;
  };
  using Address = std::pair<unsigned, unsigned>;  ///< index, sub-index

  /// @param sheet  text of an EDS; an entry without a sub-index in it has 0
  SimulatedIoNode(const std::string& sheet, unsigned number);

  // What somebody does to it.
  void power(bool on);  ///< without power it says and hears nothing; with it, it boots
  void set_inputs(unsigned bits) { inputs_ = bits; }
  void set(Address address, std::uint64_t value) { entries_.at(address).value = value; }
  void make_constant(Address address) { entries_.at(address).writable = false; }
  void remove(Address address) { entries_.erase(address); }
  void press_reset() { reboot_ = true; }
  void enter_pre_operational() { state_ = kPreOperational; }
  bool mute = false;                 ///< sends nothing, as behind a broken wire
  int ignored_sdo = 0;               ///< so many requests get no answer
  std::optional<Address> segmented;  ///< answered as a value of more than 4 bytes
  std::optional<Address> never_answered;

  // What it shows.
  [[nodiscard]] unsigned lamps() const { return lamps_; }
  [[nodiscard]] bool operational() const { return state_ == kOperational; }
  [[nodiscard]] bool misses_master() const { return misses_master_; }
  [[nodiscard]] std::uint64_t value(Address address) const { return entries_.at(address).value; }
  [[nodiscard]] const std::set<Address>& touched() const { return touched_; }  ///< by SDO
  [[nodiscard]] unsigned resets() const { return resets_; }

  void receive(const can_frame& frame, Instant now);
  /// What it has to say by now.
  [[nodiscard]] std::vector<can_frame> turn(Instant now);

 private:
  enum State : std::uint8_t { kOff, kBooting, kStopped = 4, kOperational = 5, kPreOperational = 0x7F };

  void boot();
  void answer_sdo(const can_frame& frame);
  void say(unsigned id, const std::vector<unsigned>& bytes);
  void send_inputs(Instant now);
  void watch_master(Instant now);

  std::map<Address, Entry> entries_, as_delivered_;
  unsigned number_;
  State state_ = kOff;
  bool reboot_ = false;
  bool misses_master_ = false;
  unsigned inputs_ = 0, lamps_ = 0, resets_ = 0;
  std::optional<unsigned> sent_inputs_;
  Instant next_heartbeat_{}, next_inputs_{}, ready_{};
  std::optional<Instant> master_heard_;
  std::vector<can_frame> out_;
  std::set<Address> touched_;
  Instant now_{};
};

}  // namespace firstlook::test
