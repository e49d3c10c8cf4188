/// A client of the Real-Time Data Exchange (30004), protocol 2 and 1, as UR's RTDE guide has it.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "hal/sim/ur_controller/rtde_table.hpp"
#include "hal/sim/ur_controller/session.hpp"

namespace firstlook::sim::ur {

/// Which session controls which input, for all sessions together: one client alone may control a variable.
class RtdeInputOwners {
 public:
  using Variable = std::pair<int, int>;  ///< row and index of a name

  [[nodiscard]] bool free_for(const Variable& variable, const Session& session) const {
    const auto found = owners_.find(variable);
    return found == owners_.end() || found->second == &session;
  }
  void own(const Variable& variable, const Session& session) { owners_[variable] = &session; }
  void release_all(const Session& session) {
    std::erase_if(owners_, [&](const auto& entry) { return entry.second == &session; });
  }

 private:
  std::map<Variable, const Session*> owners_;
};

class RtdeSession final : public Session {
 public:
  /// Both must outlive the session.
  RtdeSession(Controller& controller, RtdeInputOwners& owners) : controller_(controller), owners_(owners) {}

  void receive(std::string_view bytes) override;
  void on_cycle() override;
  void closed() override { owners_.release_all(*this); }

 private:
  struct OutputRecipe {
    std::vector<RtdeOutput> fields;
    std::uint64_t every_cycles = 1;
  };
  using InputRecipe = std::vector<RtdeInput>;

  void handle(std::uint8_t type, std::string_view payload);
  void request_protocol(std::string_view payload);
  void send_version();
  void set_up_outputs(std::string_view payload);
  void set_up_inputs(std::string_view payload);
  void start(bool running);
  void take_data(std::string_view payload);
  void take_text(std::string_view payload);
  void send(std::uint8_t type, std::string_view payload);
  void send_text(std::string_view message);

  Controller& controller_;
  RtdeInputOwners& owners_;
  std::string received_;
  int protocol_ = 1;
  bool running_ = false;
  std::optional<OutputRecipe> output_recipe_;  ///< one for each client: the latest takes the place of the one before
  std::vector<InputRecipe> input_recipes_;     ///< number i + 1
};

}  // namespace firstlook::sim::ur
