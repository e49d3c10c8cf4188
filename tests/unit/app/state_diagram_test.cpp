#include <catch2/catch.hpp>
#include <fstream>
#include <sstream>

#include "app/machine/state_table.hpp"

namespace firstlook {

TEST_CASE("the diagram of the state table is the one that is checked in", "[machine]") {
  std::ifstream file(FIRSTLOOK_SOURCE_DIR "/tests/unit/app/states.mmd");
  std::stringstream text;
  text << file.rdbuf();
  INFO("renew it with: build/release/firstlook states > tests/unit/app/states.mmd");
  CHECK(text.str() == state_diagram());
}

}  // namespace firstlook
