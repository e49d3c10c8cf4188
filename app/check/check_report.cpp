#include "app/check/check_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

namespace firstlook {

std::vector<std::string> check_warnings(const Config& config, bool simulated) {
  std::vector<std::string> warnings;
  if (config.keep_out.empty()) {
    warnings.emplace_back(
        "keep_out is empty: a depth camera sees neither glass nor light curtains, and no people's side. If the cell "
        "has "
        "any, declare them as boxes in keep_out before the first job");
  }
  if (!simulated && config.start_source == "panel" && config.panel.can_interface == "none") {
    warnings.emplace_back("start_source is panel, and panel.can_interface names none: nobody can start a job");
  }
  return warnings;
}

std::string check_text(const CheckResult& result) {
  std::string text;
  for (const CheckedDevice& d : result.devices) {
    std::string what = d.simulated ? "simulated" : "";
    for (const std::string_view part : {d.report.device.view(), d.report.detail.view()}) {
      if (!part.empty()) what += fmt::format("{}{}", what.empty() ? "" : ": ", part);
    }
    text += fmt::format("{:<14} {:<11} {}\n", d.role, hal::name_of(d.report.state), what);
    if (!d.report.remedy.empty()) text += fmt::format("{:<14} {:<11} {}\n", "", "to do:", d.report.remedy.view());
  }
  for (const std::string& warning : result.warnings) text += fmt::format("{:<14} {}\n", "warning", warning);
  return text;
}

std::string check_json(const CheckResult& result) {
  nlohmann::ordered_json root;
  root["ok"] = result.all_ready();
  root["devices"] = nlohmann::ordered_json::array();
  for (const CheckedDevice& d : result.devices) {
    nlohmann::ordered_json device;
    device["role"] = d.role;
    device["simulated"] = d.simulated;
    device["device"] = std::string(d.report.device.view());
    device["state"] = std::string(hal::name_of(d.report.state));
    device["detail"] = std::string(d.report.detail.view());
    device["remedy"] = std::string(d.report.remedy.view());
    device["numbers"] = nlohmann::ordered_json::object();
    for (const hal::DeviceNumber& n : d.report.numbers) device["numbers"][std::string(n.name)] = n.value;
    root["devices"].push_back(device);
  }
  root["warnings"] = result.warnings;
  return root.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

}  // namespace firstlook
