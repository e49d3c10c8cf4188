/// Frames against the bytes that CiA 301 shows, and whatever frames come.
#include "hal/can/canopen.hpp"

#include <linux/can/error.h>

#include <catch2/catch.hpp>
#include <vector>

#include "platform/core/random.hpp"

using namespace firstlook;
using namespace firstlook::can;

namespace {

can_frame frame(std::uint32_t id, const std::vector<std::uint8_t>& bytes) {
  can_frame f{};
  f.can_id = id;
  f.len = static_cast<std::uint8_t>(bytes.size());
  std::copy(bytes.begin(), bytes.end(), f.data);
  return f;
}

bool same(const can_frame& a, const can_frame& b) {
  return a.can_id == b.can_id && a.len == b.len && std::equal(a.data, a.data + a.len, b.data);
}

}  // namespace

TEST_CASE("requests are the bytes of CiA 301", "[can][codec]") {
  CHECK(same(nmt_command(NmtCommand::kStart, 5), frame(0, {0x01, 0x05})));
  CHECK(same(nmt_command(NmtCommand::kResetCommunication, 0), frame(0, {0x82, 0x00})));
  CHECK(same(heartbeat_frame({127, NmtState::kOperational}), frame(0x77F, {0x05})));
  CHECK(same(sdo_upload_request(5, {0x1018, 1}), frame(0x605, {0x40, 0x18, 0x10, 1, 0, 0, 0, 0})));
  CHECK(same(sdo_download_request(5, {0x1017, 0}, 1000, 2), frame(0x605, {0x2B, 0x17, 0x10, 0, 0xE8, 0x03, 0, 0})));
  CHECK(same(sdo_download_request(5, {0x6206, 1}, 0x1FF, 1), frame(0x605, {0x2F, 0x06, 0x62, 1, 0xFF, 0, 0, 0})));
  CHECK(same(sdo_download_request(5, {0x1A00, 1}, 0x60000108, 4),
             frame(0x605, {0x23, 0x00, 0x1A, 1, 0x08, 0x01, 0x00, 0x60})));
  CHECK(same(sdo_abort_request(5, {0x1A00, 1}, kAbortTimedOut),
             frame(0x605, {0x80, 0x00, 0x1A, 1, 0x00, 0x00, 0x04, 0x05})));
  CHECK(same(pdo_frame(kReceivePdo1Id, 5, 0x0302, 2), frame(0x205, {0x02, 0x03})));
}

TEST_CASE("answers are read as CiA 301 has them", "[can][codec]") {
  const auto four = read_sdo_answer(frame(0x585, {0x43, 0x00, 0x10, 0, 0x91, 0x01, 0x03, 0x00}));
  REQUIRE(four.has_value());
  CHECK(four->kind == SdoAnswer::Kind::kUploaded);
  CHECK(four->node == 5);
  CHECK(four->address == ObjectAddress{0x1000, 0});
  CHECK(four->value == 0x00030191);
  const auto one = read_sdo_answer(frame(0x585, {0x4F, 0x00, 0x60, 1, 0xA5, 0x77, 0x77, 0x77}));
  REQUIRE(one.has_value());
  CHECK(one->value == 0xA5);  // bytes beyond the size do not count
  CHECK(one->size == 1);
  CHECK(read_sdo_answer(frame(0x585, {0x60, 0x17, 0x10, 0, 0, 0, 0, 0}))->kind == SdoAnswer::Kind::kDownloaded);
  CHECK(read_sdo_answer(frame(0x585, {0x41, 0x08, 0x10, 0, 20, 0, 0, 0}))->kind == SdoAnswer::Kind::kSegmented);
  const auto abort = read_sdo_answer(frame(0x585, {0x80, 0x17, 0x10, 0, 0x02, 0x00, 0x01, 0x06}));
  REQUIRE(abort.has_value());
  CHECK(abort->kind == SdoAnswer::Kind::kAborted);
  CHECK(abort_text(abort->value) == "the entry can only be read");
  CHECK_FALSE(read_sdo_answer(frame(0x585, {0x60, 0x17, 0x10, 0})).has_value());
  CHECK_FALSE(read_sdo_answer(frame(0x580, {0x60, 0x17, 0x10, 0, 0, 0, 0, 0})).has_value());

  CHECK(read_heartbeat(frame(0x70A, {0x00}))->state == NmtState::kBootUp);
  CHECK(read_heartbeat(frame(0x70A, {0x85}))->state == NmtState::kOperational);  // with a toggle bit
  CHECK(read_heartbeat(frame(0x70A, {0x7F}))->node == 10);
  CHECK_FALSE(read_heartbeat(frame(0x70A, {0x33})).has_value());
  CHECK_FALSE(read_heartbeat(frame(0x70A, {0x05, 0x00})).has_value());
  CHECK_FALSE(read_heartbeat(frame(0x70A | CAN_RTR_FLAG, {0x05})).has_value());
  CHECK(read_emergency(frame(0x08A, {0x30, 0x81, 0x11, 0, 0, 0, 0, 0}))->code == 0x8130);
  CHECK(read_pdo(frame(0x18A, {0x0F}), kTransmitPdo1Id, 10, 1) == 0x0F);
  CHECK_FALSE(read_pdo(frame(0x18A, {}), kTransmitPdo1Id, 10, 1).has_value());
  CHECK_FALSE(read_pdo(frame(0x18B, {0x0F}), kTransmitPdo1Id, 10, 1).has_value());
}

TEST_CASE("a controller's errors are told from frames of the bus", "[can][codec]") {
  CHECK_FALSE(read_bus_error(frame(CAN_ERR_BUSOFF, {})).has_value());
  CHECK(read_bus_error(frame(CAN_ERR_FLAG | CAN_ERR_BUSOFF, std::vector<std::uint8_t>(8)))->bus_off);
  CHECK(read_bus_error(frame(CAN_ERR_FLAG | CAN_ERR_RESTARTED, std::vector<std::uint8_t>(8)))->restarted);
  const auto passive =
      read_bus_error(frame(CAN_ERR_FLAG | CAN_ERR_CRTL, {0, CAN_ERR_CRTL_TX_PASSIVE, 0, 0, 0, 0, 0, 0}));
  CHECK(passive->passive);
  CHECK_FALSE(passive->bus_off);
  const auto warning =
      read_bus_error(frame(CAN_ERR_FLAG | CAN_ERR_CRTL, {0, CAN_ERR_CRTL_TX_WARNING, 0, 0, 0, 0, 0, 0}));
  CHECK_FALSE(warning->passive);
}

TEST_CASE("a value that is written is what the node reads, for every size", "[can][codec]") {
  Random random(7);
  for (int i = 0; i < 2000; ++i) {
    const auto size = static_cast<std::uint8_t>(1 + random.bits() % 4);
    const auto value = static_cast<std::uint32_t>(random.bits());
    can_frame asked = sdo_download_request(9, {0x2000, 3}, value, size);
    // A node that echoes it as an upload.
    asked.can_id = kSdoAnswerId + 9;
    asked.data[0] = static_cast<std::uint8_t>((asked.data[0] & 0x1F) | 0x40);
    const auto answer = read_sdo_answer(asked);
    REQUIRE(answer.has_value());
    CHECK(answer->size == size);
    CHECK(answer->value == (size == 4 ? value : value & ((1U << (8 * size)) - 1)));
  }
}
