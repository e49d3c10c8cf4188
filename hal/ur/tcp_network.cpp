#include "hal/ur/tcp_network.hpp"

namespace firstlook::ur {
namespace {

int port_of(Service service) {
  switch (service) {
    case Service::kDashboard:
      return 29999;
    case Service::kPrimary:
      return 30001;
    case Service::kRtde:
      return 30004;
  }
  return 0;
}

}  // namespace

Status TcpNetwork::open(const TcpNetworkOptions& options) {
  const Result<TcpAddress> found = look_up_tcp(options.host, 0);
  if (!found) return std::unexpected(found.error());
  controller_ = *found;
  port_offset_ = options.port_offset;
  if (const Status status = program_.listen(options.program_port); !status) return status;
  return control_.listen(options.control_port);
}

Result<std::string> TcpNetwork::own_address() const {
  TcpAddress peer = controller_;
  peer.port = static_cast<std::uint16_t>(port_of(Service::kRtde) + port_offset_);
  const Result<std::uint32_t> own = own_address_towards(peer);
  if (!own) return std::unexpected(own.error());
  return address_text(*own);
}

LinkId TcpNetwork::take(TcpStream&& stream) {
  for (int i = 0; i < kLinksMax; ++i) {
    Slot& slot = slots_[static_cast<std::size_t>(i)];
    if (slot.taken) continue;
    slot.stream = std::move(stream);
    slot.taken = true;
    return i;
  }
  return kNoLink;
}

LinkId TcpNetwork::dial(Service service) {
  TcpStream stream;
  stream.dial({controller_.ipv4, static_cast<std::uint16_t>(port_of(service) + port_offset_)});
  return take(std::move(stream));
}

LinkId TcpNetwork::accept(Door door) {
  TcpStream stream = (door == Door::kProgram ? program_ : control_).accept();
  return stream.state() == TcpStream::State::kOpen ? take(std::move(stream)) : kNoLink;
}

LinkState TcpNetwork::state(LinkId link) {
  switch (slots_[static_cast<std::size_t>(link)].stream.state()) {
    case TcpStream::State::kConnecting:
      return LinkState::kConnecting;
    case TcpStream::State::kOpen:
      return LinkState::kOpen;
    case TcpStream::State::kClosed:
      break;
  }
  return LinkState::kClosed;
}

std::string_view TcpNetwork::receive(LinkId link, std::span<char> room) {
  return slots_[static_cast<std::size_t>(link)].stream.receive(room);
}

bool TcpNetwork::send(LinkId link, std::string_view bytes) {
  return slots_[static_cast<std::size_t>(link)].stream.send(bytes);
}

void TcpNetwork::close(LinkId link) {
  Slot& slot = slots_[static_cast<std::size_t>(link)];
  slot.stream.close();
  slot.taken = false;
}

}  // namespace firstlook::ur
