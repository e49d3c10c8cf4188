#include "platform/linux/notify.hpp"

#include <catch2/catch.hpp>

#include "tests/support/service_socket.hpp"

using namespace firstlook;

TEST_CASE("messages reach the service manager, without one nothing happens") {
  const test::ServiceSocket manager;
  const ServiceManager service(manager.path().string());
  CHECK(service.present());
  CHECK(service.send("READY=1"));
  CHECK(manager.receive() == "READY=1");
  const ServiceManager nobody("");
  CHECK_FALSE(nobody.present());
  CHECK_FALSE(nobody.send("READY=1"));
  CHECK_FALSE(ServiceManager("relative/path").present());
  CHECK_FALSE(ServiceManager("/no/such/socket").present());
}

TEST_CASE("the watchdog is fed at most once in its interval") {
  const test::ServiceSocket manager;
  const ServiceManager service(manager.path().string());
  ServiceWatchdog watchdog(service, milliseconds(100));
  for (int turn = 0; turn < 25; ++turn) watchdog.feed(Instant{} + milliseconds(8) * turn);
  CHECK(manager.receive() == "WATCHDOG=1");
  CHECK(manager.receive() == "WATCHDOG=1");
  CHECK(manager.receive().empty());
}
