#include "app/report/map_csv.hpp"

#include <fmt/format.h>

#include <cmath>

namespace firstlook {

namespace {

std::string plane_columns(const MapPlanes& planes) {
  return fmt::format("{}{}{}", planes.color ? ",red,green,blue" : "", planes.label ? ",object,shape" : "",
                     planes.sensor ? ",sensor" : "");
}

/// Colours and labels are of surfaces: of what is occupied.
std::string plane_cells(const MapPlanes& planes, std::size_t index, bool occupied) {
  std::string cells;
  if (planes.color) {
    const std::optional<Rgb> c = occupied ? planes.color->at(index) : std::nullopt;
    cells += c ? fmt::format(",{},{},{}", (*c)[0], (*c)[1], (*c)[2]) : ",,,";
  }
  if (planes.label) {
    const VoxelLabel label = planes.label->at(index);
    cells += label.object != 0 ? fmt::format(",{},{}", label.object, to_string(label.shape)) : ",,";
  }
  if (planes.sensor) {
    const int sensor = planes.sensor->at(index);
    cells += sensor != 0 ? fmt::format(",{}", sensor) : ",";
  }
  return cells;
}

}  // namespace

void write_voxels_csv(const VoxelMap& map, ByteSink sink, const MapPlanes& planes) {
  const auto write = [&sink](std::string_view text) { sink(std::as_bytes(std::span(text))); };
  write(fmt::format("x_m,y_m,z_m,class,log_odds{}\n", plane_columns(planes)));
  for (std::size_t i = 0; i < map.size(); ++i) {
    const VoxelClass voxel_class = map.voxel_class(i);
    if (voxel_class == VoxelClass::kUnknown) continue;
    const Eigen::Vector3d c = map.geometry().center_m(map.geometry().voxel_at(i));
    const bool occupied = voxel_class == VoxelClass::kOccupied;
    write(fmt::format("{:.6g},{:.6g},{:.6g},{},{:.4f}{}\n", c.x(), c.y(), c.z(), occupied ? "occupied" : "free",
                      map.log_odds(i) * kLogOddsUnit, plane_cells(planes, i, occupied)));
  }
}

std::string boxes_csv(std::span<const AxisBox> boxes) {
  std::string csv = "low_x_m,low_y_m,low_z_m,high_x_m,high_y_m,high_z_m\n";
  for (const AxisBox& box : boxes)
    csv += fmt::format("{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g}\n", box.low_m.x(), box.low_m.y(), box.low_m.z(),
                       box.high_m.x(), box.high_m.y(), box.high_m.z());
  return csv;
}

std::string objects_csv(const MapObjects& objects) {
  std::string csv =
      "id,shape,bounds_room,voxels,center_x_m,center_y_m,center_z_m,size_x_m,size_y_m,size_z_m,qx,qy,qz,qw\n";
  for (const MapObject& o : objects.objects) {
    const Eigen::Vector3d &c = o.box.center_m, &s = o.box.size_m;
    const Eigen::Quaterniond& q = o.box.rotation;
    csv += fmt::format("{},{},{:d},{},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.9g},{:.9g},{:.9g},{:.9g}\n", o.id,
                       to_string(o.shape), o.bounds_room, o.voxels, c.x(), c.y(), c.z(), s.x(), s.y(), s.z(), q.x(),
                       q.y(), q.z(), q.w());
  }
  return csv;
}

std::string hand_eye_csv(const StoredCalibration& calibration) {
  const Eigen::Vector3d t = calibration.flange_T_camera.translation();
  const Eigen::Quaterniond q = calibration.flange_T_camera.quaternion();
  const auto sigma = [&](int i) { return std::sqrt(calibration.covariance(i, i)); };
  return fmt::format(
      "x_m,y_m,z_m,qx,qy,qz,qw,sigma_x_m,sigma_y_m,sigma_z_m,sigma_rx_rad,sigma_ry_rad,sigma_rz_rad\n"
      "{:.12g},{:.12g},{:.12g},{:.12g},{:.12g},{:.12g},{:.12g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g}\n",
      t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w(), sigma(0), sigma(1), sigma(2), sigma(3), sigma(4), sigma(5));
}

}  // namespace firstlook
