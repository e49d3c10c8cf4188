#include "hal/sim/known_times.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace firstlook::sim {

void KnownTimes::watch(const KnownFreeView* view) {
  view_ = view;
  if (view == nullptr) return;  // what was noted is still asked for
  revision_ = view->revision();
  unknown_.resize(view->geometry().count());
  std::iota(unknown_.begin(), unknown_.end(), 0U);
  since_s_.assign(unknown_.size(), kNever_s);
}

void KnownTimes::note(Instant now) {
  if (view_ == nullptr || view_->revision() == revision_) return;
  revision_ = view_->revision();
  std::erase_if(unknown_, [&](std::uint32_t voxel) {
    if (!view_->known(voxel)) return false;
    since_s_[voxel] = static_cast<float>(now.seconds());
    return true;
  });
}

std::optional<double> KnownTimes::time_s(std::span<const std::uint8_t> marks, double share) const {
  if (marks.size() != since_s_.size()) return std::nullopt;
  std::vector<float> times;
  for (std::size_t i = 0; i < marks.size(); ++i) {
    if (marks[i] != 0) times.push_back(since_s_[i]);
  }
  const auto wanted = static_cast<std::size_t>(std::ceil(share * static_cast<double>(times.size())));
  if (wanted == 0) return std::nullopt;
  const auto last = times.begin() + static_cast<std::ptrdiff_t>(wanted - 1);
  std::nth_element(times.begin(), last, times.end());
  if (*last == kNever_s) return std::nullopt;
  return static_cast<double>(*last);
}

}  // namespace firstlook::sim
