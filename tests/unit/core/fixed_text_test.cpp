#include "platform/core/fixed_text.hpp"

#include <catch2/catch.hpp>
#include <string>

using namespace firstlook;

TEST_CASE("a fixed text holds what fits and cuts the rest", "[fixed_text]") {
  FixedText<8> text;
  CHECK(text.empty());
  text.set("{}-{}", 12, "ab");
  CHECK(text.view() == "12-ab");
  text.set("{}", std::string(20, 'x'));
  CHECK(text.view() == "xxxxxxxx");
  text.set("{}", "y");
  CHECK(text.view() == "y");
  CHECK(FixedText<8>("y") == text);
  const std::string copy(text.view());
  text.set("{}{}", copy, copy);
  CHECK(text.view() == "yy");
  text.clear();
  CHECK(text.view().empty());
}
