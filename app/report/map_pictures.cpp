#include "app/report/map_pictures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "algorithms/mapping/map_image.hpp"

namespace firstlook {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kFromBehind_rad = -2.2, kFromFront_rad = 0.9;
constexpr double kElevation_rad = 0.6;
constexpr int kMapWidth = 960, kMapHeight = 800, kPlanWidth = 1000, kLayerWidth = 420;
constexpr double kMapBorder_px = 56;  // room for the scales beside the floor
constexpr double kAround_m = 0.35;    // what a part's picture shows around it
constexpr double kHeading_m = 0.10;   // length of the line that says where a camera looked
constexpr double kAxis_m = 0.25;      // length of the base's axes
constexpr double kNumberHeight_px = 13;

struct Corners {
  Vector3d low_m, high_m;
};

Corners corners_of(const GridGeometry& g) {
  return {g.first.cast<double>() * g.resolution_m, (g.first + g.size).cast<double>() * g.resolution_m};
}

MapPicture blank(std::string caption, std::string group, int width, int height) {
  MapPicture p;
  p.picture.caption = std::move(caption);
  p.picture.width = width;
  p.picture.height = height;
  p.picture.pixels.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 3);
  p.group = std::move(group);
  return p;
}

RgbImage image_of(MapPicture& p) { return {p.picture.pixels.data(), p.picture.width, p.picture.height}; }

/// The multiples of `step` between two numbers.
std::vector<double> multiples(double low, double high, double step) {
  std::vector<double> values;
  for (double i = std::ceil(low / step - 1e-9); i * step <= high + 1e-9; ++i) values.push_back(i * step);
  return values;
}

/// "-0.5": the same number of places everywhere, and no "-0.0".
std::string metres(double value) { return fmt::format("{:.1f}", std::abs(value) < 1e-9 ? 0.0 : value); }

/// Numbers along the two edges of the floor that are nearest to the eye, which stand free of what is drawn above.
void mark_floor(MapPicture& p, const MapProjection& projection, const Corners& grid) {
  const Vector3d toward = -projection.into();
  const Vector2d middle = projection.pixel(
      {(grid.low_m.x() + grid.high_m.x()) / 2, (grid.low_m.y() + grid.high_m.y()) / 2, grid.low_m.z()});
  for (int axis = 0; axis < 2; ++axis) {
    const int other = 1 - axis;
    Vector3d at = grid.low_m;
    at[other] = toward[other] > 0 ? grid.high_m[other] : grid.low_m[other];
    at[axis] = (grid.low_m[axis] + grid.high_m[axis]) / 2;
    const Vector2d outwards = (projection.pixel(at) - middle).normalized();
    for (const double value : multiples(grid.low_m[axis], grid.high_m[axis], kFloorLines_m)) {
      at[axis] = value;
      p.labels.push_back({"tick", metres(value), projection.pixel(at) + 24 * outwards});
    }
    at[axis] = (grid.low_m[axis] + grid.high_m[axis]) / 2 + 0.25 * kFloorLines_m * 2;
    p.labels.push_back({"axis", axis == 0 ? "x, m" : "y, m", projection.pixel(at) + 48 * outwards});
  }
}

/// The arm's base with its axes, and the board.
void mark_places(MapPicture& p, const MapProjection& projection, const MapPictureInputs& in) {
  constexpr std::array<std::string_view, 3> kStyles = {"axis-x", "axis-y", "axis-z"}, kNames = {"x", "y", "z"};
  const Vector2d base = projection.pixel(Vector3d::Zero());
  for (int axis = 0; axis < 3; ++axis) {
    const Vector2d end = projection.pixel(kAxis_m * Vector3d::Unit(axis));
    if ((end - base).norm() < 5) continue;  // seen along the axis
    const auto a = static_cast<std::size_t>(axis);
    p.lines.push_back({std::string(kStyles[a]), {base, end}});
    p.labels.push_back({"axis", std::string(kNames[a]), end + 0.7 * p.text_px * (end - base).normalized()});
  }
  p.labels.push_back({"place", "arm base", base + Vector2d(0, 1.1 * p.text_px)});
  for (const auto& board : in.boards_m) {
    MapPicture::Line outline{"board", {}};
    Vector2d middle = Vector2d::Zero();
    double lowest = 0;
    for (const Vector3d& corner : board) {
      outline.points_px.push_back(projection.pixel(corner));
      middle += outline.points_px.back() / 4;
      lowest = std::max(lowest, outline.points_px.back().y());
    }
    outline.points_px.push_back(outline.points_px.front());
    p.lines.push_back(std::move(outline));
    p.labels.push_back({"place", "board", {middle.x(), lowest + 0.9 * p.text_px}});
  }
}

