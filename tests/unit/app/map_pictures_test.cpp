/// Pictures of the map: what is drawn, and that every mark lies where it belongs.
#include "app/report/map_pictures.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <numbers>
#include <set>

#include "app/report/map_figures.hpp"

namespace firstlook {
namespace {

struct Scene {
  VoxelMap map{GridGeometry::covering({-1.5, -1.5, -0.3}, {1.5, 1.5, 1.5}, 0.05)};
  VoxelMap swept{map.geometry()};
  std::vector<std::uint8_t> zone = std::vector<std::uint8_t>(map.size(), 1);
  std::vector<CameraPlace> places;
  std::array<Eigen::Vector3d, 4> board = {{{0.4, 0.9, 0.4}, {0.7, 0.9, 0.4}, {0.7, 0.9, 0.6}, {0.4, 0.9, 0.6}}};

  Scene() {
    for (std::size_t i = 0; i < map.size(); ++i) map.set(i, VoxelClass::kFree, 0);
    for (int i = 0; i < 57; ++i) {
      const double turn = i * 2 * std::numbers::pi / 23;
      places.push_back({i < 18 ? "sweep" : "explore",
                        {0.45 * std::cos(turn), 0.45 * std::sin(turn), 0.5 + 0.005 * i},
                        {std::cos(turn), std::sin(turn), 0}});
    }
  }
  [[nodiscard]] MapPictureInputs inputs() const { return {map, &swept, zone, places, {board}}; }
};

bool inside(const MapPicture& p, const Eigen::Vector2d& at) {
  return at.x() >= -0.5 && at.y() >= -0.5 && at.x() <= p.picture.width - 0.5 && at.y() <= p.picture.height - 0.5;
}

}  // namespace

TEST_CASE("every mark of every picture of the map lies inside it", "[report]") {
  const Scene scene;
  const auto pictures = map_pictures(scene.inputs());
  CHECK(pictures.size() == 11);  // two sides, views in order, unknown twice, three layers twice
  for (const MapPicture& p : pictures) {
    INFO(p.group << ", " << p.picture.caption);
    CHECK(p.picture.pixels.size() ==
          3 * static_cast<std::size_t>(p.picture.width) * static_cast<std::size_t>(p.picture.height));
    CHECK(p.labels.size() >= 8);
    for (const MapPicture::Line& line : p.lines) {
      for (const Eigen::Vector2d& at : line.points_px) CHECK(inside(p, at));
    }
    for (const MapPicture::Label& label : p.labels) CHECK(inside(p, label.at_px));
    for (const MapPicture::View& view : p.views) CHECK(inside(p, view.at_px));
    const bool names_both = std::ranges::count(p.labels, std::string("arm base"), &MapPicture::Label::text) == 1 &&
                            std::ranges::count(p.labels, std::string("board"), &MapPicture::Label::text) == 1;
    CHECK(names_both);
  }
}

TEST_CASE("the views are numbered in order, and numbers keep apart", "[report]") {
  const Scene scene;
  const auto pictures = map_pictures(scene.inputs());
  const auto numbered = std::ranges::find(pictures, std::string("The views in order"), &MapPicture::group);
  REQUIRE(numbered != pictures.end());
  REQUIRE(numbered->views.size() == scene.places.size());
  int covered = 0;
  for (std::size_t i = 0; i < numbered->views.size(); ++i) {
    const MapPicture::View& view = numbered->views[i];
    CHECK(view.number == static_cast<int>(i) + 1);
    CHECK(view.style == (i < 18 ? "sweep" : "explore"));
    REQUIRE(view.number_px);
    CHECK((*view.number_px - view.at_px).norm() < 60);
    for (std::size_t j = 0; j < i; ++j) {
      const Eigen::Vector2d d = (*view.number_px - *numbered->views[j].number_px).cwiseAbs();
      covered += d.x() < 10 && d.y() < 8 ? 1 : 0;
    }
  }
  CHECK(covered == 0);
  const std::string page = map_figures(pictures);
  CHECK(page.find(">57</text>") != std::string::npos);
}

TEST_CASE("a sweep that did not end has no pictures", "[report]") {
  const Scene scene;
  MapPictureInputs inputs = scene.inputs();
  inputs.swept = nullptr;
  for (const MapPicture& p : map_pictures(inputs)) CHECK(p.picture.caption != "before exploration");
  CHECK(part_pictures(inputs, {"Behind it", {0.1, 0.1, 0.1}, {0.2, 0.2, 0.2}}, "", "").empty());
}

TEST_CASE("a part is shown before exploration and at the end, with its outline", "[report]") {
  Scene scene;
  const NamedPart part{"Behind it", {0.6, -0.4, 0.0}, {0.9, 0.2, 0.3}};
  const auto pictures = part_pictures(scene.inputs(), part, ": little", ": all");
  REQUIRE(pictures.size() == 2);
  CHECK(pictures[0].picture.caption == "before exploration: little");
  CHECK(pictures[1].picture.caption == "at the end: all");
  CHECK(pictures[0].group == "Behind it, layer at 0.15 m");
  CHECK(pictures[0].group == pictures[1].group);
  for (const MapPicture& p : pictures) {
    const auto outline = std::ranges::find(p.lines, std::string("part"), &MapPicture::Line::style);
    REQUIRE(outline != p.lines.end());
    CHECK(outline->points_px.size() == 5);
    for (const Eigen::Vector2d& at : outline->points_px) CHECK(inside(p, at));
  }
  CHECK(pictures[0].picture.pixels != pictures[1].picture.pixels);  // unknown, then free
  CHECK(part_pictures(scene.inputs(), {"elsewhere", {3, 3, 3}, {4, 4, 4}}, "", "").empty());
}

}  // namespace firstlook
