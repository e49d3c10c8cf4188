/// libFuzzer on everything that the UR driver reads from a network: no crash, no hang, no memory that grows.
/// The first byte says how the rest is read.
#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include "hal/ur/control_protocol.hpp"
#include "hal/ur/dashboard_client.hpp"
#include "hal/ur/identification.hpp"
#include "hal/ur/program_link.hpp"
#include "hal/ur/rtde_client.hpp"

namespace firstlook::ur {
namespace {

/// Every link brings the same bytes, in chunks, and then ends.
class FuzzedNetwork final : public Network {
 public:
  FuzzedNetwork(std::string_view bytes, std::size_t chunk) : chunk_(chunk) { left_.fill(bytes); }
  LinkId dial(Service) override { return take(); }
  LinkId accept(Door) override { return accepted_ < 4 ? (++accepted_, take()) : kNoLink; }
  LinkState state(LinkId link) override {
    return left_[static_cast<std::size_t>(link)].empty() ? LinkState::kClosed : LinkState::kOpen;
  }
  std::string_view receive(LinkId link, std::span<char> room) override {
    std::string_view& left = left_[static_cast<std::size_t>(link)];
    const std::string_view some = left.substr(0, std::min(room.size(), chunk_));
    std::copy(some.begin(), some.end(), room.begin());
    left.remove_prefix(some.size());
    return {room.data(), some.size()};
  }
  bool send(LinkId, std::string_view) override { return true; }
  void close(LinkId) override {}

 private:
  LinkId take() { return next_ < kLinksMax ? next_++ : kNoLink; }
  std::array<std::string_view, kLinksMax> left_;
  std::size_t chunk_;
  int next_ = 0, accepted_ = 0;
};

template <typename Poll>
void poll_often(Poll poll) {
  for (int i = 0; i < 40; ++i) poll(Instant{milliseconds(20 * i).ns});
}

}  // namespace
}  // namespace firstlook::ur

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace firstlook;
  using namespace firstlook::ur;
  if (size < 2) return 0;
  const std::string_view bytes(reinterpret_cast<const char*>(data) + 2, size - 2);
  FuzzedNetwork network(bytes, 1 + data[1] % 64);
  switch (data[0] % 7) {
    case 0: {
      RtdeClient client(network, 125);
      poll_often([&](Instant now) { static_cast<void>(client.poll(now)); });
      break;
    }
    case 1: {
      DashboardClient client(network);
      poll_often([&](Instant now) { static_cast<void>(client.poll(now)); });
      break;
    }
    case 2: {
      Identification identification(network);
      poll_often([&](Instant now) { static_cast<void>(identification.poll(now)); });
      break;
    }
    case 3: {
      ProgramLink link(network, "script", nullptr);
      poll_often([&](Instant now) {
        link.poll(now);
        while (link.take()) continue;
        link.show(bytes.substr(0, 300));
      });
      break;
    }
    case 4: {
      RtdeRecipe recipe;
      for (std::string_view rest = bytes;;) {
        const auto package = rtde_cut(rest);
        if (!package || !*package) break;
        const std::string_view payload = (*package)->payload;
        std::array<double, 6 * RtdeRecipe::kFieldsMax> values{};
        if (const auto found = rtde_recipe(2, payload, "a,b,c")) recipe = *found;
        static_cast<void>(rtde_values(recipe, payload, values));
        static_cast<void>(rtde_accepted(payload));
        static_cast<void>(rtde_version(payload));
        static_cast<void>(rtde_text(2, payload));
        rest.remove_prefix((*package)->bytes);
      }
      break;
    }
    case 5:
      for (std::string_view rest = bytes;;) {
        const auto packet = primary_cut(rest);
        if (!packet || !*packet) break;
        static_cast<void>(version_message(**packet));
        static_cast<void>(primary_state(**packet));
        rest.remove_prefix((*packet)->bytes);
      }
      break;
    default:
      static_cast<void>(cut_report(bytes));
  }
  return 0;
}