std::string style_of(const CameraPlace& place) { return place.phase == "sweep" ? "sweep" : "explore"; }

void mark_views(MapPicture& p, const MapProjection& projection, std::span<const CameraPlace> places) {
  if (places.empty()) return;
  MapPicture::Line path{"path", {}};
  for (const CameraPlace& place : places) path.points_px.push_back(projection.pixel(place.position_m));
  p.lines.push_back(std::move(path));
  int number = 0;
  for (const CameraPlace& place : places) {
    p.views.push_back({style_of(place), projection.pixel(place.position_m), std::nullopt, ++number});
  }
}

/// Puts each number where it covers the fewest dots and numbers that stand already.
void place_numbers(MapPicture& p) {
  std::vector<Vector2d> taken;
  for (MapPicture::View& view : p.views) {
    const double half_width = 0.32 * kNumberHeight_px * (view.number < 10 ? 1 : view.number < 100 ? 2 : 3);
    double best = 1e9;
    Vector2d chosen = view.at_px;
    for (const double away : {1.0, 1.6, 2.4}) {
      for (int i = 0; i < 12; ++i) {
        const double angle = i * std::numbers::pi / 6;
        const Vector2d at = view.at_px + away * Vector2d((6 + half_width) * std::cos(angle),
                                                         (6 + 0.5 * kNumberHeight_px) * std::sin(angle));
        const auto overlap = [&](const Vector2d& other, double width, double height) {
          const Vector2d d = (at - other).cwiseAbs();
          return std::max(0.0, 1 - d.x() / width) * std::max(0.0, 1 - d.y() / height);
        };
        double cost = 0.1 * away;
        for (const MapPicture::View& other : p.views) cost += overlap(other.at_px, half_width + 5, 11);
        for (const Vector2d& other : taken) cost += 2 * overlap(other, 2 * half_width + 4, kNumberHeight_px);
        if (cost < best - 1e-12) best = cost, chosen = at;
      }
    }
    view.number_px = chosen;
    taken.push_back(chosen);
  }
}

MapPicture whole_map(const MapPictureInputs& in, double azimuth_rad, std::string caption, std::string group) {
  MapPicture p = blank(std::move(caption), std::move(group), kMapWidth, kMapHeight);
  const Corners grid = corners_of(in.map.geometry());
  const auto viewpoint =
      Viewpoint::seeing(grid.low_m, grid.high_m, azimuth_rad, kElevation_rad, kMapWidth, kMapHeight, kMapBorder_px);
  draw_map(in.map, viewpoint, {}, image_of(p));
  const MapProjection projection(viewpoint, kMapWidth, kMapHeight);
  mark_floor(p, projection, grid);
  mark_views(p, projection, in.places);
  mark_places(p, projection, in);
  p.heights_m = {grid.low_m.z(), grid.high_m.z()};
  return p;
}

MapPicture unknown_space(const VoxelMap& map, const MapPictureInputs& in, std::string caption) {
  MapPicture p = blank(std::move(caption), "Unknown in the reach of the arm (violet)", kMapWidth, kMapHeight);
  const Corners grid = corners_of(map.geometry());
  const auto viewpoint =
      Viewpoint::seeing(grid.low_m, grid.high_m, kFromBehind_rad, kElevation_rad, kMapWidth, kMapHeight, kMapBorder_px);
  draw_map(map, viewpoint, in.zone, image_of(p));
  const MapProjection projection(viewpoint, kMapWidth, kMapHeight);
  mark_floor(p, projection, grid);
  mark_places(p, projection, in);
  p.heights_m = {grid.low_m.z(), grid.high_m.z()};
  return p;
}

