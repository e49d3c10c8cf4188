#include "tests/bench/hand_eye_peers.hpp"

#include <opencv2/calib3d.hpp>

#include "tests/bench/visp_peer.hpp"

namespace firstlook::bench {
namespace {

cv::Mat rotation_mat(const Pose& pose) {
  cv::Mat m(3, 3, CV_64F);
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) m.at<double>(r, c) = pose.linear()(r, c);
  }
  return m;
}

cv::Mat translation_mat(const Pose& pose) {
  return (cv::Mat_<double>(3, 1) << pose.translation().x(), pose.translation().y(), pose.translation().z());
}

std::optional<Pose> pose_of(const cv::Mat& rotation, const cv::Mat& translation) {
  if (rotation.rows != 3 || rotation.cols != 3 || translation.total() != 3) return std::nullopt;
  Pose pose = Pose::Identity();
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) pose.linear()(r, c) = rotation.at<double>(r, c);
    pose.translation()[r] = translation.at<double>(r);
  }
  if (!pose.matrix().allFinite()) return std::nullopt;
  return pose;
}

struct Poses {
  std::vector<cv::Mat> rotations, translations;
  void add(const Pose& pose) {
    rotations.push_back(rotation_mat(pose));
    translations.push_back(translation_mat(pose));
  }
};

template <cv::HandEyeCalibrationMethod kMethod>
std::optional<Pose> opencv(std::span<const PosePair> pairs) {
  Poses flange, board;
  for (const PosePair& pair : pairs) {
    flange.add(pair.base_T_flange.pose());
    board.add(pair.camera_T_board.pose());
  }
  cv::Mat rotation, translation;
  try {
    cv::calibrateHandEye(flange.rotations, flange.translations, board.rotations, board.translations, rotation,
                         translation, kMethod);
  } catch (const cv::Exception&) {
    return std::nullopt;
  }
  return pose_of(rotation, translation);
}

template <cv::RobotWorldHandEyeCalibrationMethod kMethod>
std::optional<Pose> opencv_robot_world(std::span<const PosePair> pairs) {
  Poses flange_T_base, board;
  for (const PosePair& pair : pairs) {
    flange_T_base.add(pair.base_T_flange.inverse().pose());
    board.add(pair.camera_T_board.pose());
  }
  cv::Mat board_r, board_t, camera_r, camera_t;
  try {
    cv::calibrateRobotWorldHandEye(board.rotations, board.translations, flange_T_base.rotations,
                                   flange_T_base.translations, board_r, board_t, camera_r, camera_t, kMethod);
  } catch (const cv::Exception&) {
    return std::nullopt;
  }
  const auto camera_T_flange = pose_of(camera_r, camera_t);
  if (!camera_T_flange) return std::nullopt;
  return camera_T_flange->inverse(Eigen::Isometry);
}

std::optional<Pose> visp(std::span<const PosePair> pairs) {
  std::vector<Pose> base_T_flange, camera_T_board;
  for (const PosePair& pair : pairs) {
    base_T_flange.push_back(pair.base_T_flange.pose());
    camera_T_board.push_back(pair.camera_T_board.pose());
  }
  return visp_hand_eye(base_T_flange, camera_T_board);
}

}  // namespace

std::span<const HandEyePeer> hand_eye_peers() {
  static const std::vector<HandEyePeer> kPeers = {
      {"opencv_tsai", "OpenCV Tsai", opencv<cv::CALIB_HAND_EYE_TSAI>},
      {"opencv_park", "OpenCV Park", opencv<cv::CALIB_HAND_EYE_PARK>},
      {"opencv_horaud", "OpenCV Horaud", opencv<cv::CALIB_HAND_EYE_HORAUD>},
      {"opencv_andreff", "OpenCV Andreff", opencv<cv::CALIB_HAND_EYE_ANDREFF>},
      {"opencv_daniilidis", "OpenCV Daniilidis", opencv<cv::CALIB_HAND_EYE_DANIILIDIS>},
      {"opencv_shah", "OpenCV Shah", opencv_robot_world<cv::CALIB_ROBOT_WORLD_HAND_EYE_SHAH>},
      {"opencv_li", "OpenCV Li", opencv_robot_world<cv::CALIB_ROBOT_WORLD_HAND_EYE_LI>},
      {"visp", "ViSP", visp_installed() ? visp : nullptr},
  };
  return kPeers;
}

}  // namespace firstlook::bench
