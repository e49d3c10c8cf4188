/// The truth about a cell: what stands where, where the camera really sits, and how light falls.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "algorithms/kinematics/arm_model.hpp"
#include "algorithms/mapping/grid_geometry.hpp"
#include "algorithms/mapping/safe_zone.hpp"
#include "algorithms/vision/target.hpp"
#include "platform/core/camera_intrinsics.hpp"
#include "platform/core/joint_vector.hpp"
#include "platform/core/transform.hpp"

namespace firstlook::sim {

/// How a solid looks to the cameras.
struct Surface {
  std::array<float, 3> color{0.6F, 0.6F, 0.6F};  ///< diffuse reflectance, red green blue, 0..1
  bool returns_depth = true;                     ///< false: dark or shiny, the depth camera gets nothing back

  /// Reflectance for a grey camera (ITU-R BT.601 weights).
  [[nodiscard]] float gray() const { return 0.299F * color[0] + 0.587F * color[1] + 0.114F * color[2]; }
};

/// All points within +- half_m of the origin along each axis of the solid's own frame.
struct Box {
  Eigen::Vector3d half_m = Eigen::Vector3d::Zero();
};
/// Axis along z of the solid's own frame, origin in the middle.
struct Cylinder {
  double radius_m = 0;
  double half_height_m = 0;
};
/// A closed surface of triangles in the solid's own frame.
struct Mesh {
  std::vector<Eigen::Vector3d> vertices_m;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};
using Shape = std::variant<Box, Cylinder, Mesh>;

struct Solid {
  std::string name;
  Pose base_T_solid = Pose::Identity();
  Shape shape;
  Surface surface;
};

/// A printed board on a thin panel. Its front is the plane z = 0 of the board frame; the panel lies behind it (z >
/// 0).
struct BoardPlacement {
  std::string name = "board";
  BoardSpec spec;
  Transform<Base, Board> base_T_board;
  double white_margin_m = 0.03;  ///< around the outer squares
  double thickness_m = 0.01;
  std::size_t solid = 0;  ///< which of the scene's solids is its panel
};

/// Where the cameras truly sit, and what they truly are.
struct CameraMount {
  int link = 6;                           ///< that carries the camera; 0: fixed in the cell
  Pose link_T_camera = Pose::Identity();  ///< with link 0: base_T_camera
  Transform<Camera, Depth> camera_T_depth;
  CameraIntrinsics color;
  CameraIntrinsics depth;       ///< of the full frame; without distortion
  bool depth_is_given = false;  ///< by the cell: the sensor that is asked for does not replace it

  [[nodiscard]] bool on_arm() const { return link > 0; }
  /// The transform that the calibration looks for. Only for a camera on the flange.
  [[nodiscard]] Transform<Flange, Camera> flange_T_camera() const { return Transform<Flange, Camera>(link_T_camera); }
};

/// A first Kinect on the last of `joints` links: 640x480, the colour camera looking along z, 7 cm to the side and 6 cm
/// ahead.
[[nodiscard]] CameraMount default_mount(int joints);

/// A part of the cell that reports and tests ask for by name: a box in base coordinates.
struct Region {
  std::string name;
  Eigen::Vector3d low_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d high_m = Eigen::Vector3d::Zero();
};

/// Diffuse light: a part from everywhere, a part from one direction, and a gradient across the cell.
struct Light {
  Eigen::Vector3d toward = Eigen::Vector3d(0.3, -0.2, 0.93).normalized();  ///< to the lamp
  double ambient = 0.55;
  double directed = 0.45;
  Eigen::Vector3d gradient_per_m = Eigen::Vector3d(0.03, 0.02, 0);  ///< relative change of brightness with place
};

/// Everything in Base: z = 0 is the arm's mounting plate.
struct Scene {
  std::string name;
  ArmModel arm = *find_arm_model("ur5");
  std::string arm_file;     ///< that the arm was read from; empty: it is built in
  std::uint64_t robot = 1;  ///< which one of its model: draws serial number and factory correction of its controller
  JointVector start_rad;
  std::vector<Solid> solids;  ///< floor, walls, cart and the boards' panels included; not the arm
  std::vector<BoardPlacement> boards = std::vector<BoardPlacement>(1);
  CameraMount mount;
  Eigen::Vector3d flange_p_tip_m{0.012, -0.008, 0.3};  ///< of the probe that a person touches the board with; no body
  SafeZone safe_zone;                                  ///< its floor is the cart's top
  std::vector<Region> regions;
  std::vector<Region> keep_out;
  Light light;
  double camera_envelope_m = 0;  ///< radius about the flange in which the camera sits; 0: the default of the program
  std::optional<Region> map;     ///< what the map has to cover; empty: the default of the program
};

/// Distance between a segment and a solid, to 1e-6 m; 0 when they meet. A capsule touches the solid where it is at most
/// the capsule's radius. A segment inside a mesh has distance 0.
[[nodiscard]] double distance_m(const Solid& solid, const Eigen::Vector3d& a, const Eigen::Vector3d& b);

/// True when the capsule (base coordinates) touches or overlaps any solid of the scene.
[[nodiscard]] bool touches(const Scene& scene, const Capsule& capsule);

/// True when the point lies in matter.
[[nodiscard]] bool inside(const Scene& scene, const Eigen::Vector3d& point_m);

/// One byte for each voxel: 1 where the voxel's box overlaps a solid by more than 1e-9 m. Exact for boxes, upright
/// cylinders and the faces of meshes; tilted cylinders take up to half a voxel diagonal more.
[[nodiscard]] std::vector<std::uint8_t> occupied_voxels(const Scene& scene, const GridGeometry& geometry);

/// The axis-aligned box around a solid, in base coordinates.
[[nodiscard]] Eigen::AlignedBox3d bounds(const Solid& solid);

/// The board whose panel this solid is; null for all others.
[[nodiscard]] const BoardPlacement* board_of_solid(const Scene& scene, std::size_t solid);

/// Puts a board elsewhere and its panel with it.
void move_board(Scene& scene, const Transform<Base, Board>& base_T_board, std::size_t which = 0);

/// Hangs another board at the same place: the middles of the points and the directions of the rows are the same.
void exchange_board(Scene& scene, const BoardSpec& board, std::size_t which = 0);

/// The panel that carries a board.
[[nodiscard]] Solid board_panel(const BoardPlacement& board);

}  // namespace firstlook::sim