/// All views with their numbers, from above.
MapPicture views_in_order(const MapPictureInputs& in) {
  Vector3d low = Vector3d::Zero(), high = Vector3d::Zero();  // the arm's base is in the picture, too
  for (const CameraPlace& place : in.places) {
    low = low.cwiseMin(place.position_m);
    high = high.cwiseMax(place.position_m);
  }
  for (const auto& board : in.boards_m) {
    for (const Vector3d& corner : board) low = low.cwiseMin(corner), high = high.cwiseMax(corner);
  }
  const Vector3d margin(0.15, 0.15, 0);
  low -= margin;
  high += margin;
  const double wanted = kPlanWidth * (high.y() - low.y()) / (high.x() - low.x());
  const int height = std::clamp(static_cast<int>(std::lround(wanted)), kPlanWidth / 2, kPlanWidth * 3 / 4);
  MapPicture p =
      blank("The views in order, seen from above, on the map at the end. The short line says where the camera looked.",
            "The views in order", kPlanWidth, height);
  p.layout = MapPicture::Layout::kWide;
  p.text_px = 13;
  const auto viewpoint =
      Viewpoint::seeing(low, high, -std::numbers::pi / 2, std::numbers::pi / 2, kPlanWidth, height, 24);
  draw_map(in.map, viewpoint, {}, image_of(p));
  for (std::uint8_t& v : p.picture.pixels) v = static_cast<std::uint8_t>(255 - (255 - v) * 3 / 10);  // ground for marks
  const MapProjection projection(viewpoint, kPlanWidth, height);
  for (const CameraPlace& place : in.places) {
    p.lines.push_back(
        {"heading-" + style_of(place),
         {projection.pixel(place.position_m), projection.pixel(place.position_m + kHeading_m * place.ahead)}});
  }
  mark_views(p, projection, in.places);
  place_numbers(p);
  mark_places(p, projection, in);
  const Vector3d corner = projection.through(0, height - 1), opposite = projection.through(kPlanWidth - 1, 0);
  for (const double x : multiples(corner.x() + 0.1, opposite.x(), kFloorLines_m)) {
    p.labels.push_back({"tick", metres(x), {projection.pixel({x, 0, 0}).x(), height - 9.0}});
  }
  for (const double y : multiples(corner.y() + 0.1, opposite.y(), kFloorLines_m)) {
    p.labels.push_back({"tick", metres(y), {16.0, projection.pixel({0, y, 0}).y()}});
  }
  return p;
}

MapPicture layer(const VoxelMap& map, const MapPictureInputs& in, double z_m, const SliceWindow& window,
                 std::string caption, std::string group) {
  const Vector2d size_m = window.high_m - window.low_m;
  const int height = std::max(40, static_cast<int>(std::lround(kLayerWidth * size_m.y() / size_m.x())));
  MapPicture p = blank(std::move(caption), std::move(group), kLayerWidth, height);
  p.layout = MapPicture::Layout::kHalf;
  draw_slice(map, z_m, window, in.zone, image_of(p));
  const auto pixel = [&](const Vector2d& point) { return window.pixel(point, kLayerWidth, height); };
  const double step = size_m.maxCoeff() > 1.6 ? 0.5 : 0.2;
  for (const double x : multiples(window.low_m.x() + 0.6 * step, window.high_m.x() - 0.3 * step, step)) {
    const double at = pixel({x, 0}).x();
    p.lines.push_back({"mark", {{at, height - 0.5}, {at, height - 6.5}}});
    p.labels.push_back({"tick", metres(x), {at, height - 17.0}});
  }
  for (const double y : multiples(window.low_m.y() + 0.6 * step, window.high_m.y() - 0.3 * step, step)) {
    const double at = pixel({0, y}).y();
    p.lines.push_back({"mark", {{-0.5, at}, {5.5, at}}});
    p.labels.push_back({"tick", metres(y), {24.0, at}});
  }
  const auto inside = [&](const Vector2d& q) {
    return (q.array() > window.low_m.array()).all() && (q.array() < window.high_m.array()).all();
  };
  if (inside(Vector2d::Zero())) {
    const Vector2d base = pixel(Vector2d::Zero());
    p.lines.push_back({"axis-x", {base, pixel({kAxis_m, 0})}});
    p.lines.push_back({"axis-y", {base, pixel({0, kAxis_m})}});
    p.labels.push_back({"place", "arm base", base + Vector2d(0, 1.0 * p.text_px)});
  }
  for (const auto& corners : in.boards_m) {
    if (!inside(corners.front().head<2>())) continue;
    MapPicture::Line board{"board", {}};
    for (const Vector3d& corner : corners) board.points_px.push_back(pixel(corner.head<2>()));
    board.points_px.push_back(board.points_px.front());
    p.labels.push_back({"place", "board", board.points_px.front() + Vector2d(0, -0.9 * p.text_px)});
    p.lines.push_back(std::move(board));
  }
  return p;
}

}  // namespace

