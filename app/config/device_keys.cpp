#include "app/config/device_keys.hpp"

#include <array>
#include <span>

namespace firstlook {
namespace {

constexpr std::string_view kFormats[] = {"auto", "YUYV", "NV12", "GREY", "MJPG"};
constexpr std::string_view kContacts[] = {"opens", "closes"};
constexpr double kLastInput = 31;

}  // namespace

std::vector<ConfigKey> camera_keys(Config::Camera& k) {
  std::vector<ConfigKey> keys;
  keys.push_back(
      {"camera.device",
       &k.device,
       0,
       0,
       {},
       "colour camera on V4L2 by its stable path, /dev/v4l/by-id/...; freenect: that of a Kinect v1, in grey "
       "values; none: the simulated cell's"});
  keys.push_back({"camera.width",
                  &k.width,
                  160,
                  4096,
                  {},
                  "of its pictures, 1920 x 1080 pixels at most in all; intrinsics hold for one size only"});
  keys.push_back({"camera.height", &k.height, 120, 4096, {}, "of its pictures"});
  keys.push_back(
      {"camera.format", &k.format, 0, 0, kFormats, "of its pixels; auto: the first of these that it grants"});
  keys.push_back({"camera.rate_hz", &k.rate_hz, 1, 240, {}, "pictures a second to ask for"});
  keys.push_back({"camera.exposure_us", &k.exposure_us, 0, 1000000, {}, "fixed for the job; 0: as the camera has it"});
  keys.push_back({"camera.gain", &k.gain, -1, 65535, {}, "fixed, in the camera's units; -1: as the camera has it"});
  keys.push_back({"camera.focus", &k.focus, -1, 65535, {}, "fixed, in the camera's units; -1: as the camera has it"});
  keys.push_back(
      {"camera.white_balance_k", &k.white_balance_k, 0, 20000, {}, "fixed, kelvin; 0: as the camera has it"});
  keys.push_back({"camera.info", &k.info, 0, 0, {}, "camera_info.yaml with its intrinsics; none: there is none yet"});
  return keys;
}

std::vector<ConfigKey> panel_keys(Config::Panel& k) {
  std::vector<ConfigKey> keys;
  keys.push_back(
      {"panel.can_interface",
       &k.can_interface,
       0,
       0,
       {},
       "CAN interface with the button panel, a CANopen I/O module (CiA 401): can0; none: the simulated cell's"});
  keys.push_back({"panel.node_id", &k.node_id, 1, 126, {}, "of the module, as its address switches say"});
  keys.push_back({"panel.vendor_id", &k.vendor_id, 0, 4294967295.0, {}, "expected in its object 1018h:1; 0: any"});
  keys.push_back(
      {"panel.product_code", &k.product_code, 0, 4294967295.0, {}, "expected in its object 1018h:2; 0: any"});
  keys.push_back(
      {"panel.start_input", &k.start_input, -1, kLastInput, {}, "bit of the start button; -1: there is none"});
  keys.push_back({"panel.stop_input",
                  &k.stop_input,
                  -1,
                  kLastInput,
                  {},
                  "bit of the stop button, which asks the program to stop and is no safety function; -1: none"});
  keys.push_back({"panel.confirm_input", &k.confirm_input, -1, kLastInput, {}, "bit of the confirm button; -1: none"});
  keys.push_back({"panel.enabling_input",
                  &k.enabling_input,
                  -1,
                  kLastInput,
                  {},
                  "bit of the enabling switch, which is shown and decides nothing; -1: none"});
  keys.push_back({"panel.stop_contact", &k.stop_contact, 0, 0, kContacts,
                  "what the stop button's contact does when pressed; one that opens finds a broken wire"});
  keys.push_back({"panel.red_output", &k.red_output, -1, kLastInput, {}, "bit of the red light; -1: none"});
  keys.push_back({"panel.amber_output", &k.amber_output, -1, kLastInput, {}, "bit of the amber light; -1: none"});
  keys.push_back({"panel.green_output", &k.green_output, -1, kLastInput, {}, "bit of the green light; -1: none"});
  keys.push_back({"panel.buzzer_output",
                  &k.buzzer_output,
                  -1,
                  kLastInput,
                  {},
                  "bit of the buzzer, which sounds when the light turns red; -1: none"});
  return keys;
}

std::string broken_panel_rule(const Config::Panel& p) {
  const auto doubled = [](std::span<const int> bits) {
    for (std::size_t i = 0; i < bits.size(); ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        if (bits[i] >= 0 && bits[i] == bits[j]) return true;
      }
    }
    return false;
  };
  const std::array inputs{p.start_input, p.stop_input, p.confirm_input, p.enabling_input};
  const std::array outputs{p.red_output, p.amber_output, p.green_output, p.buzzer_output};
  if (doubled(inputs)) return "panel: two of start_input, stop_input, confirm_input, enabling_input are the same bit";
  if (doubled(outputs)) return "panel: two of red_output, amber_output, green_output, buzzer_output are the same bit";
  return {};
}

}  // namespace firstlook
