#include "algorithms/calibration/likely_mistake.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "algorithms/calibration/mistakes/angle_mistakes.hpp"
#include "algorithms/calibration/mistakes/corner_mistakes.hpp"
#include "algorithms/calibration/mistakes/placement_mistakes.hpp"
#include "algorithms/calibration/mistakes/scale_mistake.hpp"
#include "algorithms/calibration/mistakes/whole_set_mistakes.hpp"

namespace firstlook {
namespace {

using namespace mistakes;

// 1 mm and 1 mrad: good data is not searched for mistakes, however it came to be rejected.
constexpr double kNothingWrong_m = 1.5e-3;
// Real sets of the better kind agree within 5 mm and 0.5 degrees.
constexpr double kExplained_m = 0.02;

std::string figures(const Misfit& misfit) {
  return fmt::format("{:.2f} mm and {:.2f} mrad", misfit.translation_m * 1e3, misfit.rotation_rad * 1e3);
}

/// Tries one after the other and keeps the best; a later one must be clearly better than an earlier, simpler one.
class Search {
 public:
  explicit Search(std::optional<Fit> as_given) : as_given_(std::move(as_given)) {}

  void consider(const Trial& trial) {
    constexpr double kClearlyBetter = 1.5;
    ++tried_;
    const auto fit = fit_of(trial.pairs);
    if (!fit || !explains(fit->misfit, trial)) return;
    const bool as_good = best_ && best_fit_.misfit.size_m() < kClearlyBetter * fit->misfit.size_m();
    if (as_good && !is_likelier_inversion(trial, *fit)) return;
    best_ = trial;
    best_fit_ = *fit;
  }
  void consider(const std::vector<Trial>& trials) {
    for (const Trial& trial : trials) consider(trial);
  }

  [[nodiscard]] MistakeSearch result() const {
    MistakeSearch search;
    search.tried = tried_;
    if (as_given_) search.as_given = as_given_->misfit;
    if (!best_) return search;
    const std::string before =
        as_given_ ? "as given within " + figures(as_given_->misfit) : std::string("as given they cannot be solved");
    search.found = LikelyMistake{best_->mistake,
                                 fmt::format("likely mistake: {}; without it the views agree within {} (median), {}",
                                             best_->text, figures(best_fit_.misfit), before),
                                 search.as_given, best_fit_.misfit};
    return search;
  }
  [[nodiscard]] bool is_open() const { return !best_; }

 private:
  /// Inverting the arm's poses and inverting the board's make the views agree alike: one gives the camera in the
  /// flange, the other the board in the base in its place. The shorter one is the camera's.
  [[nodiscard]] bool is_likelier_inversion(const Trial& trial, const Fit& fit) const {
    return trial.mistake == Mistake::kBoardPosesInverted && best_->mistake == Mistake::kFlangePosesInverted &&
           fit.flange_T_camera.translation().norm() < best_fit_.flange_T_camera.translation().norm();
  }

  [[nodiscard]] bool explains(const Misfit& after, const Trial& trial) const {
    if (after.size_m() > kExplained_m) return false;
    // Few views fit many things: six unknowns stand against twelve equations of three views, 24 of five.
    const double gain_min = trial.pairs.size() < 5 ? 10 : trial.gain_min;
    return !as_given_ || as_given_->misfit.size_m() >= gain_min * after.size_m();
  }

  std::optional<Fit> as_given_;
  std::optional<Trial> best_;
  Fit best_fit_;
  int tried_ = 0;
};

MistakeSearch alike(std::string text) {
  MistakeSearch search;
  search.found = LikelyMistake{Mistake::kViewsAlike, "likely mistake: " + std::move(text), {}, {}};
  return search;
}

void consider_angles(std::span<const PosePair> pairs, bool of_flange, Search& search) {
  const std::vector<PosePair> some = thinned(pairs);
  const auto positions = fit_positions(some, of_flange);
  if (positions && positions->median_m < kExplained_m) search.consider(angle_trials(some, *positions, of_flange));
}

void consider_pairs(std::span<const PosePair> pairs, const std::optional<Fit>& as_given, const BoardSpec* board,
                    Search& search) {
  search.consider(whole_set_trials(pairs, board == nullptr));
  search.consider(order_trials(pairs));
  if (as_given) {
    const auto scale = scale_trial(pairs, as_given->flange_T_camera, board == nullptr ? 0 : board->square_size_m);
    if (scale) search.consider(*scale);
  }
  consider_angles(pairs, true, search);
  if (board == nullptr) consider_angles(pairs, false, search);
  if (!search.is_open()) return;
  if (const auto placements = placement_trial(pairs, board)) search.consider(*placements);
}

bool nothing_wrong(const std::optional<Fit>& as_given) {
  return as_given && as_given->misfit.size_m() < kNothingWrong_m;
}

}  // namespace

std::string MistakeSearch::sentence() const {
  if (found) return found->text;
  if (tried == 0) return {};
  return fmt::format("none of {} usual mistakes explains it{}", tried,
                     as_given ? "; as given the views agree within " + figures(*as_given) + " (median)" : "");
}

MistakeSearch find_likely_mistake(std::span<const PosePair> pairs, const BoardSpec* board) {
  if (pairs.size() < 3) return {};
  if (std::string text = explain_views_alike(pairs); !text.empty()) return alike(std::move(text));
  const std::optional<Fit> as_given = fit_of(pairs);
  Search search(as_given);
  if (!nothing_wrong(as_given)) consider_pairs(pairs, as_given, board, search);
  return search.result();
}

MistakeSearch find_likely_mistake(const CameraIntrinsics& camera, const BoardSpec& board,
                                  std::span<const CalibrationView> views) {
  if (views.size() < 3) return {};
  const ViewPairs seen = pairs_of(camera, board, views);
  const bool most_seen = seen.pairs.size() >= 3 && 10 * seen.pairs.size() >= 7 * views.size();
  if (most_seen) {
    if (std::string text = explain_views_alike(seen.pairs); !text.empty()) return alike(std::move(text));
  }
  const std::optional<Fit> as_given = most_seen ? fit_of(seen.pairs) : std::nullopt;
  Search search(as_given);
  if (nothing_wrong(as_given)) return search.result();
  if (most_seen) consider_pairs(seen.pairs, as_given, &board, search);
  search.consider(corner_trials(camera, board, views));
  return search.result();
}

}  // namespace firstlook