std::vector<MapPicture> map_pictures(const MapPictureInputs& in) {
  std::vector<MapPicture> pictures;
  const std::string whole = "The map at the end and the camera's way";
  pictures.push_back(whole_map(in, kFromBehind_rad, "seen from behind: from negative x and y", whole));
  pictures.push_back(whole_map(in, kFromFront_rad, "seen from the front: from positive x and y", whole));
  if (!in.places.empty()) pictures.push_back(views_in_order(in));
  if (in.swept != nullptr) pictures.push_back(unknown_space(*in.swept, in, "before exploration"));
  pictures.push_back(unknown_space(in.map, in, "at the end"));
  const GridGeometry& g = in.map.geometry();
  const Corners grid = corners_of(g);
  for (const double z_m : {0.0, 0.25, 0.5}) {
    if (z_m < grid.low_m.z() || z_m >= grid.high_m.z()) continue;
    const std::string group = fmt::format("Layer at {:.2f} m", z_m);
    const SliceWindow window = SliceWindow::of(g);
    if (in.swept != nullptr) pictures.push_back(layer(*in.swept, in, z_m, window, "before exploration", group));
    pictures.push_back(layer(in.map, in, z_m, window, "at the end", group));
  }
  return pictures;
}

std::vector<MapPicture> part_pictures(const MapPictureInputs& in, const NamedPart& part, const std::string& after_sweep,
                                      const std::string& at_end) {
  const Corners grid = corners_of(in.map.geometry());
  const Vector3d middle = (part.low_m + part.high_m) / 2;
  if (in.swept == nullptr || (middle.array() < grid.low_m.array()).any() ||
      (middle.array() >= grid.high_m.array()).any()) {
    return {};
  }
  // Square, so that the pictures of several parts stand in rows.
  const double half = (part.high_m - part.low_m).head<2>().maxCoeff() / 2 + kAround_m;
  const SliceWindow window{middle.head<2>() - Vector2d::Constant(half), middle.head<2>() + Vector2d::Constant(half)};
  const std::string group = fmt::format("{}, layer at {:.2f} m", part.name, middle.z());
  std::vector<MapPicture> pictures;
  pictures.push_back(layer(*in.swept, in, middle.z(), window, "before exploration" + after_sweep, group));
  pictures.push_back(layer(in.map, in, middle.z(), window, "at the end" + at_end, group));
  for (MapPicture& p : pictures) {
    MapPicture::Line outline{"part", {}};
    for (const auto& [x, y] : {std::pair{part.low_m.x(), part.low_m.y()},
                               {part.high_m.x(), part.low_m.y()},
                               {part.high_m.x(), part.high_m.y()},
                               {part.low_m.x(), part.high_m.y()},
                               {part.low_m.x(), part.low_m.y()}}) {
      outline.points_px.push_back(window.pixel({x, y}, p.picture.width, p.picture.height));
    }
    p.lines.push_back(std::move(outline));
  }
  return pictures;
}

}  // namespace firstlook
