#include "hal/sim/built_in_cells.hpp"

#include <algorithm>

namespace firstlook::sim {
namespace {

constexpr std::string_view kEmpty = R"(# Nothing but walls, floor, cart and board.
walls: {low_m: [-2.0, -1.9], high_m: [2.1, 2.0], height_m: 2.6}
board: {center_m: [0.89, 0.45, 0.42], faces: [-0.89, -0.45, 0.35]}
solids:
  - {name: board's post, cylinder: {radius_m: 0.015, height_m: 1.21}, position_m: [0.95, 0.49, -0.245]}
)";

// The thesis's (chapter 11): the arm on its table, a second table beside it, movable screens, and a box whose cut-out
// stands for a machine opening.
constexpr std::string_view kWorkshop = R"(walls: {low_m: [-2.2, -2.4], high_m: [2.5, 2.2], height_m: 2.6}
board: {center_m: [-0.12, 0.99, 0.42], faces: [0.12, -0.99, 0.35]}
solids:
  - {name: board's post, cylinder: {radius_m: 0.015, height_m: 1.21}, position_m: [-0.13, 1.06, -0.245]}

  - {name: second table, box: {size_m: [0.90, 1.30, 0.04]}, position_m: [1.10, 0.00, -0.10], color: [0.55, 0.42, 0.28]}
  - {name: table leg, box: {size_m: [0.05, 0.05, 0.73]}, position_m: [0.70, -0.60, -0.485]}
  - {name: table leg, box: {size_m: [0.05, 0.05, 0.73]}, position_m: [0.70, 0.60, -0.485]}
  - {name: table leg, box: {size_m: [0.05, 0.05, 0.73]}, position_m: [1.50, -0.60, -0.485]}
  - {name: table leg, box: {size_m: [0.05, 0.05, 0.73]}, position_m: [1.50, 0.60, -0.485]}

  # The box on the second table, open towards -y: front of four pieces around the cut-out.
  - {name: machine back, box: {size_m: [0.40, 0.02, 0.40]}, position_m: [0.95, 0.51, 0.12], color: [0.70, 0.66, 0.52]}
  - {name: machine left, box: {size_m: [0.02, 0.40, 0.40]}, position_m: [0.76, 0.30, 0.12], color: [0.70, 0.66, 0.52]}
  - {name: machine right, box: {size_m: [0.02, 0.40, 0.40]}, position_m: [1.14, 0.30, 0.12], color: [0.70, 0.66, 0.52]}
  - {name: machine top, box: {size_m: [0.40, 0.42, 0.02]}, position_m: [0.95, 0.31, 0.33], color: [0.70, 0.66, 0.52]}
  - {name: machine front low, box: {size_m: [0.40, 0.02, 0.06]}, position_m: [0.95, 0.11, -0.05], color: [0.66, 0.62, 0.48]}
  - {name: machine front high, box: {size_m: [0.40, 0.02, 0.04]}, position_m: [0.95, 0.11, 0.30], color: [0.66, 0.62, 0.48]}
  - {name: machine front left, box: {size_m: [0.04, 0.02, 0.30]}, position_m: [0.77, 0.11, 0.13], color: [0.66, 0.62, 0.48]}
  - {name: machine front right, box: {size_m: [0.04, 0.02, 0.30]}, position_m: [1.13, 0.11, 0.13], color: [0.66, 0.62, 0.48]}

  # Movable screens: two panels on feet, folded.
  - {name: screen, box: {size_m: [0.90, 0.03, 1.30]}, position_m: [-0.10, -0.74, -0.18], color: [0.25, 0.40, 0.55]}
  - {name: screen, box: {size_m: [0.70, 0.03, 1.30]}, position_m: [-0.80, -0.52, -0.18], rpy_deg: [0, 0, -40], color: [0.25, 0.40, 0.55]}
  - {name: screen foot, box: {size_m: [0.05, 0.40, 0.03]}, position_m: [0.20, -0.74, -0.835]}

  # A crate behind the arm.
  - {name: crate, box: {size_m: [0.24, 0.60, 1.25]}, position_m: [-0.74, 0.20, -0.225], color: [0.62, 0.50, 0.34]}

  - {name: shelf, box: {size_m: [0.35, 1.20, 1.70]}, position_m: [-1.90, 0.90, 0.0], color: [0.50, 0.50, 0.54]}
  - {name: column, cylinder: {radius_m: 0.12, height_m: 2.6}, position_m: [-1.10, 1.55, 0.45], color: [0.6, 0.6, 0.58]}
regions:
  - {name: behind_screens, low_m: [-0.50, -1.05, 0.00], high_m: [0.30, -0.80, 0.35]}
  - {name: behind_box, low_m: [-1.08, -0.05, 0.00], high_m: [-0.88, 0.45, 0.25]}
  - {name: inside_opening, low_m: [0.80, 0.15, -0.05], high_m: [1.10, 0.48, 0.28]}
)";

constexpr std::string_view kMachineTending =
    R"(# A lathe with its door open, a pallet, a conveyor, a fence and a window that gives no depth.
walls: {low_m: [-2.3, -2.0], high_m: [2.4, 2.3], height_m: 2.8}
board: {center_m: [0.17, -0.98, 0.42], faces: [-0.17, 0.98, 0.35]}
solids:
  - {name: board's post, cylinder: {radius_m: 0.015, height_m: 1.21}, position_m: [0.19, -1.05, -0.245]}

  # The machine: a front wall with a door of 0.60 x 0.55, a chamber 0.5 deep behind it.
  - {name: machine below, box: {size_m: [0.60, 1.40, 0.85]}, position_m: [1.05, 0.25, -0.425], color: [0.75, 0.76, 0.74]}
  - {name: machine above, box: {size_m: [0.60, 1.40, 0.70]}, position_m: [1.05, 0.25, 0.90], color: [0.75, 0.76, 0.74]}
  - {name: machine left, box: {size_m: [0.60, 0.40, 0.55]}, position_m: [1.05, 0.75, 0.275], color: [0.72, 0.73, 0.70]}
  - {name: machine right, box: {size_m: [0.60, 0.40, 0.55]}, position_m: [1.05, -0.25, 0.275], color: [0.72, 0.73, 0.70]}
  - {name: machine back, box: {size_m: [0.04, 1.40, 2.10]}, position_m: [1.37, 0.25, 0.20], color: [0.50, 0.50, 0.50]}
  - {name: chuck, cylinder: {radius_m: 0.10, height_m: 0.16}, position_m: [1.10, 0.47, 0.25], rpy_deg: [90, 0, 0], color: [0.40, 0.40, 0.42]}
  - {name: window, box: {size_m: [0.02, 0.36, 0.36]}, position_m: [0.74, 0.75, 0.30], color: [0.10, 0.12, 0.14], returns_depth: false}

  - {name: conveyor, box: {size_m: [0.35, 1.60, 0.12]}, position_m: [-0.95, 0.30, -0.16], color: [0.28, 0.30, 0.30]}
  - {name: conveyor leg, box: {size_m: [0.30, 0.06, 0.63]}, position_m: [-0.95, -0.30, -0.535]}
  - {name: conveyor leg, box: {size_m: [0.30, 0.06, 0.63]}, position_m: [-0.95, 0.90, -0.535]}
  - {name: part, cylinder: {radius_m: 0.05, height_m: 0.12}, position_m: [-0.92, -0.10, -0.04], color: [0.6, 0.6, 0.65]}
  - {name: part, cylinder: {radius_m: 0.05, height_m: 0.12}, position_m: [-0.97, 0.35, -0.04], color: [0.6, 0.6, 0.65]}
  - {name: pallet, box: {size_m: [0.80, 0.60, 0.14]}, position_m: [-0.10, 1.10, -0.78], color: [0.58, 0.45, 0.28]}
  - {name: stack, box: {size_m: [0.50, 0.45, 0.75]}, position_m: [-0.10, 1.10, -0.335], color: [0.65, 0.55, 0.40]}
  - {name: fence, box: {size_m: [0.90, 0.03, 1.90]}, position_m: [-0.75, -0.98, 0.10], color: [0.75, 0.65, 0.15]}
regions:
  - {name: inside_machine, low_m: [0.80, -0.03, 0.02], high_m: [1.10, 0.53, 0.53]}
  - {name: behind_stack, low_m: [-0.30, 1.33, -0.30], high_m: [0.10, 1.50, 0.00]}
)";

constexpr std::string_view kCluttered = R"(# Many things close around the arm.
walls: {low_m: [-1.9, -1.8], high_m: [1.9, 1.8], height_m: 2.5}
board: {center_m: [-0.74, 0.67, 0.42], faces: [0.74, -0.67, 0.35]}
solids:
  - {name: board's post, cylinder: {radius_m: 0.015, height_m: 1.21}, position_m: [-0.80, 0.72, -0.245]}
  - {name: bench, box: {size_m: [0.60, 1.60, 0.05]}, position_m: [0.95, 0.00, -0.12], color: [0.55, 0.42, 0.28]}
  - {name: bench side, box: {size_m: [0.50, 0.05, 0.70]}, position_m: [0.95, -0.70, -0.50]}
  - {name: bench side, box: {size_m: [0.50, 0.05, 0.70]}, position_m: [0.95, 0.70, -0.50]}
  - {name: carton, box: {size_m: [0.25, 0.30, 0.35]}, position_m: [0.90, -0.45, 0.08], rpy_deg: [0, 0, 25], color: [0.66, 0.52, 0.34]}
  - {name: carton, box: {size_m: [0.22, 0.22, 0.22]}, position_m: [0.85, 0.05, 0.015], rpy_deg: [0, 0, -15], color: [0.62, 0.50, 0.34]}
  - {name: carton, box: {size_m: [0.30, 0.20, 0.50]}, position_m: [1.00, 0.48, 0.155], rpy_deg: [0, 0, 40], color: [0.66, 0.54, 0.38]}
  - {name: pipe, cylinder: {radius_m: 0.04, height_m: 2.5}, position_m: [0.48, 0.62, 0.40], color: [0.70, 0.30, 0.20]}
  - {name: pipe, cylinder: {radius_m: 0.05, height_m: 1.80}, position_m: [0.10, -0.75, 0.75], rpy_deg: [0, 90, 20], color: [0.70, 0.30, 0.20]}
  - {name: drum, cylinder: {radius_m: 0.28, height_m: 0.90}, position_m: [-0.30, -1.00, -0.40], color: [0.20, 0.35, 0.60]}
  - {name: cabinet, box: {size_m: [0.45, 0.50, 1.50]}, position_m: [-1.05, -0.50, -0.10], rpy_deg: [0, 0, 10], color: [0.60, 0.62, 0.60]}
  - {name: monitor, box: {size_m: [0.50, 0.04, 0.32]}, position_m: [0.55, -0.85, 0.45], rpy_deg: [0, 0, 30], color: [0.05, 0.05, 0.05], returns_depth: false}
  - {name: monitor stand, cylinder: {radius_m: 0.03, height_m: 1.20}, position_m: [0.57, -0.90, -0.25]}
  - {name: bin, box: {size_m: [0.40, 0.40, 0.60]}, position_m: [0.00, 0.95, -0.55], rpy_deg: [0, 0, 30], color: [0.25, 0.45, 0.30]}
  - {name: rack, box: {size_m: [0.80, 0.30, 1.60]}, position_m: [0.10, 1.45, -0.05], color: [0.48, 0.48, 0.52]}
regions:
  - {name: behind_carton, low_m: [1.00, -0.55, 0.00], high_m: [1.15, -0.35, 0.20]}
)";

constexpr std::string_view kHall =
    R"(# An open hall: no wall within the sensor's range, so most pixels get nothing back.
board: {center_m: [0.99, -0.16, 0.42], faces: [-0.99, 0.16, 0.35]}
solids:
  - {name: board's post, cylinder: {radius_m: 0.015, height_m: 1.21}, position_m: [1.06, -0.17, -0.245]}
  - {name: pallet, box: {size_m: [1.20, 0.80, 0.14]}, position_m: [-1.40, 0.60, -0.78], color: [0.58, 0.45, 0.28]}
  - {name: column, cylinder: {radius_m: 0.20, height_m: 6.0}, position_m: [2.20, 2.40, 2.15], color: [0.6, 0.6, 0.58]}
)";

// The thesis's first simulation (chapter 3): a link of 1.1 m that pans and tilts; the camera 600 mm behind its end and
// 275 mm above, 800x600 with 45 degrees; the marker 2.5 m away and 1.45 m high, 0.5 m wide.
constexpr std::string_view kTwoJoint = R"(arm: two_joint
floor_m: -0.1
walls: {low_m: [-2.6, -2.8], high_m: [3.2, 2.8], height_m: 3.2}
safe_zone: {radius_m: 1.9, height_m: 2.75}
camera_envelope_m: 0.73
map: {low_m: [-1.55, -1.55, 0.4], high_m: [1.55, 1.55, 2.5]}
board: {center_m: [2.5, 0, 1.35], faces: [-1, 0, 0], inner_columns: 9, inner_rows: 6, square_size_m: 0.05}
camera:
  position_m: [0, -0.275, -0.6]
  rpy_deg: [0, 0, 0]
  color: {width: 800, height: 600, fx: 965.69, fy: 965.69, cx: 400.5, cy: 300.5, k1: 0, k2: 0, p1: 0, p2: 0, k3: 0}
solids:
  - {name: board's post, box: {size_m: [0.04, 0.10, 1.2]}, position_m: [2.56, 0, 0.5]}
  - {name: cabinet, box: {size_m: [0.5, 0.6, 1.6]}, position_m: [1.8, -1.6, 0.7], color: [0.60, 0.62, 0.60]}
  - {name: crate, box: {size_m: [0.5, 0.5, 0.8]}, position_m: [1.8, 1.5, 0.3], color: [0.62, 0.50, 0.34]}
)";

// A right arm with seven joints beside a torso, a head and another arm, which hide a part of what it could see.
constexpr std::string_view kPr2Like = R"(arm: pr2_like
floor_m: -0.95
walls: {low_m: [-2.0, -2.1], high_m: [2.2, 2.0], height_m: 2.6}
cart: {low_m: [-0.45, -0.25], high_m: [0.25, 0.55], top_m: -0.42}
safe_zone: {radius_m: 0.72, height_m: 1.15}
map: {low_m: [-1.5, -1.5, -0.5], high_m: [1.5, 1.5, 1.3]}
board: {center_m: [0.88, -0.74, 0.50], faces: [-0.88, 0.74, -0.05]}
solids:
  - {name: board's post, cylinder: {radius_m: 0.015, height_m: 1.35}, position_m: [0.94, -0.79, -0.275]}
  - {name: table, box: {size_m: [0.60, 1.20, 0.04]}, position_m: [1.15, 0.10, -0.30], color: [0.55, 0.42, 0.28]}
  - {name: carton, box: {size_m: [0.22, 0.30, 0.30]}, position_m: [1.10, 0.25, -0.13], rpy_deg: [0, 0, 25], color: [0.66, 0.52, 0.34]}
  - {name: shelf, box: {size_m: [0.8, 0.35, 1.5]}, position_m: [0.2, -1.35, -0.20], color: [0.50, 0.50, 0.54]}
  - {name: cupboard, box: {size_m: [0.4, 0.8, 1.6]}, position_m: [-1.2, -0.5, -0.15], color: [0.60, 0.62, 0.60]}
)";

constexpr BuiltInCell kCells[] = {
    {"empty", kEmpty},         {"workshop", kWorkshop}, {"machine_tending", kMachineTending},
    {"cluttered", kCluttered}, {"hall", kHall},         {"two_joint", kTwoJoint},
    {"pr2_like", kPr2Like}};

}  // namespace

std::span<const BuiltInCell> built_in_cells() { return kCells; }

std::optional<BuiltInCell> find_built_in_cell(std::string_view name) {
  const auto* const found = std::ranges::find(kCells, name, &BuiltInCell::name);
  if (found == std::end(kCells)) return std::nullopt;
  return *found;
}

}  // namespace firstlook::sim
