/// What a service tells the outside: systemd by its socket, other programs by a file.
#include "app/shell/service_status.hpp"

#include <stdlib.h>  // NOLINT: setenv is POSIX
#include <unistd.h>

#include <array>
#include <catch2/catch.hpp>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <vector>

#include "platform/linux/files.hpp"
#include "platform/memory/allocation_guard.hpp"
#include "tests/support/service_socket.hpp"
#include "tests/support/temporary_folder.hpp"

namespace firstlook {
namespace {

/// The environment of a service, for the time of a test.
class Service {
 public:
  Service() {
    setenv("NOTIFY_SOCKET", socket.path().c_str(), 1);
    setenv("RUNTIME_DIRECTORY", folder.path().c_str(), 1);
    setenv("WATCHDOG_USEC", "2000000", 1);
    setenv("WATCHDOG_PID", std::to_string(getpid()).c_str(), 1);
  }
  ~Service() {
    for (const char* name : {"NOTIFY_SOCKET", "RUNTIME_DIRECTORY", "WATCHDOG_USEC", "WATCHDOG_PID"}) unsetenv(name);
  }
  Service(const Service&) = delete;
  Service& operator=(const Service&) = delete;
  [[nodiscard]] nlohmann::json status() const {
    return nlohmann::json::parse(read_text_file((folder.path() / "status.json").string(), 10'000).value());
  }
  test::ServiceSocket socket;
  test::TemporaryFolder folder{"firstlook-service"};
};

}  // namespace

TEST_CASE("a service has started when it is ready, once, and its state is in the file") {
  const Service service;
  ServiceStatus status("workshop \"2\"");
  status.state("Boot", false);
  CHECK(service.socket.receive() == "STATUS=Boot: ");
  status.state("Ready", true);
  CHECK(service.socket.receive() == "READY=1");
  CHECK(service.socket.receive() == "STATUS=Ready: ");
  status.text("ready: press \"Play\" on the pendant");
  CHECK(service.socket.receive() == "STATUS=Ready: ready: press Play on the pendant");
  CHECK(service.status()["state"] == "Ready");
  CHECK(service.status()["works_on"] == "workshop  2 ");
  CHECK(service.status()["pid"] == getpid());
  CHECK(service.status()["fault"] == 0);
  status.fault(Fault::kLinkLost);
  CHECK(service.status()["fault"] == 5002);
  status.text(std::string(1000, 'x'));
  CHECK(service.status()["text"].get<std::string>().size() > 100);
  status.state("Ready", true);
  for (std::string message = service.socket.receive(); !message.empty(); message = service.socket.receive())
    CHECK(message != "READY=1");
}

TEST_CASE("the file names every device that is missing, with its remedy, and stays where it is left") {
  const Service service;
  const std::string file = (service.folder.path() / "status.json").string();
  hal::DeviceReport panel;
  panel.state = hal::DeviceState::kLost;
  panel.device.set("can0 node 10");
  panel.detail.set("the interface \"can0\" is down");
  panel.remedy.set("ip link set can0 up");
  hal::DeviceReport camera;
  camera.state = hal::DeviceState::kMissing;
  {
    ServiceStatus status("robot");
    status.state("Ready", true);
    CHECK(service.status()["missing"].empty());
    const std::array<MissingDevice, 2> both{{{"panel", &panel}, {"colour camera", &camera}}};
    status.missing(both);
    const auto missing = service.status()["missing"];
    REQUIRE(missing.size() == 2);
    CHECK(missing[0]["role"] == "panel");
    CHECK(missing[0]["device"] == "can0 node 10");
    CHECK(missing[0]["state"] == "lost");
    CHECK(missing[0]["what"] == "the interface can0 is down");
    CHECK(missing[0]["remedy"] == "ip link set can0 up");
    CHECK(missing[1]["state"] == "missing");
    status.missing({});
    CHECK(service.status()["missing"].empty());
  }
  CHECK_FALSE(std::filesystem::exists(file));
  for (auto* text : {&panel.detail, &panel.remedy}) text->set("{}", std::string(1000, 'x'));
  ServiceStatus status("robot");
  const std::vector<MissingDevice> many(30, {"panel", &panel});
  status.missing(many);  // what does not fit is left out, the file stays whole
  CHECK(service.status()["missing"].size() >= 5);
  status.leave_file();
}

TEST_CASE("the watchdog is fed four times in the manager's interval, and not at all for another process") {
  const Service service;
  ServiceStatus status("empty");
  REQUIRE(status.watchdog() != nullptr);
  for (int turn = 0; turn <= 250; ++turn) status.watchdog()->feed(Instant{} + milliseconds(8) * turn);
  int fed = 0;
  while (service.socket.receive() == "WATCHDOG=1") ++fed;
  CHECK(fed == 4);
  status.ending(seconds(120));
  CHECK(service.socket.receive() == "WATCHDOG_USEC=120000000");
  setenv("WATCHDOG_PID", std::to_string(getpid() + 1).c_str(), 1);
  CHECK(ServiceStatus("empty").watchdog() == nullptr);
}

TEST_CASE("outside of a service nobody is told, and nothing is allocated either way") {
  ServiceStatus nobody("empty");
  CHECK(nobody.watchdog() == nullptr);
  const Service service;
  ServiceStatus somebody("empty");
  memory::seal();
  for (ServiceStatus* status : {&nobody, &somebody}) {
    status->state("Ready", true);
    status->text("looking around");
    status->fault(Fault::kLinkLost);
  }
  const auto allocations = memory::loop_allocations_after_seal();
  memory::unseal();
  CHECK(allocations == 0);
}

}  // namespace firstlook
