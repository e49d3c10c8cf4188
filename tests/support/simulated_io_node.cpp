#include "tests/support/simulated_io_node.hpp"

#include <sstream>

namespace firstlook::test {
namespace {

std::uint64_t number_of(std::string text, unsigned node) {
  std::uint64_t sum = 0;
  std::istringstream parts(text);
  for (std::string part; std::getline(parts, part, '+');) {
    sum += part == "$NODEID" ? node : std::stoull(part, nullptr, 0);
  }
  return sum;
}

unsigned bytes_of(const std::string& type) {
  if (type == "0x0001" || type == "0x0005") return 1;
  return type == "0x0006" ? 2 : 4;
}

/// "1018sub2" or "6005"; empty for the sections that are no entries.
std::optional<SimulatedIoNode::Address> address_of(const std::string& section) {
  const auto sub = section.find("sub");
  const std::string index = section.substr(0, sub);
  if (index.size() != 4 || index.find_first_not_of("0123456789ABCDEF") != std::string::npos) return {};
  const unsigned n =
      sub == std::string::npos ? 0 : static_cast<unsigned>(std::stoul(section.substr(sub + 3), nullptr, 16));
  return SimulatedIoNode::Address{static_cast<unsigned>(std::stoul(index, nullptr, 16)), n};
}

}  // namespace

SimulatedIoNode::SimulatedIoNode(const std::string& sheet, unsigned number) : number_(number) {
  std::istringstream lines(sheet);
  std::string section;
  std::map<std::string, std::string> keys;
  const auto finish = [&] {
    const auto address = address_of(section);
    if (address && keys.contains("DataType")) {
      const std::string access = keys["AccessType"];
      entries_[*address] = {number_of(keys["DefaultValue"], number), bytes_of(keys["DataType"]), access != "ro"};
    }
    keys.clear();
  };
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with('[')) {
      finish();
      section = line.substr(1, line.find(']') - 1);
    } else if (const auto equals = line.find('='); equals != std::string::npos && !line.starts_with(';')) {
      keys[line.substr(0, equals)] = line.substr(equals + 1);
    }
  }
  finish();
  as_delivered_ = entries_;
}

void SimulatedIoNode::power(bool on) {
  if (on) {
    reboot_ = true;
  } else {
    state_ = kOff;
    reboot_ = false;
    lamps_ = 0;
  }
}

/// Writable entries are as delivered again; what a test has set stays, as the rest of the module does.
void SimulatedIoNode::boot() {
  for (auto& [address, entry] : entries_) {
    if (entry.writable) entry.value = as_delivered_.at(address).value;
  }
  state_ = kBooting;
  ready_ = now_ + milliseconds(50);
  lamps_ = 0;
  sent_inputs_.reset();
  master_heard_.reset();
  misses_master_ = false;
}

void SimulatedIoNode::say(unsigned id, const std::vector<unsigned>& bytes) {
  can_frame frame{};
  frame.can_id = id;
  frame.len = static_cast<std::uint8_t>(bytes.size());
  for (std::size_t i = 0; i < bytes.size(); ++i) frame.data[i] = static_cast<std::uint8_t>(bytes[i]);
  out_.push_back(frame);
}

void SimulatedIoNode::answer_sdo(const can_frame& frame) {
  const unsigned index = frame.data[1] | frame.data[2] << 8U, sub = frame.data[3];
  const Address address{index, sub};
  touched_.insert(address);
  const auto reply = [&](unsigned command, std::uint64_t value) {
    std::vector<unsigned> bytes{command, frame.data[1], frame.data[2], sub};
    for (unsigned i = 0; i < 4; ++i) bytes.push_back(static_cast<unsigned>(value >> (8 * i)) & 0xFF);
    say(0x580 + number_, bytes);
  };
  if (never_answered == address) return;
  if (ignored_sdo > 0) {
    --ignored_sdo;
    return;
  }
  const auto found = entries_.find(address);
  if (frame.data[0] == 0x80) return;
  if (found == entries_.end()) {
    const bool known = entries_.lower_bound({index, 0}) != entries_.lower_bound({index + 1, 0});
    reply(0x80, known ? 0x06090011 : 0x06020000);
    return;
  }
  Entry& entry = found->second;
  if (frame.data[0] == 0x40) {
    if (segmented == address) {
      reply(0x41, 24);
      return;
    }
    const bool inputs = index == 0x6000 && sub > 0;
    const std::uint64_t value = inputs ? inputs_ >> (8 * (sub - 1)) & 0xFF : entry.value;
    reply(0x43U | (4 - entry.bytes) << 2U, value);
    return;
  }
  if ((frame.data[0] & 0xE3U) != 0x23) {
    reply(0x80, 0x05040001);
    return;
  }
  const unsigned size = 4 - (frame.data[0] >> 2U & 3U);
  std::uint64_t value = 0;
  for (unsigned i = 0; i < size; ++i) value |= std::uint64_t{frame.data[4 + i]} << (8 * i);
  const bool pdo_parameter = (index >= 0x1400 && index < 0x1C00);
  const unsigned parameters = index >= 0x1A00                     ? index - 0x200
                              : index >= 0x1600 && index < 0x1800 ? index - 0x200
                                                                  : index;
  if (!entry.writable) {
    reply(0x80, 0x06010002);
  } else if (size != entry.bytes) {
    reply(0x80, 0x06070010);
  } else if (pdo_parameter && parameters != index && (entries_.at({parameters, 1}).value & 0x80000000) == 0) {
    reply(0x80, 0x08000022);  // a PDO is mapped while it is off
  } else if (pdo_parameter && parameters != index && sub > 0 && entries_.at({index, 0}).value != 0) {
    reply(0x80, 0x08000022);  // and while it has no entries
  } else {
    entry.value = value;
    reply(0x60, 0);
  }
}

