/// The program that runs, the one that is loaded, and those that could be: what Play, Pause, Stop and scripts act on.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "hal/sim/ur_controller/controller.hpp"

namespace firstlook::sim::ur {

/// A file on the controller: `load NAME` of the dashboard finds it, with or without the folder before it.
struct StoredProgram {
  std::string name;    ///< "cart.urp"
  std::string script;  ///< URScript, one `def ... end`
};

class Programs {
 public:
  /// The controller must outlive this.
  Programs(Controller& controller, std::vector<StoredProgram> stored);

  /// One control cycle, after the controller's.
  void step();

  // Each is false when it cannot be done in this mode.
  [[nodiscard]] bool load(std::string_view name);  ///< stops what runs
  [[nodiscard]] bool play();
  [[nodiscard]] bool pause();
  [[nodiscard]] bool stop();

  /// URScript that came over a script port: it replaces what runs; a `sec` runs beside it.
  void submit(const std::string& script);

  /// "/programs/cart.urp", empty when nothing is loaded.
  [[nodiscard]] std::string loaded_path() const;
  /// "cart.urp", or "<unnamed>" as the dashboard calls it when nothing is loaded.
  [[nodiscard]] std::string_view loaded_name() const;

 private:
  Controller& controller_;
  std::vector<StoredProgram> stored_;
  const StoredProgram* loaded_ = nullptr;
};

}  // namespace firstlook::sim::ur
