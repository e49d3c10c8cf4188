/// What happens in a controller that its primary interface tells everybody.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace firstlook::sim::ur {

/// One message of the primary interface, before it is packed.
struct ControllerEvent {
  enum class Kind : std::uint8_t { kText, kLabel, kKey, kPopup, kSafetyMode, kErrorCode, kRequest, kRuntimeException };

  Kind kind = Kind::kText;
  double timestamp_s = 0;
  std::int32_t code = 0;      ///< of a key, a label or an error; the line of a runtime exception; the id of a request
  std::int32_t argument = 0;  ///< of an error; the column of a runtime exception; the safety mode; the type requested
  bool warning = false, error = false;
  bool blocking = false;  ///< a popup that the program waits for
  std::string title = {}, text = {};
};

/// The newest events, until the interfaces took them. A full log loses the oldest.
class EventLog {
 public:
  void add(ControllerEvent event) {
    if (events_.size() >= kEventsMax) events_.erase(events_.begin());
    events_.push_back(std::move(event));
  }
  [[nodiscard]] std::vector<ControllerEvent> take() { return std::exchange(events_, {}); }

 private:
  static constexpr std::size_t kEventsMax = 256;  // in one cycle
  std::vector<ControllerEvent> events_;
};

}  // namespace firstlook::sim::ur
