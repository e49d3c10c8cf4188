#include "app/cli/map_command.hpp"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <optional>

#include "algorithms/mapping/map_change.hpp"
#include "algorithms/mapping/objects.hpp"
#include "app/cli/exit_codes.hpp"
#include "app/dataset/dataset_mapping.hpp"
#include "app/dataset/map_file.hpp"
#include "app/report/color_picture.hpp"
#include "app/report/map_files.hpp"
#include "app/report/map_json.hpp"
#include "app/report/object_picture.hpp"
#include "app/report/picture_bytes.hpp"
#include "platform/linux/files.hpp"

namespace firstlook {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kResolutionMin_m = 0.002, kResolutionMax_m = 1.0;
constexpr double kRangeLimit_m = 50;
constexpr double kPlaceMax_m = 1e6;
constexpr double kPictureAzimuth_rad = -2.2;
constexpr std::size_t kRefusedNarrated = 10;

/// What the options ask about the map.
struct Questions {
  PlaneChoice planes;
  std::optional<Eigen::Vector3d> place_m;
  std::vector<ObjectMove> moves;
};

/// A map, where it comes from, and the answers.
struct Answers {
  VoxelMap map;
  MapPlanes planes;
  std::vector<SensorRecording> recordings;  ///< none: a stored map
  std::vector<FrameOutcome> frames;
  std::size_t frames_refused = 0;
  std::optional<PlaceSeen> seen;
  std::optional<MapObjects> objects;
  std::optional<PlaceKnown> place;
  std::optional<MapChange> change;
};

/// As many finite numbers with commas between them as there is room for, and nothing else.
bool read_numbers(std::string_view text, std::span<double> numbers) {
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    const bool last = i + 1 == numbers.size();
    const std::size_t end = last ? text.size() : text.find(',');
    if (end == std::string_view::npos) return false;
    const std::string_view word = text.substr(0, end);
    const auto [stop, error] = std::from_chars(word.data(), word.data() + word.size(), numbers[i]);
    if (error != std::errc{} || stop != word.data() + word.size() || !std::isfinite(numbers[i])) return false;
    text.remove_prefix(std::min(text.size(), end + 1));
  }
  return true;
}

Result<Questions> read_questions(const MapCommandOptions& options) {
  Questions questions;
  const std::optional<PlaneChoice> planes = planes_from_words(options.planes);
  if (!planes)
    return failure(Fault::kUsage, "--planes {}: none, or color, label, sensor with commas between them",
                   options.planes);
  questions.planes = *planes;
  if (!options.at.empty()) {
    std::array<double, 3> p{};
    if (!read_numbers(options.at, p) || Eigen::Vector3d(p.data()).cwiseAbs().maxCoeff() > kPlaceMax_m)
      return failure(Fault::kUsage, "--at {}: three numbers X,Y,Z in metres", options.at);
    questions.place_m = Eigen::Vector3d(p.data());
  }
  for (const std::string& move : options.moves) {
    std::array<double, 4> n{};
    if (!read_numbers(move, n) || n[0] != std::floor(n[0]) || std::abs(n[0]) > 1e9)
      return failure(Fault::kUsage, "--move {}: an object's number and metres, ID,dx,dy,dz", move);
    questions.moves.push_back({static_cast<int>(n[0]), {n[1], n[2], n[3]}});
  }
  return questions;
}

Status check_options(const MapCommandOptions& options) {
  if (options.datasets.empty() == options.from.empty())
    return failure(Fault::kUsage, "either --dataset DIR or --from FILE");
  if (options.datasets.size() > kSensorsMax)
    return failure(Fault::kUsage, "--dataset {} times: at most {} sensors", options.datasets.size(), kSensorsMax);
  if (!options.from.empty() && options.planes != "none")
    return failure(Fault::kUsage, "--planes {}: a stored map has those of the map.ply beside it", options.planes);
  if (!(options.resolution_m >= kResolutionMin_m && options.resolution_m <= kResolutionMax_m))
    return failure(Fault::kUsage, "--resolution {}: must be {} to {} m", options.resolution_m, kResolutionMin_m,
                   kResolutionMax_m);
  if (!(options.range_max_m > 0 && options.range_max_m <= kRangeLimit_m))
    return failure(Fault::kUsage, "--max-range {}: must be above 0 and at most {} m", options.range_max_m,
                   kRangeLimit_m);
  if (options.depth < 1 || options.depth > 16)
    return failure(Fault::kUsage, "--depth {}: must be 1 to 16", options.depth);
  return {};
}

void narrate(const FrameOutcome& frame) {
  if (!frame.refused.empty()) return fmt::print(stderr, "refused: {}\n", frame.refused);
  fmt::print(stderr, "{}: {} pixels used, {} voxels discovered; {} free, {} occupied\n", frame.image,
             frame.inserted.pixels_used, frame.inserted.change.voxels_discovered, frame.voxels.free,
             frame.voxels.occupied);
  if (!frame.color_refused.empty()) fmt::print(stderr, "without colours: {}\n", frame.color_refused);
}

