#include <fmt/format.h>

#include <algorithm>
#include <numbers>

#include "algorithms/vision/rotation.hpp"
#include "app/report/charts.hpp"
#include "app/report/html.hpp"
#include "app/report/picture_bytes.hpp"
#include "app/report/ros_files.hpp"
#include "app/report/sections.hpp"
#include "app/report/settling.hpp"

namespace firstlook {
namespace {

constexpr double kDegrees = 180.0 / std::numbers::pi;

std::string transform_table(const HandEyeResult& h) {
  const auto row = [](std::string_view name, const Eigen::Vector3d& v, int digits) {
    // Adding 0 turns -0 into 0.
    return std::vector<std::string>{std::string(name), fmt::format("{:.{}f}", v.x() + 0.0, digits),
                                    fmt::format("{:.{}f}", v.y() + 0.0, digits),
                                    fmt::format("{:.{}f}", v.z() + 0.0, digits)};
  };
  HtmlTable table({"", "x", "y", "z"}, 1);
  table.row(row("translation, mm", h.flange_T_camera.translation() * 1e3, 2));
  table.row(row("± 1σ, mm", h.sigma_translation_m * 1e3, 3));
  table.row(row("roll, pitch, yaw, degrees", roll_pitch_yaw(h.flange_T_camera.rotation()) * kDegrees, 3));
  table.row(row("± 1σ about the flange's axes, mrad", h.sigma_rotation_rad * 1e3, 3));
  return table.html();
}

/// A figure of the validation, or that there was none.
std::string validated(const HandEyeResult& h, std::string text) {
  return h.holdout_rms_m > 0 ? std::move(text) : std::string("not determined");
}

std::string how_it_settled(const SettlingSummary& s) {
  std::string text = "from frame to frame of a stop, one frame; ";
  text += s.looked_again == 0
              ? "at every stop the first look was at rest"
              : fmt::format("at {} stops the picture still moved at first, and was looked at up to {} times",
                            s.looked_again, s.looks_max);
  if (s.restless > 0) {
    text +=
        fmt::format("; at {} it never stood still ({:.2f} px): is the cart, the board or the camera's bracket shaking?",
                    s.restless, s.moved_max_px);
  }
  return text;
}

/// Estimated intrinsics with their sigmas.
void intrinsics_rows(const CameraIntrinsics& c, const IntrinsicsFit& fit, HtmlTable& table) {
  const IntrinsicsVector s = fit.sigma();
  table.row({"focal lengths", fmt::format("{:.2f} ± {:.2f}, {:.2f} ± {:.2f} px", c.fx, s[0], c.fy, s[1]),
             "estimated together with the rest, ± 1σ; what they leave open is in the sigmas above"});
  table.row({"centre of the picture", fmt::format("{:.2f} ± {:.2f}, {:.2f} ± {:.2f} px", c.cx, s[2], c.cy, s[3]),
             "the same"});
  table.row({"distortion k1, k2", fmt::format("{:.4f} ± {:.4f}, {:.4f} ± {:.4f}", c.k1, s[4], c.k2, s[5]), "the same"});
  table.row({"distortion p1, p2", fmt::format("{:.5f} ± {:.5f}, {:.5f} ± {:.5f}", c.p1, s[6], c.p2, s[7]),
             fit.untold.empty()
                 ? std::string("the same")
                 : fmt::format("the views hardly tell {}: they cover too little of the picture", fit.untold)});
}

std::string quality_table(const RunRecord& record) {
  const HandEyeResult& h = *record.hand_eye;
  HtmlTable table({"figure", "value", "what it says"}, 3);
  if (!h.from_pairs) {
    table.row(
        {"reprojection error", fmt::format("{:.3f} px RMS", h.reprojection_rms_px),
         "how well the views fit once each is granted a deviation of the arm; small is necessary, not sufficient"});
    table.row({"held-out reprojection error", validated(h, fmt::format("{:.3f} px RMS", h.holdout_rms_px)),
               "each view predicted by a solve without it (every fifth view left out at a time), the arm's own error "
               "included"});
  }
  table.row({"held-out board position", validated(h, fmt::format("{:.2f} mm RMS", h.holdout_rms_m * 1e3)),
             "where the other views put the board against where this one sees it"});
  table.row({"spread over subsets",
             fmt::format("{:.2f} mm, {:.2f} mrad", h.subset_spread_m * 1e3, h.subset_spread_rad * 1e3),
             "RMS difference of solves on random subsets of the views"});
  table.row({"the arm's pose noise",
             fmt::format("{:.3f} mm, {:.3f} mrad", h.arm_sigma.translation_m * 1e3, h.arm_sigma.rotation_rad * 1e3),
             "for each axis, estimated from the views"});
  if (!h.from_pairs) {
    table.row({"corner noise", fmt::format("{:.3f} px", h.corner_sigma_px), "estimated from the views"});
  }
  if (h.intrinsics) intrinsics_rows(h.camera, *h.intrinsics, table);
  if (const auto settling = settling_of(record.calibration_views)) {
    table.row(
        {"picture at rest", fmt::format("corners scatter {:.3f} px", settling->scatter_px), how_it_settled(*settling)});
  }
  table.row({"usable distance", fmt::format("{:.2f} m", h.usable_distance_m),
             "farthest object at which a 3σ error stays within the gripper's tolerance"});
  const auto gated = std::count_if(h.fits.begin(), h.fits.end(), [](const ViewFit& fit) { return !fit.used; });
  const auto near = std::count_if(record.calibration_views.begin(), record.calibration_views.end(),
                                  [](const CalibrationViewRecord& view) { return !view.counted; });
  table.row({h.targets.size() > 1 ? "places of the arm" : "views",
             fmt::format("{} used, {} left out as wrong, {} too near another", h.views, gated, near),
             fmt::format("closed form: {}", record.solver)});
  return table.html();
}

std::string snippets(const HandEyeResult& h) {
  if (h.verdict != Verdict::kAccepted)
    return paragraph("No files for other programs are written from a rejected calibration.");
  std::string html = "<h3>Use it</h3>\n";
  html += "<p>ROS 2, now (the same as <code>ros/camera_transform.launch.py</code>):</p>\n<pre>" +
          escape_html(ros2_static_transform_command(h.flange_T_camera)) + "</pre>\n";
  html += "<p>URScript, camera in the flange (metres, rotation vector):</p>\n<pre>" +
          escape_html("flange_T_camera = " + ur_pose_text(h.flange_T_camera)) + "</pre>\n";
  html +=
      "<p>easy_handeye2: copy <code>ros/easy_handeye2.calib</code> to "
      "<code>~/.ros2/easy_handeye2/calibrations/firstlook.calib</code>, then <code>ros2 launch easy_handeye2 "
      "publish.launch.py name:=firstlook</code>. easy_handeye (ROS 1): <code>ros/easy_handeye.yaml</code> to "
      "<code>~/.ros/easy_handeye/firstlook_eye_on_hand.yaml</code>, then <code>roslaunch easy_handeye publish.launch "
      "eye_on_hand:=true namespace_prefix:=firstlook</code>. In a robot description: include "
      "<code>ros/camera.xacro</code> and call <code>&lt;xacro:firstlook_camera/&gt;</code>. Publish the transform in "
      "one "
      "of these ways only, and not when the camera's own driver publishes a parent of "
      "<code>camera_color_optical_frame</code>: then take the xacro, whose <code>camera_link</code> is that "
      "parent.</p>\n"
      "<p class=\"hint\">Mind the base: the controller's <code>base</code> (pendant, map files) and ROS "
      "<code>base_link</code> share their origin but are turned by 180° about z. The camera's pose in the flange is "
      "the "
      "same for both; the map is not, so <code>ros/</code> holds the collision scene once for each.</p>\n";
  return html;
}

/// The picture for the page.
std::string picture_base64(const GrayPicture& whole, int width_max, CornerPicture& out) {
  double scale = 1;
  const GrayPicture shown = shrink(whole, width_max, scale);
  out.picture_width = shown.width / scale;
  out.picture_height = shown.height / scale;
  return base64(encode_jpeg(shown));
}

bool is_whole(const GrayPicture& p) {
  return p.width > 0 && p.height > 0 &&
         p.pixels.size() == static_cast<std::size_t>(p.width) * static_cast<std::size_t>(p.height);
}

std::string what_became_of(const CalibrationViewRecord& view) {
  if (!view.counted) return " · not solved with: too near a later view";
  if (!view.used) return " · left out as wrong";
  return view.holdout_px ? fmt::format(" · held out {:.3f} px", *view.holdout_px) : std::string();
}

std::string view_figure(const CalibrationViewRecord& view, std::size_t number, const CameraIntrinsics& camera,
                        int width_max) {
  CornerPicture picture{std::max(1, camera.width), std::max(1, camera.height), 0, 0, {}};
  if (is_whole(view.picture)) {
    picture.width = view.picture.width;
    picture.height = view.picture.height;
    picture.jpeg_base64 = picture_base64(view.picture, width_max, picture);
  }
  const Eigen::Vector3d flange = view.base_T_flange.translation();
  return fmt::format(
      "<figure class=\"shot\" id=\"view{0}\"><a href=\"#view{0}\">\n{1}</a>"
      "<figcaption><b>{0}</b> · {2}{3}<br><span>{4} · flange at {5:.2f}, {6:.2f}, {7:.2f} m</span></figcaption>"
      "<a class=\"close\" href=\"#calibration-views\">close</a></figure>\n",
      number, corner_picture(view, picture),
      view.reprojected_px.empty() ? std::string("not solved") : fmt::format("{:.3f} px", view.rms_px),
      what_became_of(view), view.name.empty() ? fmt::format("{:.0f} s", view.time_s) : escape_html(view.name),
      flange.x(), flange.y(), flange.z());
}

}  // namespace

std::string hand_eye_section(const RunRecord& record) {
  if (!record.hand_eye) {
    return section("hand-eye", "Where the camera sits on the arm", paragraph("No calibration was solved in this run."));
  }
  const HandEyeResult& h = *record.hand_eye;
  std::string body =
      "<p>Pose of the camera (optical frame: z forward, x right, y down) in the flange <code>tool0</code>.</p>\n";
  body += transform_table(h) + "<h3>How good it is</h3>\n";
  body += record.verified ? verification_table(record) : quality_table(record);
  body += alignment_table(record);
  if (h.likely_mistake) body += "<p class=\"hint\">" + escape_html(h.likely_mistake->text) + ".</p>\n";
  body += snippets(h);
  return section("hand-eye", "Where the camera sits on the arm", body);
}

std::string calibration_views_section(const RunRecord& record) {
  const auto& views = record.calibration_views;
  if (views.empty()) return {};
  std::string body = "<div class=\"pair\">\n" + view_rms_chart(views) + residual_chart(views) + "</div>\n";
  body +=
      "<p class=\"hint\"><span class=\"key detected\">○</span> detected corners, <span class=\"key "
      "reprojected\">+</span> "
      "corners as the calibration predicts them from where the arm says it stood. ";
  body += record.verified ? "These views tested the stored calibration and took no part in it. "
                          : "The solve grants each view a small deviation of the arm, so these figures are larger than "
                            "its own reprojection error. Held out is the same figure under a solve without this view. ";
  body += "Select a picture to enlarge it.</p>\n<div class=\"shots\">\n";
  constexpr int kWidthMax = 640;  // about 25 kB each: the page stays below some 3 MB
  const std::size_t shown = std::min(views.size(), kViewsShownMax);
  for (std::size_t i = 0; i < shown; ++i) body += view_figure(views[i], i + 1, record.intrinsics, kWidthMax);
  body += "</div>\n";
  if (shown < views.size()) body += paragraph(fmt::format("The first {} of {} views are shown.", shown, views.size()));
  return section("calibration-views", "Views of the board", body);
}

}  // namespace firstlook
