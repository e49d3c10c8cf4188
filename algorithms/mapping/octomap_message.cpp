#include "algorithms/mapping/octomap_message.hpp"

#include <fmt/format.h>

#include <array>
#include <bit>
#include <concepts>
#include <string>

#include "algorithms/mapping/octree_writer.hpp"

namespace firstlook {
namespace {

static_assert(std::endian::native == std::endian::little, "numbers are written as the memory is");

constexpr std::string_view kId = "OcTree";

void write_data(const OctomapContent& content, ByteSink sink) {
  if (content.binary != nullptr)
    write_bt_nodes(content.map, content.binary, content.depth, sink);
  else
    write_ot_nodes(content.map, content.depth, sink);
}

/// Of the data, which a message says before it comes.
std::uint32_t data_bytes(const OctomapContent& content) {
  std::size_t bytes = 0;
  const auto count = [&bytes](std::span<const std::byte> piece) { bytes += piece.size(); };
  write_data(content, count);
  return static_cast<std::uint32_t>(bytes);
}

/// The members before the data, in one piece of memory.
class Members {
 public:
  /// @param aligned  CDR: each number begins at a multiple of its size
  explicit Members(bool aligned) : aligned_(aligned) {}

  template <typename Number>
    requires std::integral<Number> || std::floating_point<Number>
  void add(Number number) {
    while (aligned_ && bytes_.size() % sizeof(Number) != 0) bytes_ += '\0';
    const auto raw = std::bit_cast<std::array<char, sizeof(Number)>>(number);
    bytes_.append(raw.data(), raw.size());
  }
  void add_text(std::string_view text) {
    add(static_cast<std::uint32_t>(text.size() + (aligned_ ? 1 : 0)));
    bytes_ += text;
    if (aligned_) bytes_ += '\0';
  }
  [[nodiscard]] std::span<const std::byte> bytes() const { return std::as_bytes(std::span(bytes_)); }

 private:
  bool aligned_;
  std::string bytes_;
};

/// What follows the header's stamp is the same in both.
void write_rest(const OctomapContent& content, Members& members, ByteSink sink) {
  members.add_text(content.frame_id);
  members.add(static_cast<std::uint8_t>(content.binary != nullptr ? 1 : 0));
  members.add_text(kId);
  members.add(content.map.geometry().resolution_m);
  members.add(data_bytes(content));
  sink(members.bytes());
  write_data(content, sink);
}

}  // namespace

void write_octomap_yaml(const OctomapContent& content, ByteSink sink) {
  const auto write = [&sink](const std::string& text) { sink(std::as_bytes(std::span(text))); };
  write(
      fmt::format("# octomap_msgs/Octomap, written by firstlook: {}. To publish it:\n"
                  "#   rostopic pub -l -f FILE /octomap_{} octomap_msgs/Octomap\n"
                  "#   ros2 topic pub --yaml-file FILE /octomap_{} octomap_msgs/msg/Octomap\n"
                  "header:\n  frame_id: {}\nbinary: {}\nid: {}\nresolution: {}\ndata: [",
                  content.binary != nullptr ? "free and occupied" : "log-odds",
                  content.binary != nullptr ? "binary" : "full", content.binary != nullptr ? "binary" : "full",
                  content.frame_id, content.binary != nullptr, kId, content.map.geometry().resolution_m));
  bool first = true;
  const auto list = [&](std::span<const std::byte> piece) {
    std::string text;
    for (const std::byte byte : piece) {
      text += fmt::format("{}{}", first ? "" : ",", std::to_integer<int>(byte) - (byte > std::byte{127} ? 256 : 0));
      first = false;
    }
    write(text);
  };
  write_data(content, list);
  write("]\n");
}

void write_octomap_ros1(const OctomapContent& content, ByteSink sink) {
  Members members(false);
  for (int i = 0; i < 3; ++i) members.add(std::uint32_t{0});  // sequence number, seconds, nanoseconds
  write_rest(content, members, sink);
}

void write_octomap_ros2(const OctomapContent& content, ByteSink sink) {
  constexpr std::array<std::byte, 4> kLittleEndianCdr = {std::byte{0}, std::byte{1}, std::byte{0}, std::byte{0}};
  sink(kLittleEndianCdr);  // alignment counts from behind it
  Members members(true);
  for (int i = 0; i < 2; ++i) members.add(std::uint32_t{0});  // seconds, nanoseconds
  write_rest(content, members, sink);
}

}  // namespace firstlook
