#include "hal/sim/ur_controller/truth_reader.hpp"

#include <algorithm>
#include <cstring>
#include <thread>

#include "hal/sim/ur_controller/truth_session.hpp"
#include "hal/sim/ur_controller/wire.hpp"
#include "platform/linux/wakeup.hpp"

namespace firstlook::sim::ur {
namespace {
constexpr std::int64_t kConnect_ns = 5'000'000'000;
}

/// True when something came.
bool TruthReader::fill() {
  std::memmove(bytes_.data(), bytes_.data() + begin_, end_ - begin_);
  end_ -= begin_;
  begin_ = 0;
  const std::size_t got = stream_.receive(std::span(bytes_).subspan(end_)).size();
  end_ += got;
  return got > 0;
}

Status TruthReader::connect(const std::string& host, std::uint16_t port) {
  const Result<TcpAddress> address = look_up_tcp(host, port);
  if (!address) return std::unexpected(address.error());
  stream_.dial(*address);
  const std::int64_t until_ns = monotonic_ns() + kConnect_ns;
  while (end_ < kTruthHeadBytes) {
    if (stream_.state() == TcpStream::State::kClosed || monotonic_ns() > until_ns) {
      return failure(Fault::kDeviceMissing,
                     "nobody tells the true joints at {}:{}: the cameras of a simulated cell need `firstlook ur-sim "
                     "--cell ...` there",
                     host, port);
    }
    if (!fill()) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  if (std::string_view(bytes_.data(), kTruthGreeting.size()) != kTruthGreeting) {
    return failure(Fault::kDeviceMissing, "{}:{} is no channel of `firstlook ur-sim`", host, port);
  }
  WireReader wire(std::string_view(bytes_.data(), kTruthHeadBytes).substr(kTruthGreeting.size()));
  for (std::size_t j = 0; j < kJoints; ++j) {
    DhRow& row = dh_[j];
    for (double* value : {&row.theta_offset_rad, &row.d_m, &row.a_m, &row.alpha_rad}) *value = wire.f64();
  }
  begin_ = kTruthHeadBytes;
  return {};
}

std::optional<TrueJointFeed::Sample> TruthReader::next() {
  if (end_ - begin_ < kTruthSampleBytes) static_cast<void>(fill());
  if (end_ - begin_ < kTruthSampleBytes) return std::nullopt;
  WireReader wire(std::string_view(bytes_.data() + begin_, kTruthSampleBytes));
  begin_ += kTruthSampleBytes;
  Sample sample{wire.f64(), JointVector::zero(6)};
  for (int j = 0; j < 6; ++j) sample.joints_rad[j] = wire.f64();
  return sample;
}

void TruthReader::touched() { stream_.send(std::string_view(&kTouched, 1)); }

}  // namespace firstlook::sim::ur