void SimulatedIoNode::receive(const can_frame& frame, Instant now) {
  now_ = now;
  if (state_ == kOff || state_ == kBooting) return;
  const unsigned id = frame.can_id;
  if (id == 0 && frame.len == 2 && (frame.data[1] == 0 || frame.data[1] == number_)) {
    switch (frame.data[0]) {
      case 0x01:
        state_ = kOperational;
        sent_inputs_.reset();
        next_heartbeat_ = now;
        break;
      case 0x02:
        state_ = kStopped;
        break;
      case 0x80:
        state_ = kPreOperational;
        break;
      case 0x81:
      case 0x82:
        ++resets_;
        boot();
        break;
      default:
        break;
    }
  } else if (id == 0x600 + number_ && frame.len == 8 && state_ != kStopped) {
    answer_sdo(frame);
  } else if (state_ == kOperational && id == (entries_.at({0x1400, 1}).value & 0xBFFFFFFF) && frame.len >= 1) {
    lamps_ = 0;
    for (unsigned i = 0; i < frame.len && i < 4; ++i) lamps_ |= static_cast<unsigned>(frame.data[i]) << (8 * i);
  } else if (entries_.contains({0x1016, 1}) && id == 0x700 + (entries_.at({0x1016, 1}).value >> 16 & 0x7F) &&
             frame.len == 1) {
    master_heard_ = now;
  }
}

void SimulatedIoNode::watch_master(Instant now) {
  if (!entries_.contains({0x1016, 1}) || !master_heard_) return;
  const auto limit = milliseconds(static_cast<std::int64_t>(entries_.at({0x1016, 1}).value & 0xFFFF));
  if (limit.ns == 0 || now - *master_heard_ <= limit) return;
  misses_master_ = true;
  master_heard_.reset();
  if (state_ == kOperational) state_ = kPreOperational;
  lamps_ = 0;
  for (unsigned i = 0; entries_.contains({0x6207, i + 1}); ++i) {
    const std::uint64_t shown = entries_.at({0x6207, i + 1}).value & entries_.at({0x6206, i + 1}).value;
    lamps_ |= static_cast<unsigned>(shown) << (8 * i);
  }
}

void SimulatedIoNode::send_inputs(Instant now) {
  const std::uint64_t id = entries_.at({0x1800, 1}).value;
  const std::uint64_t count = entries_.at({0x1A00, 0}).value;
  if ((id & 0x80000000) != 0 || count == 0) return;
  const auto every = milliseconds(static_cast<std::int64_t>(entries_.at({0x1800, 5}).value));
  if (sent_inputs_ == inputs_ && (every.ns == 0 || now < next_inputs_)) return;
  sent_inputs_ = inputs_;
  next_inputs_ = now + every;
  std::vector<unsigned> bytes;
  for (unsigned i = 0; i < count; ++i) bytes.push_back(inputs_ >> (8 * i) & 0xFF);
  say(static_cast<unsigned>(id & 0x7FF), bytes);
}

std::vector<can_frame> SimulatedIoNode::turn(Instant now) {
  now_ = now;
  if (reboot_) {
    reboot_ = false;
    boot();
  }
  if (state_ == kBooting && now >= ready_) {
    state_ = kPreOperational;
    say(0x700 + number_, {0});
    next_heartbeat_ = now;
  }
  if (state_ != kOff && state_ != kBooting) {
    watch_master(now);
    const auto found = entries_.find({0x1017, 0});
    const auto period = milliseconds(found == entries_.end() ? 0 : static_cast<std::int64_t>(found->second.value));
    if (period.ns > 0 && now >= next_heartbeat_) {
      next_heartbeat_ = now + period;
      say(0x700 + number_, {state_});
    }
    if (state_ == kOperational) send_inputs(now);
  }
  std::vector<can_frame> out = std::move(out_);
  out_.clear();
  if (mute) out.clear();
  return out;
}

}  // namespace firstlook::test
