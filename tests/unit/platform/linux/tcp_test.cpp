#include "platform/linux/tcp.hpp"

#include <catch2/catch.hpp>

#include "platform/linux/wakeup.hpp"

namespace firstlook {
namespace {

/// Two ends in one process: whatever connects is kept, whatever comes is collected.
struct Collected final : TcpEvents {
  std::vector<TcpId> accepted, dialled, gone;
  std::map<TcpId, std::string> received_bytes;

  void opened(TcpId connection, TcpId listener) override { (listener == 0 ? dialled : accepted).push_back(connection); }
  void received(TcpId connection, std::string_view bytes) override { received_bytes[connection].append(bytes); }
  void closed(TcpId connection) override { gone.push_back(connection); }
};

/// Polls until the condition holds; 20 s are for a computer that is busy with other things.
template <typename Condition>
bool poll_until(Tcp& tcp, Collected& events, const Condition& condition, const std::vector<TcpId>& writable = {}) {
  const std::int64_t limit_ns = monotonic_ns() + 20'000'000'000;
  while (!condition() && monotonic_ns() < limit_ns) tcp.poll(monotonic_ns() + 50'000'000, writable, events);
  return condition();
}

}  // namespace

TEST_CASE("TCP connects, carries bytes both ways and tells of the end", "[tcp]") {
  Tcp tcp;
  Collected events;
  const Result<TcpId> listener = tcp.listen("127.0.0.1", 0);
  REQUIRE(listener);
  const std::uint16_t port = tcp.port_of(*listener);
  REQUIRE(port != 0);
  const Result<TcpId> client = tcp.dial("127.0.0.1", port);
  REQUIRE(client);
  REQUIRE(poll_until(tcp, events, [&] { return !events.accepted.empty() && !events.dialled.empty(); }));
  CHECK(events.dialled[0] == *client);
  std::string request = "request", answer = "answer";
  CHECK(tcp.send(*client, request));
  CHECK(request.empty());
  CHECK(tcp.send(events.accepted[0], answer));
  CHECK(poll_until(tcp, events, [&] {
    return events.received_bytes[events.accepted[0]] == "request" && events.received_bytes[*client] == "answer";
  }));
  tcp.close(*client);
  CHECK(poll_until(tcp, events, [&] { return !events.gone.empty(); }));
  CHECK(events.gone == std::vector<TcpId>{events.accepted[0]});  // not of our own close
  std::string more = "x";
  CHECK_FALSE(tcp.send(*client, more));
  CHECK(more == "x");
}

TEST_CASE("a peer that does not read stops a sender without blocking it", "[tcp]") {
  Tcp tcp;
  Collected events;
  const TcpId listener = *tcp.listen("127.0.0.1", 0);
  const TcpId client = *tcp.dial("127.0.0.1", tcp.port_of(listener));
  REQUIRE(poll_until(tcp, events, [&] { return !events.accepted.empty() && !events.dialled.empty(); }));
  std::string bytes(64 << 20, 'x');
  for (int i = 0; i < 100; ++i) REQUIRE(tcp.send(client, bytes));
  CHECK_FALSE(bytes.empty());
  const std::size_t all = std::size_t{64} << 20;
  const TcpId server = events.accepted[0];
  // Once it reads, everything arrives.
  CHECK(poll_until(tcp, events,
                   [&] {
                     static_cast<void>(tcp.send(client, bytes));
                     return events.received_bytes[server].size() == all;
                   },
                   {client}));
}

TEST_CASE("a peer that does not read hears of an abort", "[tcp]") {
  Tcp tcp;
  Collected events;
  const TcpId listener = *tcp.listen("127.0.0.1", 0);
  const TcpId client = *tcp.dial("127.0.0.1", tcp.port_of(listener));
  REQUIRE(poll_until(tcp, events, [&] { return !events.accepted.empty() && !events.dialled.empty(); }));
  tcp.abort(client);
  CHECK(poll_until(tcp, events, [&] { return !events.gone.empty(); }));
  CHECK(events.gone == std::vector<TcpId>{events.accepted[0]});
}

TEST_CASE("what cannot be listened on or dialled is an error with its cause", "[tcp]") {
  Tcp tcp;
  Collected events;
  const TcpId listener = *tcp.listen("127.0.0.1", 0);
  const std::uint16_t port = tcp.port_of(listener);
  const Result<TcpId> again = tcp.listen("127.0.0.1", port);
  REQUIRE_FALSE(again);
  CHECK(again.error().fault == Fault::kDeviceMissing);
  CHECK_THAT(std::string(again.error().detail()), Catch::Matchers::Contains("in use"));
  CHECK_FALSE(tcp.listen("192.0.2.7", 0));
  tcp.close(listener);
  const Result<TcpId> refused = tcp.dial("127.0.0.1", port);
  const bool told = !refused || poll_until(tcp, events, [&] { return !events.gone.empty(); });
  CHECK(told);
  CHECK(events.dialled.empty());
}

}  // namespace firstlook
