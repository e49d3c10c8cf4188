#include "algorithms/vision/target_set.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "algorithms/vision/target_detection.hpp"

namespace firstlook {
namespace {

bool same_counts(const BoardSpec& a, const BoardSpec& b) {
  return (a.inner_columns == b.inner_columns && a.inner_rows == b.inner_rows) ||
         (a.inner_columns == b.inner_rows && a.inner_rows == b.inner_columns);
}

bool has_coded_markers(const BoardSpec& board) {
  return board.type == TargetType::kCharuco || board.type == TargetType::kMarkerGrid;
}

bool is_square_lattice(const BoardSpec& board) {
  return board.type == TargetType::kCheckerboard || board.type == TargetType::kCharuco;
}

/// A marker number of `a` whose code is also one of `b`'s, however the marker is turned: dictionaries of the same cells
/// begin with the same codes, so their names alone tell nothing.
std::optional<int> shared_marker(const BoardSpec& a, const BoardSpec& b) {
  const int bits = marker_family(a.dictionary).bits;
  if (bits != marker_family(b.dictionary).bits) return std::nullopt;
  std::vector<std::uint64_t> known;
  for (int m = 0; m < b.markers(); ++m) {
    std::uint64_t code = marker_code(b.dictionary, b.first_id + m);
    for (int turn = 0; turn < 4; ++turn, code = turned_code(code, bits)) known.push_back(code);
  }
  for (int m = 0; m < a.markers(); ++m) {
    const std::uint64_t code = marker_code(a.dictionary, a.first_id + m);
    if (std::find(known.begin(), known.end(), code) != known.end()) return a.first_id + m;
  }
  return std::nullopt;
}

/// Why a detector could take one for the other and what would help; empty when it cannot.
std::string confusion(const BoardSpec& a, const BoardSpec& b) {
  if (has_coded_markers(a) && has_coded_markers(b)) {
    if (const auto marker = shared_marker(a, b)) {
      return fmt::format("marker {} of {} is on both: give one of them another dictionary, or a first_id from {} on",
                         *marker, marker_family(a.dictionary).name,
                         std::max(a.first_id + a.markers(), b.first_id + b.markers()));
    }
  }
  const bool lattices =
      is_square_lattice(a) && is_square_lattice(b) && (!has_coded_markers(a) || !has_coded_markers(b));
  const bool circles = a.type == b.type && (a.type == TargetType::kCircles || a.type == TargetType::kAsymmetricCircles);
  if ((lattices || circles) && same_counts(a, b)) {
    return fmt::format(
        "both have {}x{} points, and the size of their {} does not show in an image: give one of them other counts, or "
        "take a ChArUco board or a marker grid with numbers of its own for each",
        a.inner_columns, a.inner_rows, circles ? "circles" : "squares");
  }
  if (a.type == TargetType::kPatternMarker && b.type == TargetType::kPatternMarker) {
    return "both show the same picture: take markers with numbers (type marker or apriltag)";
  }
  return {};
}

/// Names stand in columns of corners.csv and between quotes in YAML.
bool fits_a_table(std::string_view name) {
  return std::ranges::all_of(
      name, [](char c) { return static_cast<unsigned char>(c) >= ' ' && c != ',' && c != '"' && c != '\\'; });
}

}  // namespace

std::vector<BoardSpec> boards_of(std::span<const NamedTarget> targets) {
  std::vector<BoardSpec> boards;
  for (const NamedTarget& target : targets) boards.push_back(target.board);
  return boards;
}

Status check_distinct(std::span<const NamedTarget> targets) {
  if (targets.empty()) return failure(Fault::kConfigBadValue, "no target in the list: name one at least");
  if (targets.size() > static_cast<std::size_t>(kTargetsMax)) {
    return failure(Fault::kConfigBadValue, "{} targets, at most {} are solved together", targets.size(), kTargetsMax);
  }
  for (std::size_t j = 0; j < targets.size(); ++j) {
    if (targets[j].name.empty()) return failure(Fault::kConfigBadValue, "target number {} has no name", j + 1);
    if (!fits_a_table(targets[j].name)) {
      return failure(Fault::kConfigBadValue, "the name of target number {} has a comma, a quote or a control character",
                     j + 1);
    }
    for (std::size_t i = 0; i < j; ++i) {
      if (targets[i].name == targets[j].name) {
        return failure(Fault::kConfigBadValue, "two targets are named '{:.40}': give each a name of its own",
                       targets[j].name);
      }
      const std::string why = confusion(targets[i].board, targets[j].board);
      if (why.empty()) continue;
      return failure(Fault::kConfigBadValue, "'{:.40}' and '{:.40}' could be taken for each other: {}", targets[i].name,
                     targets[j].name, why);
    }
  }
  return {};
}

Result<std::vector<TargetSighting>> detect_targets(GrayImage image, const Targets& targets,
                                                   const DetectionOptions& options) {
  std::vector<TargetSighting> seen;
  for (int k = 0; k < targets.size(); ++k) {
    auto points = detect_target(image, targets[k], options);
    if (points) {
      seen.push_back({k, std::move(*points)});
    } else if (points.error().fault != Fault::kBoardNotFound) {
      return std::unexpected(points.error());
    }
  }
  return seen;
}

}  // namespace firstlook
