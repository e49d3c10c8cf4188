/// `firstlook map` in this process: what it writes to stdout, and its exit code.
#pragma once

#include <unistd.h>

#include <catch2/catch.hpp>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "app/cli/map_command.hpp"

namespace firstlook::test {

inline std::string read_text(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

struct Printed {
  int exit_code = 0;
  std::string text;
};

/// @param scratch  a folder for what is printed
inline Printed print_map(const MapCommandOptions& options, const std::filesystem::path& scratch) {
  Printed printed;
  std::fflush(stdout);
  const int saved = dup(STDOUT_FILENO);
  REQUIRE(std::freopen((scratch / "stdout").c_str(), "w", stdout) != nullptr);
  printed.exit_code = run_map_command(options);
  std::fflush(stdout);
  dup2(saved, STDOUT_FILENO);
  close(saved);
  printed.text = read_text(scratch / "stdout");
  return printed;
}

}  // namespace firstlook::test
