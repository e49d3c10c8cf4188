#include "platform/linux/process.hpp"

#include <catch2/catch.hpp>
#include <csignal>
#include <string>

using namespace firstlook;

TEST_CASE("resident memory is a plausible number") {
  CHECK(resident_bytes() > (std::size_t{1} << 20));
  CHECK(resident_bytes() < (std::size_t{1} << 34));
}

TEST_CASE("the first stop signal sets the flag and leaves the default action for the second") {
  catch_stop_signals();
  CHECK_FALSE(stop_signal_received());
  REQUIRE(std::raise(SIGTERM) == 0);
  CHECK(stop_signal_received());
  struct sigaction now{};
  REQUIRE(sigaction(SIGTERM, nullptr, &now) == 0);
  CHECK(now.sa_handler == SIG_DFL);
  std::signal(SIGINT, SIG_DFL);
  std::signal(SIGPIPE, SIG_DFL);
}

TEST_CASE("dates have their forms") {
  const auto shape = [](std::string text) {
    for (char& c : text) {
      if (c >= '0' && c <= '9') c = '0';
    }
    return text;
  };
  CHECK(shape(utc_date_text()) == "0000-00-00T00:00:00Z");
  CHECK(shape(utc_date_for_name()) == "00000000-000000");
}