void narrate(std::string_view what, const std::vector<RefusedLine>& refused) {
  for (std::size_t i = 0; i < std::min(kRefusedNarrated, refused.size()); ++i)
    fmt::print(stderr, "refused: {}\n", refused[i].reason);
  if (refused.size() > kRefusedNarrated)
    fmt::print(stderr, "refused: {} more {}\n", refused.size() - kRefusedNarrated, what);
}

Result<SensorRecording> read_recording(const std::filesystem::path& folder, const MapCommandOptions& options,
                                       const Questions& questions) {
  Result<MappingDataset> depth =
      read_mapping_dataset(folder, options.sort ? FrameOrder::kByStamp : FrameOrder::kAsRecorded);
  if (!depth) return std::unexpected(depth.error());
  narrate("poses", depth->refused_poses);
  narrate("frames", depth->refused);
  if (depth->poses_were_sorted) fmt::print(stderr, "groundtruth.txt is not in the order of time: sorted\n");
  SensorRecording recording{std::move(*depth), std::nullopt};
  if (!questions.planes.color) return recording;
  Result<ColorDataset> color = read_color_dataset(folder, recording.depth);
  if (!color) return std::unexpected(color.error());
  narrate("pictures", color->refused);
  recording.color = std::move(*color);
  return recording;
}

Result<Answers> from_datasets(const MapCommandOptions& options, const Questions& questions) {
  std::vector<SensorRecording> recordings;
  for (const std::filesystem::path& folder : options.datasets) {
    if (options.datasets.size() > 1) fmt::print(stderr, "sensor {}: {}\n", recordings.size() + 1, folder.string());
    Result<SensorRecording> recording = read_recording(folder, options, questions);
    if (!recording) return std::unexpected(recording.error());
    recordings.push_back(std::move(*recording));
  }
  const auto report = [](const FrameOutcome& frame) { narrate(frame); };
  Result<DatasetMap> mapped =
      map_dataset(recordings, {options.resolution_m, options.range_max_m, questions.place_m, questions.planes}, report);
  if (!mapped) return std::unexpected(mapped.error());
  const std::size_t refused = mapped->refused();
  Answers answers{std::move(mapped->map),
                  std::move(mapped->planes),
                  std::move(recordings),
                  std::move(mapped->frames),
                  refused,
                  {},
                  {},
                  {},
                  {}};
  if (questions.place_m) answers.seen = mapped->place;
  return answers;
}

Result<Answers> from_file(const MapCommandOptions& options) {
  Result<VoxelMap> map = read_map_file(options.from, kOfflineVoxelsMax);
  if (!map) return std::unexpected(map.error());
  Result<MapPlanes> planes = read_planes_beside(options.from, map->geometry());
  if (!planes) fmt::print(stderr, "planes left out: {}\n", planes.error().detail());
  return Answers{std::move(*map), planes ? std::move(*planes) : MapPlanes{}, {}, {}, 0, {}, {}, {}, {}};
}

Status answer(const MapCommandOptions& options, const Questions& questions, Answers& answers) {
  if (options.objects || questions.place_m || !questions.moves.empty() || answers.planes.choice().any())
    answers.objects = find_objects(answers.map, collision_class);
  if (!questions.moves.empty()) {
    Result<VoxelMap> moved = move_objects(answers.map, *answers.objects, questions.moves, kOfflineVoxelsMax);
    if (!moved) return std::unexpected(moved.error());
    answers.map = std::move(*moved);
    answers.objects = find_objects(answers.map, collision_class);
    if (answers.planes.choice().any()) fmt::print(stderr, "the planes do not move with the objects: left out\n");
    answers.planes = {};
  }
  if (answers.planes.label) answers.planes.label->write(*answers.objects);
  if (questions.place_m) {
    answers.place = look_up(answers.map, *questions.place_m, &*answers.objects, answers.planes);
    answers.place->seen = answers.seen;
  }
  if (!options.prior.empty()) {
    const Result<MapInGrid> prior = read_map_file_into(options.prior, answers.map.geometry());
    if (!prior) return std::unexpected(prior.error());
    if (prior->voxels_outside > 0)
      fmt::print(stderr, "{}: {} known voxels lie outside this map\n", options.prior.string(), prior->voxels_outside);
    answers.change = compare_maps(prior->map, answers.map);
  }
  return {};
}

Status write_files(const MapCommandOptions& options, const Answers& answers) {
  const std::string folder = options.out.string();
  Status status = write_map_files(folder, answers.map, options.depth, answers.planes);
  if (status && answers.planes.color) {
    const MapPicture picture =
        color_picture(answers.map, *answers.planes.color, *answers.objects, kPictureAzimuth_rad, "colours");
    status = write_file_atomically(folder + "/color.png", encode_png(picture.picture));
  }
  if (status && !answers.recordings.empty())
    status = write_file_atomically(folder + "/frames.csv", frames_csv(answers.frames));
  if (!status || !options.objects) return status;
  const MapPicture picture = object_picture(answers.map, *answers.objects, kPictureAzimuth_rad, "objects");
  return write_file_atomically(folder + "/objects.png", encode_png(picture.picture));
}

