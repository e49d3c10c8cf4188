#include "hal/sim/faults.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <vector>

#include "algorithms/vision/target_set.hpp"

namespace firstlook::sim {
namespace {

enum class Kind : unsigned char {
  kShare,
  kTime,
  kOffset,
  kRelative,
  kPixels,
  kMount,
  kSwitch,
  kInterval,
  kNumber,
  kBoard
};

struct Knob {
  std::string_view name;
  Kind kind;
  double Faults::* value = nullptr;
  bool Faults::* flag = nullptr;
};

constexpr std::array kKnobs = {
    Knob{"color.drop", Kind::kShare, &Faults::color_drop},
    Knob{"depth.drop", Kind::kShare, &Faults::depth_drop},
    Knob{"color.stall_at", Kind::kTime, &Faults::color_stall_s},
    Knob{"depth.stall_at", Kind::kTime, &Faults::depth_stall_s},
    Knob{"color.freeze_at", Kind::kTime, &Faults::color_freeze_s},
    Knob{"depth.freeze_at", Kind::kTime, &Faults::depth_freeze_s},
    Knob{"color.clock", Kind::kOffset, &Faults::color_clock_offset_s},
    Knob{"depth.clock", Kind::kOffset, &Faults::depth_clock_offset_s},
    Knob{"color.focal", Kind::kRelative, &Faults::color_focal_error},
    Knob{"color.center", Kind::kPixels, &Faults::color_center_error_px},
    Knob{"depth.shift", Kind::kMount, &Faults::depth_shift_mm},
    Knob{"depth.tilt", Kind::kMount, &Faults::depth_tilt_mrad},
    Knob{"link.lost_at", Kind::kTime, &Faults::link_lost_s},
    Knob{"arm.protective_stop_at", Kind::kTime, &Faults::protective_stop_s},
    Knob{"arm.emergency_stop_at", Kind::kTime, &Faults::emergency_stop_s},
    Knob{"operator.play_at", Kind::kTime, &Faults::play_s},
    Knob{"operator.start_at", Kind::kTime, &Faults::start_s},
    Knob{"operator.pause_at", Kind::kInterval, &Faults::pause_s},
    Knob{"operator.stop_at", Kind::kTime, &Faults::stop_s},
    Knob{"panel.lost_at", Kind::kTime, &Faults::panel_lost_s},
    Knob{"board.move_at", Kind::kTime, &Faults::board_move_s},
    Knob{"board.number", Kind::kBoard, &Faults::board_number},
    Knob{"board.absent", Kind::kSwitch, nullptr, &Faults::board_absent},
    Knob{"camera.fixed", Kind::kSwitch, nullptr, &Faults::camera_fixed},
    Knob{"obstacle.appear_at", Kind::kTime, &Faults::obstacle_s},
    Knob{"touch.mixed_up", Kind::kNumber, &Faults::touch_mixed_up},
    Knob{"touch.left_there", Kind::kSwitch, nullptr, &Faults::touch_left_there},
};

/// Levenshtein 1966: insertions, deletions and substitutions between two names.
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i + 1;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t substituted = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({row[j] + 1, row[j + 1] + 1, substituted});
    }
  }
  return row[b.size()];
}

const Knob& nearest_knob(std::string_view name) {
  return *std::min_element(kKnobs.begin(), kKnobs.end(), [&](const Knob& a, const Knob& b) {
    return edit_distance(a.name, name) < edit_distance(b.name, name);
  });
}

bool read_number(std::string_view text, double& value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc{} && end == text.data() + text.size() && std::isfinite(value);
}

/// True when `text` is a value of the knob's kind; writes it.
bool set_knob(const Knob& knob, std::string_view text, Faults& faults) {
  double number = 0;
  switch (knob.kind) {
    case Kind::kSwitch:
      if (text != "0" && text != "1") return false;
      faults.*knob.flag = text == "1";
      return true;
    case Kind::kShare:
      if (!read_number(text, number) || number < 0 || number > 1) return false;
      break;
    case Kind::kOffset:
      if (!read_number(text, number) || std::abs(number) > 10) return false;
      break;
    case Kind::kRelative:
      if (!read_number(text, number) || std::abs(number) > 0.5) return false;
      break;
    case Kind::kPixels:
      if (!read_number(text, number) || std::abs(number) > 100) return false;
      break;
    case Kind::kNumber:
      if (!read_number(text, number) || number < 0 || number > 100 || number != std::floor(number)) return false;
      break;
    case Kind::kMount:
      if (!read_number(text, number) || std::abs(number) > 50) return false;
      break;
    case Kind::kBoard:
      if (!read_number(text, number) || number < 1 || number > kTargetsMax || number != std::floor(number))
        return false;
      break;
    case Kind::kInterval: {
      const std::size_t colon = text.find(':');
      if (colon != std::string_view::npos) {
        if (!read_number(text.substr(colon + 1), faults.pause_duration_s) || faults.pause_duration_s <= 0) return false;
        text = text.substr(0, colon);
      }
      if (!read_number(text, number) || number < 0) return false;
      break;
    }
    case Kind::kTime:
      if (text == "never") {
        number = kNever;
      } else if (!read_number(text, number) || number < 0) {
        return false;
      }
      break;
  }
  faults.*knob.value = number;
  return true;
}

}  // namespace

Result<Faults> parse_faults(std::string_view specification) {
  Faults faults;
  while (!specification.empty()) {
    const std::size_t comma = specification.find(',');
    const std::string_view item = specification.substr(0, comma);
    specification = comma == std::string_view::npos ? std::string_view{} : specification.substr(comma + 1);
    const std::size_t equals = item.find('=');
    const std::string_view name = item.substr(0, equals);
    const auto* knob =
        std::find_if(kKnobs.begin(), kKnobs.end(), [&](const Knob& candidate) { return candidate.name == name; });
    if (knob == kKnobs.end()) {
      return failure(Fault::kUsage, "unknown fault '{}'; the nearest known one is '{}'", name, nearest_knob(name).name);
    }
    if (equals == std::string_view::npos || !set_knob(*knob, item.substr(equals + 1), faults)) {
      return failure(Fault::kUsage, "fault '{}' needs a value in its range, not '{}'", name,
                     equals == std::string_view::npos ? std::string_view{} : item.substr(equals + 1));
    }
  }
  return faults;
}

bool acts_on_arm(const Faults& f) {
  const Faults none;
  return f.link_lost_s != none.link_lost_s || f.protective_stop_s != none.protective_stop_s ||
         f.emergency_stop_s != none.emergency_stop_s || f.play_s != none.play_s || f.pause_s != none.pause_s ||
         f.stop_s != none.stop_s;
}

}  // namespace firstlook::sim
