#include "hal/sim/ur_controller/script_feed.hpp"

#include <catch2/catch.hpp>

namespace firstlook {
using sim::ur::ScriptFeed;

namespace {
std::vector<std::string> programs(const std::string& sent, bool at_end = false) {
  ScriptFeed feed;
  std::vector<std::string> found;
  for (const char byte : sent) {
    feed.add(std::string_view(&byte, 1));
    while (auto program = feed.take()) found.push_back(*program);
  }
  while (auto program = feed.take(at_end)) found.push_back(*program);
  return found;
}
}  // namespace

TEST_CASE("lines and blocks are cut from a stream", "[ur]") {
  const std::string block = "def f():\n  if a(): # end\n  while x:\n  end\n  end\n  endless = 1\nend\n";
  CHECK(programs("\n# note\nmovej([0])\r\n" + block + "stop\n") ==
        std::vector<std::string>{"movej([0])\r\n", block, "stop\n"});
  CHECK(programs("sec s():\nthread t():\nend\nend\nx=1\n").size() == 2);
  CHECK(programs("def f():\n").empty());
  CHECK(programs("defx = 1\nend_of = 2\n").size() == 2);
  // Whole blocks on one line; words in strings are none.
  CHECK(programs("def f(): while x: y() end end\nx = 1\n").size() == 2);
  CHECK(programs("def f():\n  a(\"if # end\") if x: y() end\nend\nx = 1\n").size() == 2);
}

TEST_CASE("the last line may miss its end", "[ur]") {
  CHECK(programs("power on").empty());
  CHECK(programs("power on", true) == std::vector<std::string>{"power on"});
  CHECK(programs("def f():\nend", true) == std::vector<std::string>{"def f():\nend"});
  CHECK(programs("def f():", true).empty());
}

TEST_CASE("a program without an end does not grow for ever", "[ur]") {
  ScriptFeed feed;
  feed.add("def f():\n");
  for (int i = 0; i < 300; ++i) feed.add(std::string(4096, '#') + "\n");
  CHECK_FALSE(feed.take());
  CHECK(feed.overflown());
}

}  // namespace firstlook