Json frames_refused_json(const std::vector<FrameOutcome>& frames) {
  Json refused = Json::array();
  for (const FrameOutcome& frame : frames) {
    if (frame.refused.empty()) continue;
    const Json stamp = std::isfinite(frame.stamp_s) ? Json(frame.stamp_s) : Json(nullptr);
    refused.push_back({{"line", frame.line}, {"stamp_s", stamp}, {"image", frame.image}, {"reason", frame.refused}});
  }
  return refused;
}

void add_lines(const std::vector<RefusedLine>& lines, Json& refused) {
  for (const RefusedLine& line : lines) refused.push_back({{"line", line.line}, {"reason", line.reason}});
}

Json color_json(const FrameOutcome& frame) {
  const Json refused = frame.color_refused.empty() ? Json(nullptr) : Json(frame.color_refused);
  return {{"pixels", frame.pixels_colored}, {"refused", refused}};
}

/// What the recordings say of themselves.
void add_frames(const Answers& answers, Json& result) {
  Json& frames = result["frames"] = Json::array();
  for (const FrameOutcome& frame : answers.frames) {
    if (!frame.refused.empty()) continue;
    Json& json = frames.emplace_back(frame_json(frame));
    if (answers.recordings.size() > 1) json["sensor"] = frame.sensor;
    if (answers.planes.color) json["color"] = color_json(frame);
  }
  std::size_t without_pose = 0;
  Json poses_refused = Json::array(), pictures_refused = Json::array();
  for (const SensorRecording& recording : answers.recordings) {
    without_pose += recording.depth.frames_without_pose;
    add_lines(recording.depth.refused_poses, poses_refused);
    if (recording.color) add_lines(recording.color->refused, pictures_refused);
  }
  result["frames_without_pose"] = without_pose;
  result["frames_refused"] = answers.frames_refused;
  result["refused"] = frames_refused_json(answers.frames);
  result["poses_refused"] = poses_refused;
  if (answers.planes.color) result["pictures_refused"] = pictures_refused;
  result["association_s"] = kPoseAssociation_s;
  result["interpolation_max_s"] = kPoseInterpolation_s;
}

Json result_json(const MapCommandOptions& options, const Answers& answers) {
  Json result = {{"resolution_m", answers.map.geometry().resolution_m}};
  if (!answers.recordings.empty()) result["range_max_m"] = options.range_max_m;
  result["extents_m"] = extents_json(answers.map.geometry());
  if (!answers.recordings.empty()) add_frames(answers, result);
  result["voxels"] = counts_json(answers.map.counts());
  if (answers.planes.choice().any()) result["planes"] = planes_json(count_planes(answers.map, answers.planes));
  if (options.objects) {
    result["objects"] = objects_json(*answers.objects);
    result["specks"] = answers.objects->specks;
  }
  if (answers.place) result["place"] = place_json(*answers.place);
  if (answers.change) result["prior"] = change_json(*answers.change);
  return result;
}

void print_text(const MapCommandOptions& options, const Answers& answers) {
  const VoxelCounts counts = answers.map.counts();
  if (!answers.recordings.empty())
    fmt::print("{} frames, {} refused, at ", answers.frames.size() - answers.frames_refused, answers.frames_refused);
  fmt::print("{} m: {} voxels free, {} occupied, {} unknown\n", answers.map.geometry().resolution_m, counts.free,
             counts.occupied, counts.unknown);
  if (answers.planes.choice().any()) fmt::print("{}", planes_text(count_planes(answers.map, answers.planes)));
  if (options.objects) fmt::print("{}", objects_text(*answers.objects));
  if (answers.place) fmt::print("{}", place_text(*answers.place));
  if (answers.change) {
    const MapChange& c = *answers.change;
    fmt::print("against the earlier map: {} newly occupied, {} gone, {} still occupied, {} of its occupied not seen\n",
               c.newly_occupied, c.gone, c.still_occupied, c.unseen_occupied);
  }
}

int report(const Error& error) {
  fmt::print(stderr, "{}\n", describe(error));
  return error.fault == Fault::kUsage ? kExitUsage : kExitData;
}

}  // namespace

int run_map_command(const MapCommandOptions& options) {
  if (const Status status = check_options(options); !status) return report(status.error());
  const Result<Questions> questions = read_questions(options);
  if (!questions) return report(questions.error());
  Result<Answers> answers = options.from.empty() ? from_datasets(options, *questions) : from_file(options);
  if (!answers) return report(answers.error());
  if (const Status status = answer(options, *questions, *answers); !status) return report(status.error());
  if (!options.out.empty())
    if (const Status status = write_files(options, *answers); !status) return report(status.error());
  if (options.json)
    fmt::print("{}\n", result_json(options, *answers).dump(2));
  else
    print_text(options, *answers);
  return kExitDone;
}

}  // namespace firstlook
