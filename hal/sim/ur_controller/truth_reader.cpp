#include "hal/sim/ur_controller/truth_reader.hpp"

#include <algorithm>
#include <cstring>
#include <thread>

#include "hal/sim/ur_controller/truth_session.hpp"
#include "hal/sim/ur_controller/wire.hpp"
#include "platform/linux/wakeup.hpp"
#include "platform/memory/allocation_guard.hpp"

namespace firstlook::sim::ur {
namespace {

constexpr std::int64_t kConnect_ns = 5'000'000'000;
constexpr std::chrono::milliseconds kLook(5);

std::unexpected<Error> no_truth() {
  return failure(Fault::kDeviceMissing, "the robot's simulation does not tell its true joints");
}

}  // namespace

bool TruthReader::fill() {
  std::memmove(bytes_.data(), bytes_.data() + begin_, end_ - begin_);
  end_ -= begin_;
  begin_ = 0;
  const std::size_t got = receive(std::span(bytes_).subspan(end_)).size();
  end_ += got;
  return got > 0;
}

bool TruthReader::read_head() {
  constexpr std::size_t kTable = kTruthHeadBytes - kTruthGreeting.size();
  static_cast<void>(fill());
  if (end_ < kTable) return false;
  WireReader wire(std::string_view(bytes_.data(), kTable));
  for (std::size_t j = 0; j < kJoints; ++j) {
    DhRow& row = dh_[j];
    for (double* value : {&row.theta_offset_rad, &row.d_m, &row.a_m, &row.alpha_rad}) *value = wire.f64();
  }
  begin_ = kTable;
  return true;
}

std::optional<TrueJointFeed::Sample> TruthReader::next() {
  if (end_ - begin_ < kTruthSampleBytes) static_cast<void>(fill());
  if (end_ - begin_ < kTruthSampleBytes) return std::nullopt;
  WireReader wire(std::string_view(bytes_.data() + begin_, kTruthSampleBytes));
  begin_ += kTruthSampleBytes;
  Sample sample{.there_s = wire.f64(), .joints_rad = JointVector::zero(6)};
  for (int j = 0; j < 6; ++j) sample.joints_rad[j] = wire.f64();
  sample.led = wire.u8() != 0;
  return sample;
}

void TruthReader::touched() { send(std::string_view(&kTouched, 1)); }

void TruthReader::lead(const JointVector& to_rad, double speed_rad_s, double acceleration_rad_s2) {
  const memory::SimulationScope simulation;
  send(lead_message(to_rad, speed_rad_s, acceleration_rad_s2));
}

Status TcpTruth::connect(TcpStream stream) {
  stream_ = std::move(stream);
  const std::int64_t until_ns = monotonic_ns() + kConnect_ns;
  while (!read_head()) {
    if (stream_.state() == TcpStream::State::kClosed || monotonic_ns() > until_ns) return no_truth();
    std::this_thread::sleep_for(kLook);
  }
  return {};
}

Status SteppedTruth::connect() {
  link_ = links_.dial(Port::kTruth);
  std::string greeting;
  const Instant until = links_.now() + Duration{kConnect_ns};
  while (greeting.size() < kTruthGreeting.size()) {
    if (!links_.health()) return links_.health();
    if (links_.now() > until) return no_truth();
    links_.step_to(links_.now() + milliseconds(1));
    std::array<char, kTruthGreeting.size()> room;
    greeting += receive(std::span(room).first(room.size() - greeting.size()));
  }
  return greeting == kTruthGreeting && read_head() ? Status{} : no_truth();
}

Result<PrivateChannel> connect_private_channel(const std::string& host, std::uint16_t port) {
  const Result<TcpAddress> address = look_up_tcp(host, port);
  if (!address) return std::unexpected(address.error());
  PrivateChannel channel;
  channel.stream.dial(*address);
  std::string greeting;
  const std::int64_t until_ns = monotonic_ns() + kConnect_ns;
  while (greeting.size() < kTruthGreeting.size()) {
    if (channel.stream.state() == TcpStream::State::kClosed || monotonic_ns() > until_ns) {
      return failure(Fault::kDeviceMissing,
                     "nobody tells the true joints at {}:{}: the cameras of a simulated cell need `firstlook ur-sim "
                     "--cell ...` there",
                     host, port);
    }
    std::array<char, kTruthGreeting.size()> room;
    const std::string_view came = channel.stream.receive(std::span(room).first(room.size() - greeting.size()));
    if (came.empty()) std::this_thread::sleep_for(kLook);
    greeting += came;
  }
  channel.lockstep = greeting == kLockstepGreeting;
  if (channel.lockstep || greeting == kTruthGreeting) return channel;
  return failure(Fault::kDeviceMissing, "{}:{} is no channel of `firstlook ur-sim`", host, port);
}

}  // namespace firstlook::sim::ur
