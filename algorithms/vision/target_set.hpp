/// Several targets in one cell: which of them an image shows, and which sets a detector could not tell apart.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "algorithms/vision/checkerboard.hpp"
#include "algorithms/vision/target.hpp"

namespace firstlook {

/// Targets that one cell may have; memory and time of a joint solve grow with them.
inline constexpr int kTargetsMax = 16;

struct NamedTarget {
  std::string name;
  BoardSpec board;
};

/// One target or several, as functions take them; a number in it is what CalibrationView::target means.
class Targets {
 public:
  // Implicit on purpose: who has one target passes it as it is.
  Targets(const BoardSpec& one) : several_(&one, 1) {}                   // NOLINT
  Targets(std::span<const BoardSpec> several) : several_(several) {}     // NOLINT
  Targets(const std::vector<BoardSpec>& several) : several_(several) {}  // NOLINT
  [[nodiscard]] int size() const { return static_cast<int>(several_.size()); }
  [[nodiscard]] const BoardSpec& operator[](int target) const { return several_[static_cast<std::size_t>(target)]; }
  [[nodiscard]] bool has(int target) const { return target >= 0 && target < size(); }

 private:
  std::span<const BoardSpec> several_;
};

/// The boards without their names.
[[nodiscard]] std::vector<BoardSpec> boards_of(std::span<const NamedTarget> targets);

/// Refuses no target and more than kTargetsMax, names that are empty, repeated or
/// no text of a table, and any two targets of which a
/// detector could take one for the other: lattices with the same counts either way round (the size of the squares
/// does not show in an image), markers that share codes, two pattern markers.
/// @return kConfigBadValue with both names, the reason, and what to change
[[nodiscard]] Status check_distinct(std::span<const NamedTarget> targets);

/// What one image shows of one target.
struct TargetSighting {
  int target = 0;
  CornerSet points;
};

/// Every target that the image shows, in their order; empty when none is found.
/// @return the errors of detect_target other than kBoardNotFound
[[nodiscard]] Result<std::vector<TargetSighting>> detect_targets(GrayImage image, const Targets& targets,
                                                                 const DetectionOptions& options = {});

}  // namespace firstlook
