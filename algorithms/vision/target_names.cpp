#include "algorithms/vision/target_names.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <vector>

namespace firstlook {
namespace {

struct Kind {
  std::string_view name;
  TargetType type;
  bool alone = false;                                       ///< one marker
  double mark_share = 0;                                    ///< usual size of a mark, of the spacing
  MarkerDictionary dictionary = MarkerDictionary::k4x4_50;  ///< of "auto"
};

constexpr std::array<Kind, 9> kKinds = {{
    {"checkerboard", TargetType::kCheckerboard},
    {"circles", TargetType::kCircles, false, 0.6},
    {"asymmetric_circles", TargetType::kAsymmetricCircles, false, 0.8},
    {"charuco", TargetType::kCharuco, false, 0.75, MarkerDictionary::k4x4_250},
    {"aruco", TargetType::kMarkerGrid, false, 0.75, MarkerDictionary::k4x4_250},
    {"apriltag", TargetType::kMarkerGrid, false, 0.75, MarkerDictionary::kAprilTag36h11},
    {"artoolkitplus", TargetType::kMarkerGrid, false, 0.75, MarkerDictionary::kArtoolkitPlusBch},
    {"marker", TargetType::kMarkerGrid, true, 1.0, MarkerDictionary::kAprilTag36h11},
    {"artoolkit", TargetType::kPatternMarker, true, 1.0},
}};

bool is_april(MarkerDictionary d) {
  return d >= MarkerDictionary::kAprilTag16h5 && d <= MarkerDictionary::kAprilTag36h11;
}

/// A grid is called after the family of its markers.
bool family_fits(const Kind& kind, MarkerDictionary d) {
  if (kind.name == "apriltag") return is_april(d);
  if (kind.name == "artoolkitplus") return d == MarkerDictionary::kArtoolkitPlusBch;
  if (kind.name == "aruco") return d <= MarkerDictionary::kArucoOriginal;
  return true;
}

const Kind& kind_of(const BoardSpec& board) {
  const auto* const found = std::find_if(kKinds.begin(), kKinds.end(), [&](const Kind& kind) {
    const bool alone = board.has_marker_corners() && board.corners() == 4;
    return kind.type == board.type &&
           (board.type != TargetType::kMarkerGrid || (kind.alone == alone && family_fits(kind, board.dictionary)));
  });
  return found == kKinds.end() ? kKinds.front() : *found;
}

}  // namespace

std::span<const std::string_view> target_type_names() {
  static const auto kNames = [] {
    std::array<std::string_view, kKinds.size()> names;
    std::transform(kKinds.begin(), kKinds.end(), names.begin(), [](const Kind& kind) { return kind.name; });
    return names;
  }();
  return kNames;
}

std::span<const std::string_view> dictionary_names() {
  static const auto kNames = [] {
    std::array<std::string_view, kMarkerDictionaries + 1> names{"auto"};
    for (int i = 0; i < kMarkerDictionaries; ++i) {
      names[static_cast<std::size_t>(i) + 1] = marker_family(static_cast<MarkerDictionary>(i)).name;
    }
    return names;
  }();
  return kNames;
}

Result<BoardSpec> target_from_words(const TargetWords& words) {
  const auto* const kind =
      std::find_if(kKinds.begin(), kKinds.end(), [&](const Kind& k) { return k.name == words.type; });
  if (kind == kKinds.end()) {
    return failure(Fault::kConfigBadValue, "no target of type '{:.30}'; one of {}", words.type,
                   fmt::join(target_type_names(), ", "));
  }
  BoardSpec board{kind->alone ? 1 : words.columns, kind->alone ? 1 : words.rows, words.spacing_m, kind->type};
  if (kind->mark_share > 0) {
    board.mark_size_m = words.mark_size_m > 0 && !kind->alone ? words.mark_size_m : kind->mark_share * words.spacing_m;
    board.dictionary = kind->dictionary;
  }
  const bool has_markers = board.type == TargetType::kCharuco || board.type == TargetType::kMarkerGrid;
  if (has_markers) {
    board.first_id = words.first_id;
    board.legacy = words.legacy && board.type == TargetType::kCharuco;
    if (words.dictionary != "auto") {
      const auto dictionary = find_marker_dictionary(words.dictionary);
      if (!dictionary || !family_fits(*kind, *dictionary)) {
        return failure(Fault::kConfigBadValue, "dictionary '{:.30}' has no markers of type {}", words.dictionary,
                       words.type);
      }
      board.dictionary = *dictionary;
    }
  }
  if (const Status fine = check_board(board); !fine) return std::unexpected(fine.error());
  return board;
}

TargetWords words_of(const BoardSpec& board) {
  const Kind& kind = kind_of(board);
  TargetWords words{std::string(kind.name), board.inner_columns, board.inner_rows, board.square_size_m};
  if (kind.mark_share > 0) words.mark_size_m = board.mark_size_m;
  if (board.type == TargetType::kCharuco || board.type == TargetType::kMarkerGrid) {
    words.dictionary = marker_family(board.dictionary).name;
    words.first_id = board.first_id;
    words.legacy = board.legacy;
  }
  return words;
}

std::string describe(const BoardSpec& board) {
  const TargetWords words = words_of(board);
  const double spacing_mm = board.square_size_m * 1e3, mark_mm = board.mark_size_m * 1e3;
  switch (board.type) {
    case TargetType::kCheckerboard:
      return fmt::format("checkerboard, {}x{} inner corners, squares of {:.4g} mm", words.columns, words.rows,
                         spacing_mm);
    case TargetType::kCircles:
    case TargetType::kAsymmetricCircles:
      return fmt::format("{}, {}x{} circles of {:.4g} mm, spacing {:.4g} mm", words.type, words.columns, words.rows,
                         mark_mm, spacing_mm);
    case TargetType::kPatternMarker:
      return fmt::format("artoolkit-like pattern marker of {:.4g} mm", mark_mm);
    case TargetType::kCharuco:
      return fmt::format("charuco{}, {}x{} inner corners, squares of {:.4g} mm, markers {} of {:.4g} mm from {}",
                         board.legacy ? " (legacy)" : "", words.columns, words.rows, spacing_mm, words.dictionary,
                         mark_mm, words.first_id);
    default:
      if (board.corners() == 4) {
        return fmt::format("marker {} of {}, {:.4g} mm", words.first_id, words.dictionary, mark_mm);
      }
      return fmt::format("{}, {}x{} markers {} of {:.4g} mm, {:.4g} mm apart, from {}", words.type, words.columns,
                         words.rows, words.dictionary, mark_mm, spacing_mm, words.first_id);
  }
}

}  // namespace firstlook
