#include "platform/loop/event.hpp"

#include <catch2/catch.hpp>

using namespace firstlook;

TEST_CASE("the queue keeps order around its end and refuses the 65th event") {
  EventQueue queue;
  std::uint32_t in = 0;
  std::uint32_t out = 0;
  const auto push = [&] {
    const Status status = queue.push(Instant{in}, 16, std::as_bytes(std::span(&in, 1)));
    if (status) ++in;
    return status;
  };
  const auto pop = [&] {
    std::uint32_t value = 0;
    REQUIRE(queue.front().size == sizeof value);
    std::memcpy(&value, queue.front().payload.data(), sizeof value);
    CHECK(value == out);
    CHECK(queue.front().time == Instant{out});
    queue.pop();
    ++out;
  };
  for (int round = 0; round < 3; ++round) {
    while (!queue.full()) REQUIRE(push());
    const Status refused = push();
    REQUIRE_FALSE(refused);
    CHECK(refused.error().fault == Fault::kQueueFull);
    for (int i = 0; i < 40; ++i) pop();
  }
  while (!queue.empty()) pop();
  CHECK(in == out);
}

TEST_CASE("head and body of a payload stand one after the other") {
  EventQueue queue;
  const std::array head = {std::byte{1}, std::byte{2}};
  const std::array body = {std::byte{3}};
  REQUIRE(queue.push(Instant{5}, 20, head, body));
  const auto bytes = queue.front().bytes();
  REQUIRE(bytes.size() == 3);
  CHECK(bytes[0] == std::byte{1});
  CHECK(bytes[2] == std::byte{3});
}
