/// The names of the RTDE interface as UR's guide publishes them: type, since which version, and what they report or do.
#pragma once

#include <cstdint>
#include <string_view>

#include "hal/sim/ur_controller/controller.hpp"
#include "hal/sim/ur_controller/wire.hpp"

namespace firstlook::sim::ur {

enum class RtdeType : std::uint8_t {
  kBool,
  kUint8,
  kUint32,
  kUint64,
  kInt32,
  kDouble,
  kVector3d,
  kVector6d,
  kVector6Int32,
};
/// "VECTOR6D", as a setup is answered.
[[nodiscard]] std::string_view name_of(RtdeType type);
[[nodiscard]] std::size_t bytes_of(RtdeType type);

/// A published name that this controller has. Register names have their number in `index`.
struct RtdeOutput {
  RtdeType type = RtdeType::kDouble;
  int index = 0;
  void (*write)(const Controller& controller, int index, WireWriter& wire) = nullptr;
};

/// What one package asks for beside registers: it takes effect when the package is read, wherever its masks say so.
struct RtdeInputs {
  std::uint32_t speed_slider_mask = 0;
  double speed_slider_fraction = 0;
  std::uint8_t standard_mask = 0, standard = 0;
  std::uint8_t configurable_mask = 0, configurable = 0;
  std::uint8_t tool_mask = 0, tool = 0;
  std::uint8_t analog_mask = 0, analog_type = 0;
  std::array<double, 2> analog{};
};
struct RtdeInput {
  RtdeType type = RtdeType::kDouble;
  int index = 0;
  int row = 0;  ///< the same for the same name without its number: with `index` it says who owns what
  void (*read)(Controller& controller, RtdeInputs& inputs, int index, WireReader& wire) = nullptr;
};

/// Null pointer in `write` or `read`: no such name, or not in this version.
[[nodiscard]] RtdeOutput find_rtde_output(std::string_view name, const ControllerIdentity& identity);
[[nodiscard]] RtdeInput find_rtde_input(std::string_view name, const ControllerIdentity& identity);

/// Slider, digital and analog outputs.
void apply_rtde_inputs(const RtdeInputs& inputs, Controller& controller);

}  // namespace firstlook::sim::ur
