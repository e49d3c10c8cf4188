/// How the driver reaches a controller and is reached by its programs: byte streams, on TCP or in memory.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

#include "hal/ur/bytes.hpp"

namespace firstlook::ur {

/// What a controller serves.
enum class Service : std::uint8_t { kDashboard, kPrimary, kRtde };
/// What this computer serves to programs on the pendant: the text of our program, and the commands that it obeys.
enum class Door : std::uint8_t { kProgram, kControl };

enum class LinkState : std::uint8_t { kClosed, kConnecting, kOpen };
using LinkId = int;
inline constexpr LinkId kNoLink = -1;
inline constexpr int kLinksMax = 12;  ///< at once

/// Nothing here blocks or allocates; all from one thread.
class Network {
 public:
  virtual ~Network() = default;
  /// Begins to connect. kNoLink: all links are taken.
  [[nodiscard]] virtual LinkId dial(Service service) = 0;
  /// Who waits at the door next; kNoLink: nobody.
  [[nodiscard]] virtual LinkId accept(Door door) = 0;
  [[nodiscard]] virtual LinkState state(LinkId link) = 0;
  /// Takes what has come, as much as there is room for; empty: nothing now, or closed.
  [[nodiscard]] virtual std::string_view receive(LinkId link, std::span<char> room) = 0;
  /// All or nothing; false: the link is closed now.
  virtual bool send(LinkId link, std::string_view bytes) = 0;
  /// The link is gone, its number free.
  virtual void close(LinkId link) = 0;
};

/// Puts what a link has brought behind what waits.
template <std::size_t N>
void receive_into(Inbox<N>& inbox, Network& network, LinkId link) {
  while (true) {
    const std::span<char> room = inbox.room();
    if (room.empty()) return;
    const std::string_view came = network.receive(link, room);
    if (came.empty()) return;
    inbox.came(came.size());
  }
}

}  // namespace firstlook::ur
