#include "app/campaign/cell_list.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <numeric>

namespace firstlook {

TEST_CASE("shards have every cell once", "[app][campaign]") {
  for (const int cells : {1, 2, 7, 100}) {
    for (const int count : {1, 2, 3, 8, 150}) {
      CellList list;
      list.cells = cells;
      std::vector<int> all;
      for (int number = 1; number <= count; ++number) {
        const Shard shard{number, count};
        for (const int index : list.indices(shard)) {
          CHECK(shard.has(index));
          CHECK(index % count == number - 1);
          all.push_back(index);
        }
      }
      std::ranges::sort(all);
      std::vector<int> expected(static_cast<std::size_t>(cells));
      std::iota(expected.begin(), expected.end(), 0);
      CHECK(all == expected);
    }
  }
}

TEST_CASE("a shard is I/N and nothing else", "[app][campaign]") {
  CHECK(parse_shard("2/4").value() == Shard{2, 4});
  CHECK(parse_shard("2/4").value().text() == "2/4");
  CHECK(parse_shard("1/1").value().whole());
  for (const char* text :
       {"", "5/4", "0/4", "-1/4", "1/0", "1", "1/", "/4", "1/4/2", "1 /4", "a/4", "1/4x", "1/99999"}) {
    INFO(text);
    const auto shard = parse_shard(text);
    REQUIRE_FALSE(shard);
    CHECK(shard.error().fault == Fault::kUsage);
  }
}

TEST_CASE("the command of a cell is the contract's", "[app][campaign]") {
  CHECK(run_command(7, "") == "firstlook run --cell random:7 --seed 7 --sensor fast --workers 1");
  CHECK(run_command(7, "depth.drop=0.1") ==
        "firstlook run --cell random:7 --seed 7 --sensor fast --workers 1 --faults depth.drop=0.1");
  const auto words = run_arguments(7, "", "a folder");
  CHECK(words.front() == "run");
  CHECK(words.back() == "a folder");
  CHECK(words[words.size() - 2] == "--out");
}

}  // namespace firstlook
