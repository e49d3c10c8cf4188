#include "app/report/done_text.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace firstlook {
namespace {

std::string boards_text(const HandEyeResult& h) {
  const auto solved = std::ranges::count_if(h.targets, [](const TargetPose& target) { return target.views > 0; });
  return solved > 1 ? fmt::format("{} boards", solved) : "the board";
}

std::string calibration_text(const HandEyeResult& h) {
  return fmt::format("camera known to {:.2f} mm and {:.2f} mrad (1 sigma, worst axis) from {} views of {}",
                     h.sigma_translation_m.maxCoeff() * 1e3, h.sigma_rotation_rad.maxCoeff() * 1e3, h.views,
                     boards_text(h));
}

std::string verified_text(const HandEyeResult& h, const VerifiedCalibration& v) {
  return fmt::format(
      "stored calibration ({:.2f} mm and {:.2f} mrad, 1 sigma, worst axis) holds on {} views of the board",
      h.sigma_translation_m.maxCoeff() * 1e3, h.sigma_rotation_rad.maxCoeff() * 1e3,
      v.verification ? v.verification->views.size() : 0);
}

std::string mapping_text(const MappingRecord& m) {
  const VoxelCounts& v = m.voxels;
  const auto total = static_cast<double>(std::max<std::size_t>(1, v.unknown + v.free + v.occupied));
  return fmt::format("{:.1f} % of the space in reach known after {} views",
                     100 * static_cast<double>(v.free + v.occupied) / total, m.views.size());
}

}  // namespace

std::string done_text(const RunRecord& record) {
  std::string text;
  if (record.hand_eye) {
    text = record.verified ? verified_text(*record.hand_eye, *record.verified) : calibration_text(*record.hand_eye);
  }
  if (record.mapping) text += (text.empty() ? "" : "; ") + mapping_text(*record.mapping);
  return text.empty() ? "nothing was asked for" : text;
}

}  // namespace firstlook
