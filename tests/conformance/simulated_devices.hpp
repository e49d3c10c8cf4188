/// The devices of the simulated cell `empty`, for the conformance suites.
#pragma once

#include <catch2/catch.hpp>
#include <memory>

#include "hal/sim/simulated_cell.hpp"

namespace firstlook::test {

inline std::unique_ptr<sim::SimulatedCell> empty_cell(const std::string& faults = "") {
  sim::SimulationOptions options;
  options.cell = "empty";
  options.fast_sensor = true;
  options.faults = faults;
  auto cell = sim::make_simulated_cell(options);
  if (!cell) FAIL(describe(cell.error()));
  return std::move(*cell);
}

}  // namespace firstlook::test
