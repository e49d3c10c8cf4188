#include "hal/sim/ur_controller/pendant_requests.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>

namespace firstlook::sim::ur {
namespace {

using Entry = PendantRequests::Entry;

template <typename Number>
std::optional<Entry> number_of(std::string_view text) {
  Number number{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return Entry(number);
}

std::optional<Entry> entry_of(RequestedType type, std::string_view text) {
  switch (type) {
    case RequestedType::kBoolean:
      if (text != "True" && text != "False") return std::nullopt;
      return Entry(text == "True");
    case RequestedType::kInteger:
      return number_of<std::int64_t>(text);
    case RequestedType::kFloat: {
      const auto entry = number_of<double>(text);
      return entry && std::isfinite(std::get<double>(*entry)) ? entry : std::nullopt;
    }
    case RequestedType::kString:
      return Entry(std::string(text));
    case RequestedType::kNone:
      break;
  }
  return std::nullopt;
}

}  // namespace

PendantRequests::Id PendantRequests::ask(RequestedType type) {
  if (dialogs_.size() >= kDialogsMax) dialogs_.erase(dialogs_.begin());
  dialogs_.push_back({++last_, type});
  return last_;
}

bool PendantRequests::enter(std::string_view text) {
  const auto open = std::ranges::find_if(dialogs_, [](const Dialog& dialog) { return !dialog.entry; });
  if (open == dialogs_.end()) return false;
  open->entry = entry_of(open->type, text);
  return open->entry.has_value();
}

std::optional<Entry> PendantRequests::take(Id id) {
  const auto dialog = std::ranges::find(dialogs_, id, &Dialog::id);
  if (dialog == dialogs_.end() || !dialog->entry) return std::nullopt;
  std::optional<Entry> entry = std::move(dialog->entry);
  dialogs_.erase(dialog);
  return entry;
}

}  // namespace firstlook::sim::ur
