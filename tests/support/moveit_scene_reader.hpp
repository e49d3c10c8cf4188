/// MoveIt's reading of a `.scene` for tests: the steps of PlanningScene::loadGeometryFromStream (MoveIt 1 from Noetic
/// on, and MoveIt 2) and of geometric_shapes::constructShapeFromText, for boxes.
#pragma once

#include <Eigen/Geometry>
#include <istream>
#include <string>
#include <vector>

namespace firstlook::test {

struct SceneBox {
  Eigen::Vector3d size_m;
  Eigen::Isometry3d pose;  ///< in the scene's frame
};

struct SceneObject {
  std::string id;
  std::vector<SceneBox> boxes;
};

struct Scene {
  std::string name;
  std::vector<SceneObject> objects;
};

inline bool read_scene_pose(std::istream& in, Eigen::Isometry3d& pose) {
  double x = 0, y = 0, z = 0, rx = 0, ry = 0, rz = 0, rw = 0;
  if (!(in >> x >> y >> z) || !(in >> rx >> ry >> rz >> rw)) return false;
  pose = Eigen::Translation3d(x, y, z) * Eigen::Quaterniond(rw, rx, ry, rz);
  return true;
}

/// One object behind its "*". False where MoveIt would refuse.
inline bool read_scene_object(std::istream& in, bool new_format, SceneObject& object) {
  std::getline(in, object.id);
  object.id.erase(0, object.id.find_first_not_of(' '));
  Eigen::Isometry3d object_pose = Eigen::Isometry3d::Identity();
  if (new_format && !read_scene_pose(in, object_pose)) return false;
  unsigned shapes = 0, subframes = 0;
  in >> shapes;
  for (unsigned i = 0; i < shapes && in.good(); ++i) {
    std::string type;
    SceneBox box{};
    float r = 0, g = 0, b = 0, a = 0;
    if (!(in >> type) || type != "box") return false;
    if (!(in >> box.size_m.x() >> box.size_m.y() >> box.size_m.z()) || !read_scene_pose(in, box.pose)) return false;
    if (!(in >> r >> g >> b >> a)) return false;
    box.pose = object_pose * box.pose;
    object.boxes.push_back(box);
  }
  if (new_format) in >> subframes;
  return object.boxes.size() == shapes && subframes == 0 && in.good();
}

/// Whether MoveIt would take it.
inline bool read_scene(std::istream& in, Scene& scene) {
  std::getline(in, scene.name);
  const auto here = in.tellg();
  std::string line;
  do {
    std::getline(in, line);
  } while (in.good() && (line.empty() || line[0] != '*'));
  std::getline(in, line);  // the line behind the first object's name: a pose has spaces, a count has none
  const bool new_format = line.find(' ') != std::string::npos;
  in.seekg(here);
  for (std::string marker; in >> marker;) {
    if (marker == ".") return true;
    if (marker != "*" || !read_scene_object(in, new_format, scene.objects.emplace_back())) return false;
  }
  return false;
}

}  // namespace firstlook::test
