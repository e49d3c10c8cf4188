/// The message read back by rules of its own: ROS's wire formats byte by byte, YAML as text, the data by OctoMap.
#include "algorithms/mapping/octomap_message.hpp"

#include <cstring>

#include "octree_bytes.hpp"

namespace firstlook {
namespace {

struct Message {
  std::string frame_id, id, data;
  bool binary = false;
  double resolution_m = 0;
};

/// Numbers off a string; with `align` at multiples of their size.
class Wire {
 public:
  Wire(std::string_view bytes, bool align) : bytes_(bytes), align_(align) {}
  template <typename T>
  T get() {
    while (align_ && at_ % sizeof(T) != 0) REQUIRE(bytes_.at(at_++) == '\0');
    T value{};
    REQUIRE(at_ + sizeof(T) <= bytes_.size());
    std::memcpy(&value, bytes_.data() + at_, sizeof(T));
    at_ += sizeof(T);
    return value;
  }
  std::string take(std::size_t count) {
    REQUIRE(at_ + count <= bytes_.size());
    at_ += count;
    return std::string(bytes_.substr(at_ - count, count));
  }
  std::string text() {
    std::string text = take(get<std::uint32_t>());
    if (align_) {
      REQUIRE(text.back() == '\0');
      text.pop_back();
    }
    return text;
  }
  [[nodiscard]] bool at_end() const { return at_ == bytes_.size(); }

 private:
  std::string_view bytes_;
  bool align_;
  std::size_t at_ = 0;
};

Message read_rest(Wire& wire) {
  Message m;
  m.frame_id = wire.text();
  m.binary = wire.get<std::uint8_t>() != 0;
  m.id = wire.text();
  m.resolution_m = wire.get<double>();
  m.data = wire.take(wire.get<std::uint32_t>());
  CHECK(wire.at_end());
  return m;
}

Message read_ros1(const std::string& bytes) {
  Wire wire(bytes, false);
  for (int i = 0; i < 3; ++i) CHECK(wire.get<std::uint32_t>() == 0);
  return read_rest(wire);
}

Message read_ros2(const std::string& bytes) {
  REQUIRE(bytes.substr(0, 4) == std::string("\0\1\0\0", 4));
  Wire wire(std::string_view(bytes).substr(4), true);
  for (int i = 0; i < 2; ++i) CHECK(wire.get<std::uint32_t>() == 0);
  return read_rest(wire);
}

std::string value_of(const std::string& yaml, const std::string& key) {
  const std::size_t at = yaml.find("\n" + key + ": ") + key.size() + 3;
  return yaml.substr(at, yaml.find('\n', at) - at);
}

Message read_yaml(const std::string& yaml) {
  Message m{value_of(yaml, "  frame_id"),
            value_of(yaml, "id"),
            {},
            value_of(yaml, "binary") == "true",
            std::stod(value_of(yaml, "resolution"))};
  std::istringstream list(value_of(yaml, "data"));
  CHECK(list.get() == '[');
  for (std::string word; std::getline(list, word, ',');) {
    const int value = std::stoi(word);
    REQUIRE((value >= -128 && value <= 127));
    m.data += static_cast<char>(value);
  }
  return m;
}

/// As octomap_msgs::msgToMap does.
std::unique_ptr<octomap::OcTree> tree_of(const Message& m) {
  CHECK(m.id == "OcTree");
  auto tree = std::make_unique<octomap::OcTree>(m.resolution_m);
  std::stringstream data(m.data);
  m.binary ? tree->readBinaryData(data) : tree->readData(data);
  CHECK(static_cast<std::size_t>(data.tellg()) == m.data.size());
  return tree;
}

}  // namespace

TEST_CASE("the octomap message comes back as the map in every form", "[mapping][octomap]") {
  Random random(21);
  const VoxelMap map = blocky_map(random);
  for (const ClassReading reading : {ClassReading{octomap_class}, ClassReading{nullptr}}) {
    const OctomapContent content{map, reading, 16, "base_link"};
    for (const Message& m : {read_ros1(collect([&](ByteSink sink) { write_octomap_ros1(content, sink); })),
                             read_ros2(collect([&](ByteSink sink) { write_octomap_ros2(content, sink); })),
                             read_yaml(collect([&](ByteSink sink) { write_octomap_yaml(content, sink); }))}) {
      CHECK(m.frame_id == "base_link");
      CHECK(m.binary == (reading != nullptr));
      CHECK(m.resolution_m == 0.05);
      const auto tree = tree_of(m);
      require_equal(map, *tree);
      if (reading == nullptr) CHECK(compare(map, *tree).log_odds_error_max < 1e-6);
    }
  }
}

}  // namespace firstlook
