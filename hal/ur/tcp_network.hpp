/// The driver's network on TCP.
#pragma once

#include <array>
#include <string>

#include "hal/ur/network.hpp"
#include "platform/linux/tcp_stream.hpp"

namespace firstlook::ur {

struct TcpNetworkOptions {
  std::string host;     ///< of the controller
  int port_offset = 0;  ///< added to its ports 29999, 30001 and 30004: for simulated ones
  std::uint16_t program_port = 50002;
  std::uint16_t control_port = 50001;
};

class TcpNetwork final : public Network {
 public:
  /// Looks the host up and opens the doors. Error: kDeviceMissing for an unknown host or a port that cannot be had.
  [[nodiscard]] Status open(const TcpNetworkOptions& options);
  /// This computer's address as the controller sees it. Error: kDeviceMissing when there is no way to it.
  [[nodiscard]] Result<std::string> own_address() const;

  [[nodiscard]] LinkId dial(Service service) override;
  [[nodiscard]] LinkId accept(Door door) override;
  [[nodiscard]] LinkState state(LinkId link) override;
  [[nodiscard]] std::string_view receive(LinkId link, std::span<char> room) override;
  bool send(LinkId link, std::string_view bytes) override;
  void close(LinkId link) override;

 private:
  struct Slot {
    TcpStream stream;
    bool taken = false;
  };
  [[nodiscard]] LinkId take(TcpStream&& stream);

  TcpAddress controller_;
  int port_offset_ = 0;
  TcpListener program_, control_;
  std::array<Slot, kLinksMax> slots_;
};

}  // namespace firstlook::ur
