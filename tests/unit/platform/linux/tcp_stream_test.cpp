#include "platform/linux/tcp_stream.hpp"

#include <catch2/catch.hpp>

#include "platform/linux/wakeup.hpp"

namespace firstlook {
namespace {

/// Until the condition holds; 20 s are for a computer that is busy with other things.
template <typename Condition>
bool in_time(const Condition& condition) {
  const std::int64_t limit_ns = monotonic_ns() + 20'000'000'000;
  while (monotonic_ns() < limit_ns) {
    if (condition()) return true;
  }
  return false;
}

std::string read_some(TcpStream& stream, std::size_t count) {
  std::string all;
  std::array<char, 8> room;
  in_time([&] {
    all += stream.receive(room);
    return all.size() >= count || stream.state() == TcpStream::State::kClosed;
  });
  return all;
}

}  // namespace

TEST_CASE("a stream is dialled, carries bytes both ways, and ends", "[tcp]") {
  TcpListener listener;
  REQUIRE(listener.listen(0));
  REQUIRE(listener.port() != 0);
  CHECK(listener.accept().state() == TcpStream::State::kClosed);
  const auto address = look_up_tcp("127.0.0.1", listener.port());
  REQUIRE(address);
  CHECK(address_text(address->ipv4) == "127.0.0.1");
  CHECK(*own_address_towards(*address) == address->ipv4);
  TcpStream here, there;
  here.dial(*address);
  REQUIRE(in_time([&] {
    if (there.state() == TcpStream::State::kClosed) there = listener.accept();
    return here.state() == TcpStream::State::kOpen && there.state() == TcpStream::State::kOpen;
  }));
  CHECK(here.send("a longer request"));
  CHECK(read_some(there, 16) == "a longer request");
  CHECK(there.send("answer"));
  there.close();
  CHECK(read_some(here, 6) == "answer");  // what was sent before the end still comes
  CHECK(in_time([&] {
    std::array<char, 8> room;
    static_cast<void>(here.receive(room));
    return here.state() == TcpStream::State::kClosed;
  }));
  CHECK_FALSE(here.send("x"));
}

TEST_CASE("a port where nobody listens, and one that is taken", "[tcp]") {
  TcpListener listener, second;
  REQUIRE(listener.listen(0));
  const std::uint16_t port = listener.port();
  const Status taken = second.listen(port);
  REQUIRE_FALSE(taken);
  CHECK(taken.error().fault == Fault::kDeviceMissing);
  listener.close();
  TcpStream stream;
  stream.dial({0x7f000001, port});
  CHECK(in_time([&] { return stream.state() == TcpStream::State::kClosed; }));
  CHECK_FALSE(look_up_tcp("no.such.host.invalid", 1));
}

TEST_CASE("a peer that does not read ends the stream instead of blocking it", "[tcp]") {
  TcpListener listener;
  REQUIRE(listener.listen(0));
  TcpStream here, there;
  here.dial({0x7f000001, listener.port()});
  REQUIRE(in_time([&] {
    if (there.state() == TcpStream::State::kClosed) there = listener.accept();
    return here.state() == TcpStream::State::kOpen && there.state() == TcpStream::State::kOpen;
  }));
  const std::string block(64 * 1024, 'x');
  CHECK(in_time([&] { return !here.send(block); }));
  CHECK(here.state() == TcpStream::State::kClosed);
}

}  // namespace firstlook
