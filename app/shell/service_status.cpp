#include "app/shell/service_status.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>

#include "platform/linux/process.hpp"

namespace firstlook {
namespace {

/// The interval that the manager expects the watchdog to be fed in; 0: it does not, or means another process.
std::int64_t watchdog_us() {
  const char* const usec = std::getenv("WATCHDOG_USEC");
  const char* const pid = std::getenv("WATCHDOG_PID");
  if (usec == nullptr || (pid != nullptr && std::atoll(pid) != getpid())) return 0;
  return std::max<std::int64_t>(0, std::atoll(usec));
}

std::string status_path() {
  const char* const folder = std::getenv("RUNTIME_DIRECTORY");
  return folder == nullptr || *folder == '\0' ? std::string() : fmt::format("{}/status.json", folder);
}

/// What JSON wants escaped is left out: the lines are ours.
template <std::size_t N>
void take(std::string_view from, std::array<char, N>& to) {
  std::size_t n = 0;
  for (const char c : from) {
    if (n + 1 == N) break;
    if (c != '"' && c != '\\' && static_cast<unsigned char>(c) >= ' ') to[n++] = c;
  }
  to[n] = '\0';
}

}  // namespace

ServiceStatus::ServiceStatus(std::string_view works_on)
    : file_(status_path()), works_on_(works_on), started_(utc_date_text()) {
  // A quarter of the interval: a turn that is late by half of it is no hang.
  if (const std::int64_t us = watchdog_us(); us > 0 && manager_.present())
    watchdog_.emplace(manager_, Duration{us * 1000 / 4});
  std::replace_if(works_on_.begin(), works_on_.end(), [](char c) { return c == '"' || c == '\\'; }, ' ');
}

void ServiceStatus::state(std::string_view name, bool ready) {
  take(name, state_);
  take("", text_);  // of the state before
  if (ready && !told_ready_) told_ready_ = manager_.send("READY=1");
  publish();
}

void ServiceStatus::text(std::string_view line) {
  take(line, text_);
  publish();
}

void ServiceStatus::fault(Fault fault) {
  fault_ = static_cast<int>(fault);
  publish();
}

void ServiceStatus::missing(std::span<const MissingDevice> devices) {
  std::size_t used = 0;
  for (const MissingDevice& device : devices) {
    std::array<char, 96> which{};
    std::array<char, 240> what{}, remedy{};
    take(device.report->device, which);
    take(device.report->detail, what);
    take(device.report->remedy, remedy);
    const std::size_t room = missing_.size() - used;
    const auto end = fmt::format_to_n(missing_.data() + used, room,
                                      "{}{{\"role\": \"{}\", \"device\": \"{}\", \"state\": \"{}\", \"what\": \"{}\", "
                                      "\"remedy\": \"{}\"}}",
                                      used == 0 ? "" : ", ", device.role, which.data(),
                                      hal::name_of(device.report->state), what.data(), remedy.data());
    if (end.size >= room) break;  // half an element is none
    used += end.size;
  }
  missing_[used] = '\0';
  publish();
}

void ServiceStatus::ending(Duration allowed) {
  std::array<char, 64> message;
  const auto end = fmt::format_to_n(message.data(), message.size(), "WATCHDOG_USEC={}",
                                    static_cast<std::int64_t>(allowed.seconds() * 1e6));
  (void)manager_.send({message.data(), std::min(end.size, message.size())});
}

void ServiceStatus::publish() {
  if (manager_.present()) {
    std::array<char, 256> message;
    const auto end = fmt::format_to_n(message.data(), message.size(), "STATUS={}: {}", state_.data(), text_.data());
    (void)manager_.send({message.data(), std::min(end.size, message.size())});
  }
  if (!file_.present()) return;
  std::array<char, 1024 + std::tuple_size_v<decltype(missing_)>> json;
  const auto end =
      fmt::format_to_n(json.data(), json.size(),
                       "{{\"state\": \"{}\", \"text\": \"{}\", \"fault\": {}, \"works_on\": \"{}\", "
                       "\"started\": \"{}\", \"pid\": {}, \"missing\": [{}]}}\n",
                       state_.data(), text_.data(), fault_, works_on_, started_, getpid(), missing_.data());
  if (end.size <= json.size()) (void)file_.write({json.data(), end.size});
}

}  // namespace firstlook
