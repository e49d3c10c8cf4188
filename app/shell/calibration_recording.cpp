#include "app/shell/calibration_recording.hpp"

#include <vector>

#include "app/config/board_config.hpp"
#include "app/dataset/calibration_dataset.hpp"
#include "app/report/picture_bytes.hpp"
#include "app/report/ros_files.hpp"
#include "platform/linux/files.hpp"

namespace firstlook {
namespace {

std::string pose_row(const std::string& image, const Transform<Base, Flange>& pose) {
  const Eigen::Vector3d t = pose.translation();
  const Eigen::Quaterniond q = pose.quaternion();
  return fmt::format("{},{:.9f},{:.9f},{:.9f},{:.12f},{:.12f},{:.12f},{:.12f}\n", image, t.x(), t.y(), t.z(), q.x(),
                     q.y(), q.z(), q.w());
}

}  // namespace

Status write_calibration_recording(const std::string& folder, const RunRecord& record, const Config& config) {
  if (const Status made = make_directories(folder + "/images"); !made) return made;
  std::string poses = "image,x,y,z,qx,qy,qz,qw\n";
  const auto targets = targets_of(config);
  if (!targets) return std::unexpected(targets.error());
  // Numbers count row by row for every type; one board with columns and rows names these.
  const bool several = targets->size() > 1, numbered = several || targets->front().board.has_marker_corners();
  std::string corners = numbered ? "image,point,u_px,v_px" : "image,column,row,u_px,v_px";
  corners += several ? ",target\n" : "\n";
  int station = -1;
  bool pictures = true;
  std::vector<std::pair<std::string, std::string>> texts;
  for (std::size_t i = 0; i < record.calibration_views.size(); ++i) {
    const CalibrationViewRecord& view = record.calibration_views[i];
    if (!view.counted) continue;  // so that the recording solves to what the run solved
    const std::string image = fmt::format("images/{:02}.png", view.station + 1);
    pictures = pictures && view.picture.width > 0;
    const bool new_stop = view.station != station;
    station = view.station;
    if (new_stop) poses += pose_row(image, view.base_T_flange);
    if (new_stop && view.picture.width > 0) {
      if (const Status s = write_file_atomically(fmt::format("{}/{}", folder, image), encode_png(view.picture)); !s)
        return s;
    }
    for (std::size_t c = 0; c < view.detected_px.size(); ++c) {
      const NamedTarget& target = (*targets)[static_cast<std::size_t>(view.target)];
      const int id = point_of(view.detected_ids, c), columns = target.board.inner_columns;
      const std::string place = numbered ? fmt::format("{}", id) : fmt::format("{},{}", id % columns, id / columns);
      corners += fmt::format("{},{},{:.6f},{:.6f}{}\n", image, place, view.detected_px[c].x(), view.detected_px[c].y(),
                             several ? "," + target.name : std::string());
    }
  }
  texts.emplace_back("poses.csv", poses);
  if (!pictures) texts.emplace_back("corners.csv", corners);
  texts.emplace_back("board.yaml", board_yaml(*targets));
  if (record.intrinsics.width > 0) texts.emplace_back("camera_info.yaml", camera_info_yaml(record.intrinsics));
  for (const auto& [name, text] : texts) {
    if (const Status s = write_file_atomically(fmt::format("{}/{}", folder, name), text); !s) return s;
  }
  return {};
}

}  // namespace firstlook
