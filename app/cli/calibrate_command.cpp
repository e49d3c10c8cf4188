#include "app/cli/calibrate_command.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <iterator>
#include <nlohmann/json.hpp>

#include "algorithms/kinematics/arm_model.hpp"
#include "algorithms/vision/detector_presets.hpp"
#include "algorithms/vision/target_names.hpp"
#include "app/cli/small_commands.hpp"
#include "app/dataset/calibration_dataset.hpp"
#include "app/report/calibration_files.hpp"
#include "app/report/dataset_report.hpp"
#include "app/report/hand_eye_json.hpp"
#include "app/report/result_json.hpp"
#include "app/report/ros_files.hpp"
#include "app/report/run_files.hpp"
#include "platform/linux/process.hpp"
#include "platform/linux/wakeup.hpp"

namespace firstlook {
namespace {

enum ExitCode : int { kSolved = 0, kUsageError = 2, kDataError = 3, kRejected = 5 };

int fail(const Error& error, int code) {
  fmt::print(stderr, "{}\n", describe(error));
  return code;
}

void narrate(const CalibrationDataset& data) {
  for (const std::string& note : data.notes) fmt::print(stderr, "{}\n", note);
  if (data.source == CalibrationSource::kPairs) {
    fmt::print(stderr, "{} pose pairs\n", data.pairs.size());
  } else {
    fmt::print(stderr, "{}; {}\n", views_text(data),
               data.source == CalibrationSource::kImages ? "corners found in the images" : "corners as given");
  }
}

void narrate_views(const CalibrationDataset& data, const HandEyeResult& result) {
  for (std::size_t i = 0; i < result.fits.size(); ++i) {
    const ViewFit& fit = result.fits[i];
    if (!fit.used) {
      fmt::print(stderr, "  {}: left out, it contradicts the others\n", data.names[i]);
    } else {
      fmt::print(stderr, "  {}: {:.2f} px, arm off by {:.2f} mm {:.2f} mrad\n", data.names[i], fit.reprojection_rms_px,
                 fit.arm_deviation.head<3>().norm() * 1e3, fit.arm_deviation.tail<3>().norm() * 1e3);
    }
  }
}

void print_touch_test(const TouchTest& test) {
  const TouchedBoard& b = test.board;
  const Eigen::Vector3d tip = b.flange_p_tip_m * 1e3, t = test.mean.head<3>() * 1e3, r = test.mean.tail<3>() * 1e3;
  const Vector6d sigma = test.mean_sigma * 1e3, views = test.view_deviation * 1e3;
  fmt::print(
      "touch test       {} of {} touches, {:.2f} mm RMS from the board's corners; tip {} ({:.2f}, {:.2f}, {:.2f}) mm\n",
      b.used, b.fits.size(), b.horn_residual_rms_m * 1e3, b.tip_estimated ? "estimated" : "given", tip.x(), tip.y(),
      tip.z());
  for (const TouchFit& fit : b.fits) {
    if (fit.used) continue;
    fmt::print("                 {} left out: {:.1f} mm off{}\n", fit.name, fit.off_m.norm() * 1e3,
               fit.rather ? ", the tip stood on " + fit.rather_name : "");
  }
  fmt::print(
      "camera's error   ({:.2f}, {:.2f}, {:.2f}) mm ({:.2f}, {:.2f}, {:.2f}) mrad in its axes, mean of {} places\n",
      t.x(), t.y(), t.z(), r.x(), r.y(), r.z(), test.places);
  fmt::print("  expected sigma ({:.2f}, {:.2f}, {:.2f}) mm ({:.2f}, {:.2f}, {:.2f}) mrad\n", sigma[0], sigma[1],
             sigma[2], sigma[3], sigma[4], sigma[5]);
  fmt::print("  over the views ({:.2f}, {:.2f}, {:.2f}) mm ({:.2f}, {:.2f}, {:.2f}) mrad\n", views[0], views[1],
             views[2], views[3], views[4], views[5]);
  if (test.static_looks > 0) {
    const Vector6d s = test.static_deviation * 1e3;
    fmt::print("  static looks   ({:.2f}, {:.2f}, {:.2f}) mm ({:.2f}, {:.2f}, {:.2f}) mrad, {} of them\n", s[0], s[1],
               s[2], s[3], s[4], s[5], test.static_looks);
  }
  fmt::print("  board          chi-square {:.1f} between touched and seen, allowed {:.1f}\n", test.chi2,
             test.chi2_limit);
}

void print_text(const HandEyeResult& r) {
  const Eigen::Vector3d t = r.flange_T_camera.translation() * 1e3;
  const Eigen::Quaterniond q = r.flange_T_camera.quaternion();
  const Eigen::Vector3d st = r.sigma_translation_m * 1e3, sr = r.sigma_rotation_rad * 1e3;
  fmt::print("flange_T_camera  ({:.2f}, {:.2f}, {:.2f}) mm  quaternion xyzw ({:.6f}, {:.6f}, {:.6f}, {:.6f})\n", t.x(),
             t.y(), t.z(), q.x(), q.y(), q.z(), q.w());
  fmt::print("sigma            ({:.2f}, {:.2f}, {:.2f}) mm  ({:.2f}, {:.2f}, {:.2f}) mrad\n", st.x(), st.y(), st.z(),
             sr.x(), sr.y(), sr.z());
  if (const auto& raw = r.closed_form_raw) {
    for (Eigen::Index row = 0; row < 3; ++row) {
      fmt::print("{:<16} [{:9.6f} {:9.6f} {:9.6f} {:9.6f}]\n", row == 0 ? "linear solution" : "", (*raw)(row, 0),
                 (*raw)(row, 1), (*raw)(row, 2), (*raw)(row, 3));
    }
  }
  if (r.intrinsics) {
    const CameraIntrinsics& c = r.camera;
    const IntrinsicsVector s = r.intrinsics->sigma();
    fmt::print("intrinsics       fx {:.2f} fy {:.2f} cx {:.2f} cy {:.2f} px  sigma {:.2f} {:.2f} {:.2f} {:.2f}\n", c.fx,
               c.fy, c.cx, c.cy, s[0], s[1], s[2], s[3]);
    fmt::print("                 k1 {:.4f} k2 {:.4f} p1 {:.5f} p2 {:.5f}  sigma {:.4f} {:.4f} {:.5f} {:.5f}\n", c.k1,
               c.k2, c.p1, c.p2, s[4], s[5], s[6], s[7]);
    if (const std::string& untold = r.intrinsics->untold; !untold.empty()) {
      fmt::print("                 the views hardly tell {}: they cover too little of the picture\n", untold);
    }
  }
  fmt::print("arm sigma        {:.2f} mm  {:.2f} mrad for each axis\n", r.arm_sigma.translation_m * 1e3,
             r.arm_sigma.rotation_rad * 1e3);
  if (!r.from_pairs) {
    fmt::print("reprojection     {:.3f} px RMS in {} {}; held out {:.2f} px\n", r.reprojection_rms_px, r.views,
               r.targets.size() > 1 ? "places of the arm" : "views", r.holdout_rms_px);
  }
  fmt::print("held out         board seen off by {:.2f} mm RMS\n", r.holdout_rms_m * 1e3);
  fmt::print("70 % subsets     spread {:.2f} mm  {:.2f} mrad RMS\n", r.subset_spread_m * 1e3,
             r.subset_spread_rad * 1e3);
  fmt::print("AX = XB          {:.3f} deg {:.2f} mm RMS, the board in base against its mean\n",
             r.board_in_base.rotation_rms_deg, r.board_in_base.translation_rms_mm);
  fmt::print("                 {:.3f} deg {:.2f} mm between all views, {:.3f} deg {:.2f} mm between consecutive ones\n",
             r.ax_xb_all_pairs.rotation_rms_deg, r.ax_xb_all_pairs.translation_rms_mm,
             r.ax_xb_consecutive.rotation_rms_deg, r.ax_xb_consecutive.translation_rms_mm);
  fmt::print("usable distance  {:.2f} m\n", r.usable_distance_m);
  if (r.touch_test) print_touch_test(*r.touch_test);
  fmt::print("verdict          {}\n", r.verdict == Verdict::kAccepted ? "accepted" : "rejected");
  for (const std::string& reason : r.reasons) fmt::print("  {}\n", reason);
  // Of a rejected one it stands among the reasons.
  if (r.likely_mistake && r.verdict == Verdict::kAccepted) fmt::print("left out         {}\n", r.likely_mistake->text);
}

void print_targets(const HandEyeResult& r, const std::vector<std::string>& names) {
  const auto line = [](std::string_view what, std::string_view from, const Pose& pose, const Matrix6d& covariance) {
    const Eigen::Vector3d t = pose.translation() * 1e3;
    const Vector6d sigma = covariance.diagonal().cwiseMax(0).cwiseSqrt() * 1e3;
    fmt::print(
        "{:<16} in {}: ({:.2f}, {:.2f}, {:.2f}) mm, sigma ({:.2f}, {:.2f}, {:.2f}) mm ({:.2f}, {:.2f}, {:.2f}) mrad\n",
        what, from, t.x(), t.y(), t.z(), sigma[0], sigma[1], sigma[2], sigma[3], sigma[4], sigma[5]);
  };
  for (std::size_t k = 0; k < r.targets.size(); ++k) {
    if (r.targets[k].views == 0) fmt::print("{:<16} not solved: no usable view\n", names[k]);
    if (r.targets[k].views > 0) line(names[k], "base", r.targets[k].base_T_board.pose(), r.targets[k].covariance);
  }
  for (std::size_t k = 0; k < names.size(); ++k) {
    for (std::size_t other = k + 1; other < names.size(); ++other) {
      const auto seen = mutual_pose(r.targets, r.joint_covariance, static_cast<int>(k), static_cast<int>(other));
      if (seen) line(names[other], names[k], seen->pose.pose(), seen->covariance);
    }
  }
}

/// In the views of the first target in which something is found.
MistakeSearch find_mistake_of_first(const CalibrationDataset& data) {
  MistakeSearch search;
  for (std::size_t k = 0; k < data.targets.size() && !search.found; ++k) {
    std::vector<CalibrationView> own;
    std::copy_if(data.views.begin(), data.views.end(), std::back_inserter(own),
                 [&](const CalibrationView& view) { return view.target == static_cast<int>(k); });
    search = find_likely_mistake(data.camera, data.targets[k].board, own);
  }
  return search;
}

/// Data that cannot be solved at all: why, and what was likely done wrong.
int fail_to_solve(const CalibrationDataset& data, const Error& error) {
  fail(error, kDataError);
  const MistakeSearch search =
      data.source == CalibrationSource::kPairs ? find_likely_mistake(data.pairs) : find_mistake_of_first(data);
  if (const std::string sentence = search.sentence(); !sentence.empty()) fmt::print(stderr, "{}\n", sentence);
  return kDataError;
}

/// What of the camera is to be solved for.
Result<EstimatedIntrinsics> intrinsics_asked(const std::string& word, const CalibrationDataset& data) {
  const bool pairs = data.source == CalibrationSource::kPairs;
  if (pairs && word == "estimate") {
    return failure(Fault::kUsage, "--intrinsics estimate: pose pairs have no corners to tell them from");
  }
  if (data.intrinsics_estimated && word == "given") {
    return failure(Fault::kUsage, "--intrinsics given: the dataset has no camera_info.yaml");
  }
  return word == "estimate" || data.intrinsics_estimated ? EstimatedIntrinsics::kWithoutK3 : EstimatedIntrinsics::kNone;
}

/// The touch test, where somebody touched the board.
Status test_by_touch(const CalibrationDataset& data, const HandEyeOptions& options, HandEyeResult& result) {
  if (!data.touched) return {};
  if (data.source == CalibrationSource::kPairs) {
    return test_hand_eye_by_touch(data.board, *data.touched, used_pairs(data.pairs, result), options.limits.touch,
                                  result);
  }
  const std::vector<BoardSpec> boards = boards_of(data.targets);
  return test_hand_eye_by_touch(boards, *data.touched, used_pairs(data.camera, boards, data.views, result),
                                options.limits.touch, result);
}

/// The last part of a folder's name, whatever it ends with.
std::string name_of_folder(const std::string& folder) {
  const auto path = std::filesystem::path(folder).lexically_normal();
  return (path.has_filename() ? path : path.parent_path()).filename().string();
}

Status write_files(const CalibrateCommandOptions& options, const CalibrationDataset& data, const RunRecord& record,
                   const HandEyeOptions& hand_eye) {
  const HandEyeResult& result = *record.hand_eye;
  const std::string_view arm = options.arm.empty() ? kUnknownArm : std::string_view(options.arm);
  StoredCalibration calibration = stored_calibration(result, solver_name(hand_eye.solver), arm);
  if (data.source != CalibrationSource::kPairs) calibration.intrinsics = result.camera;
  std::vector<NamedFile> files = calibration_files(calibration);
  if (calibration.intrinsics.width > 0) {
    files.push_back({"camera_info.yaml", camera_info_yaml(calibration.intrinsics)});
  }
  files.push_back({"report.html", dataset_report_html(record, data)});
  files.push_back({"result.json", result_json(record)});
  if (Status written = write_named_files(options.out, files); !written) return written;
  fmt::print(stderr, "{}: report.html, result.json, {}\n", options.out,
             calibration.accepted ? "hand_eye.yaml and what ROS loads, in ros/"
                                  : "hand_eye.yaml, which says that it is rejected; nothing for ROS is made of it");
  if (arm == kUnknownArm) fmt::print(stderr, "without --arm no job takes hand_eye.yaml up again\n");
  return {};
}

}  // namespace

int run_calibrate_command(const CalibrateCommandOptions& options) {
  const std::string started = utc_date_text();
  const std::int64_t start_ns = monotonic_ns();
  HandEyeOptions hand_eye;
  if (!options.solver.empty()) {
    const auto solver = find_solver(options.solver);
    if (!solver) {
      fmt::print(stderr, "unknown solver '{}'; known: {}\n", options.solver, fmt::join(solver_names(), ", "));
      return kUsageError;
    }
    hand_eye.solver = *solver;
  }
  if (options.dataset.empty()) {
    fmt::print(stderr, "no dataset named: firstlook calibrate --dataset DIR\n");
    return kUsageError;
  }
  const auto preset = find_detector_preset(options.detector);
  if (!preset) {
    fmt::print(stderr, "unknown detector '{}': {}\n", options.detector, fmt::join(detector_preset_names(), ", "));
    return kUsageError;
  }
  if (!options.arm.empty() && !find_arm_model(options.arm)) {
    fmt::print(stderr, "unknown arm '{}': ur3, ur5, ur10, ur3e, ur5e, ur10e\n", options.arm);
    return kUsageError;
  }
  if (!options.out.empty()) {
    if (const Status fresh = check_run_folder(options.out); !fresh) return fail(fresh.error(), kDataError);
  }
  auto data = read_calibration_dataset(options.dataset, preset->detection);
  if (!data) return fail(data.error(), kDataError);
  narrate(*data);
  const auto intrinsics = intrinsics_asked(options.intrinsics, *data);
  if (!intrinsics) return fail(intrinsics.error(), kUsageError);
  hand_eye.refinement.intrinsics = *intrinsics;
  auto result = data->source == CalibrationSource::kPairs
                    ? calibrate_hand_eye_from_pairs(data->pairs, hand_eye)
                    : calibrate_hand_eye(data->camera, boards_of(data->targets), data->views, hand_eye);
  if (!result) return fail_to_solve(*data, result.error());
  if (result->intrinsics) data->camera = result->camera;  // what all that is written holds for
  if (const Status touched = test_by_touch(*data, hand_eye, *result); !touched)
    return fail(touched.error(), kDataError);
  narrate_views(*data, *result);
  std::vector<std::string> names;
  for (const NamedTarget& target : data->targets) names.push_back(target.name);
  nlohmann::json hand_eye_object = hand_eye_json(*result, kFlangeFrame, solver_name(hand_eye.solver));
  if (names.size() > 1) describe_targets(*result, names, hand_eye_object);
  if (!options.out.empty()) {
    RunRecord record = record_of_dataset(options.dataset, *data, *result, hand_eye);
    record.cell = name_of_folder(options.dataset);
    record.provenance.version = version_text();
    record.wall.started = started;
    record.wall.folder = options.out;
    record.wall.total_s = static_cast<double>(monotonic_ns() - start_ns) * 1e-9;
    record.wall.workers = 1;
    if (const Status s = write_files(options, *data, record, hand_eye); !s) return fail(s.error(), kDataError);
    hand_eye_object["solver_comparison"] = solver_comparison_json(*record.comparison);
  }
  if (options.json) {
    fmt::print("{}\n", hand_eye_object.dump(2));
  } else {
    print_text(*result);
    if (names.size() > 1) print_targets(*result, names);
  }
  std::fflush(stdout);
  return options.strict && result->verdict == Verdict::kRejected ? kRejected : kSolved;
}

}  // namespace firstlook
