#include <console_bridge/console.h>
#include <urdf_parser/urdf_parser.h>

#include <algorithm>
#include <filesystem>
#include <numbers>

#include "algorithms/kinematics/capsule_fit.hpp"
#include "algorithms/kinematics/joint_chain.hpp"
#include "app/config/arm_file.hpp"
#include "app/config/arm_naming.hpp"
#include "app/config/mesh_points.hpp"

namespace firstlook {
namespace {

using Eigen::Vector3d;

constexpr int kCirclePoints = 48;  // of a cylinder's edge
constexpr int kDepthMax = 200;     // links in one line: more is no robot
constexpr double kMeshMax_m = 5;   // a larger mesh is in millimetres

/// Leaves the reader of this file; nothing else throws or catches it.
struct ArmFailure {
  Error error;
};

template <typename... Args>
[[noreturn]] void fail(fmt::format_string<Args...> text, Args&&... args) {
  throw ArmFailure{failure(Fault::kConfigBadValue, "{}", fmt::format(text, std::forward<Args>(args)...)).error()};
}

/// Keeps what the library would print.
class Complaints final : public console_bridge::OutputHandler {
 public:
  Complaints() { console_bridge::useOutputHandler(this); }
  ~Complaints() override { console_bridge::restorePreviousOutputHandler(); }
  Complaints(const Complaints&) = delete;
  Complaints& operator=(const Complaints&) = delete;
  void log(const std::string& text, console_bridge::LogLevel level, const char*, int) override {
    if (level >= console_bridge::CONSOLE_BRIDGE_LOG_ERROR && first_.empty()) first_ = text;
  }
  [[nodiscard]] const std::string& first() const { return first_; }

 private:
  std::string first_;
};

Pose pose_of(const urdf::Pose& p) {
  Pose pose = Pose::Identity();
  pose.linear() =
      Eigen::Quaterniond(p.rotation.w, p.rotation.x, p.rotation.y, p.rotation.z).normalized().toRotationMatrix();
  pose.translation() = Vector3d(p.position.x, p.position.y, p.position.z);
  return pose;
}

/// Whether all measures of a shape are positive. Those of a mesh are told by its points.
bool has_size(const urdf::Geometry& geometry) {
  if (geometry.type == urdf::Geometry::SPHERE) return static_cast<const urdf::Sphere&>(geometry).radius > 0;
  if (geometry.type == urdf::Geometry::CYLINDER) {
    const auto& c = static_cast<const urdf::Cylinder&>(geometry);
    return c.radius > 0 && c.length > 0;
  }
  if (geometry.type != urdf::Geometry::BOX) return true;
  const urdf::Vector3& dim = static_cast<const urdf::Box&>(geometry).dim;
  return dim.x > 0 && dim.y > 0 && dim.z > 0;
}

bool moves(const urdf::Joint& joint) { return joint.type != urdf::Joint::FIXED; }

class Reader {
 public:
  Reader(const urdf::ModelInterface& model, std::string file, std::string folder, const ArmFileOptions& options)
      : model_(model), file_(std::move(file)), folder_(std::move(folder)), options_(options) {}

  ArmFromFile read() {
    if (const Status named = check_arm_name(model_.getName(), file_); !named) throw ArmFailure{named.error()};
    const urdf::Link& base = base_link();
    const std::vector<const urdf::Link*> way = way_from(base, tip_link(base));
    add_body(base, Pose::Identity(), 0, way);
    Pose at = Pose::Identity();  // of the link in the frame of the last joint
    for (const urdf::Link* link : way) {
      const urdf::Joint& joint = *link->parent_joint;
      at = at * pose_of(joint.parent_to_joint_origin_transform);
      if (!moves(joint)) continue;
      if (chain_.joints.size() == kJointsMax) {
        fail("{:.80}: more than {} joints move between {} and {}; name fewer by arm.base_link and arm.tip_link", file_,
             kJointsMax, base.name, way.back()->name);
      }
      chain_.joints.push_back(joint_of(joint, at));
      names_.push_back("joint " + joint.name);
      at = Pose::Identity();
      add_body(*link, at, static_cast<int>(chain_.joints.size()), way);
    }
    if (chain_.joints.size() < 2) {
      fail("{:.80}: {} of the joints between {} and {} move; an arm has 2 to {}", file_, chain_.joints.size(),
           base.name, way.empty() ? base.name : way.back()->name, kJointsMax);
    }
    chain_.last_T_tip = at;
    return finish(base, *way.back());
  }

 private:
  const urdf::Link& base_link() const {
    if (options_.base_link.empty()) return *model_.getRoot();
    return named(options_.base_link, "arm.base_link");
  }

  const urdf::Link& named(const std::string& name, std::string_view key) const {
    const auto link = model_.getLink(name);
    if (link != nullptr) return *link;
    std::string names;
    for (const auto& [known, ignored] : model_.links_) names += (names.empty() ? "" : ", ") + known;
    fail("{:.80}: {}: no link '{:.40}'; there are {:.90}", file_, key, name, names);
  }

  static bool moves_something(const urdf::Link& link, int depth = 0) {
    return depth < kDepthMax &&
           std::ranges::any_of(
               link.child_links,
               [&](const auto& child) { return moves(*child->parent_joint) || moves_something(*child, depth + 1); });
  }

  /// The named tip, or the end of the only line of joints that move: what stands fixed on the last one is followed as
  /// long as it does not branch.
  const urdf::Link& tip_link(const urdf::Link& base) const {
    if (!options_.tip_link.empty()) return named(options_.tip_link, "arm.tip_link");
    const urdf::Link* at = &base;
    for (int depth = 0; depth < kDepthMax; ++depth) {
      std::vector<const urdf::Link*> on;
      for (const auto& child : at->child_links) {
        if (moves(*child->parent_joint) || moves_something(*child)) on.push_back(child.get());
      }
      if (on.size() > 1) {
        fail("{:.80}: the chain branches at {}: to {} and {}; name the flange by arm.tip_link", file_, at->name,
             on[0]->name, on[1]->name);
      }
      if (!on.empty()) {
        at = on.front();
      } else if (at->child_links.size() == 1) {
        at = at->child_links.front().get();
      } else {
        break;
      }
    }
    return *at;
  }

  std::vector<const urdf::Link*> way_from(const urdf::Link& base, const urdf::Link& tip) const {
    std::vector<const urdf::Link*> way;
    urdf::LinkSharedPtr hold;  // getParent makes a new owner
    for (const urdf::Link* at = &tip; at != &base;) {
      way.push_back(at);
      hold = at->getParent();
      if (hold == nullptr || std::ssize(way) > kDepthMax) {
        fail("{:.80}: {} does not hang on {}; arm.base_link must stand before arm.tip_link", file_, tip.name,
             base.name);
      }
      at = hold.get();
    }
    std::ranges::reverse(way);
    return way;
  }

  ChainJoint joint_of(const urdf::Joint& joint, const Pose& before_T_joint) const {
    const bool continuous = joint.type == urdf::Joint::CONTINUOUS;
    if (joint.type == urdf::Joint::PRISMATIC) {
      fail("{:.80}: joint {} is prismatic; only rotary joints are supported. Begin behind it with arm.base_link", file_,
           joint.name);
    }
    if (joint.type != urdf::Joint::REVOLUTE && !continuous) {
      fail("{:.80}: joint {} is neither revolute nor continuous nor fixed", file_, joint.name);
    }
    if (joint.mimic != nullptr) fail("{:.80}: joint {} mimics another; it cannot be moved alone", file_, joint.name);
    if (joint.limits == nullptr) {
      fail("{:.80}: joint {} has no <limit>; without limits of angle and velocity nothing is moved", file_, joint.name);
    }
    const Vector3d axis(joint.axis.x, joint.axis.y, joint.axis.z);
    if (!axis.allFinite() || axis.norm() < 1e-6) fail("{:.80}: joint {} has no axis", file_, joint.name);
    if (!before_T_joint.matrix().allFinite()) fail("{:.80}: joint {}: its origin is not finite", file_, joint.name);
    const double turn = 2 * std::numbers::pi;
    return {.before_T_joint = before_T_joint,
            .axis = axis,
            .lower_rad = continuous ? -turn : joint.limits->lower,
            .upper_rad = continuous ? turn : joint.limits->upper,
            .speed_max_rad_s = joint.limits->velocity};
  }

  /// The collision geometry of a link and of all that hangs on it but what the chain itself moves. Other joints are
  /// taken to stand at zero, or as near to it as their limits allow.
  void add_body(const urdf::Link& link, const Pose& frame_T_link, int number, const std::vector<const urdf::Link*>& way,
                int depth = 0) {
    if (depth > kDepthMax) fail("{:.80}: more than {} links in one line", file_, kDepthMax);
    auto shapes = link.collision_array;
    if (shapes.empty() && link.collision != nullptr) shapes.push_back(link.collision);
    for (const auto& shape : shapes) {
      if (shape->geometry == nullptr) fail("{:.80}: link {}: a <collision> has no geometry", file_, link.name);
      add_capsule(link, frame_T_link * pose_of(shape->origin), *shape->geometry, number);
    }
    if (std::ranges::find(options_.links_without_body, link.name) != options_.links_without_body.end()) {
      bare_ |= 1U << number;
    }
    for (const auto& child : link.child_links) {
      const urdf::Joint& joint = *child->parent_joint;
      const bool on_way = std::ranges::find(way, child.get()) != way.end();
      if (on_way && moves(joint)) continue;
      Pose at = frame_T_link * pose_of(joint.parent_to_joint_origin_transform);
      if (moves(joint)) {
        at = at * standing(joint);
        still_.push_back(joint.name);
      }
      add_body(*child, at, number, way, depth + 1);
    }
  }

  static Pose standing(const urdf::Joint& joint) {
    const double value = joint.limits == nullptr || joint.type == urdf::Joint::CONTINUOUS
                             ? 0
                             : std::clamp(0.0, std::min(joint.limits->lower, joint.limits->upper),
                                          std::max(joint.limits->lower, joint.limits->upper));
    const Vector3d axis = Vector3d(joint.axis.x, joint.axis.y, joint.axis.z).normalized();
    if (joint.type == urdf::Joint::PRISMATIC) return Pose(Eigen::Translation3d(value * axis));
    return Pose(Eigen::AngleAxisd(value, axis));
  }

  void add_capsule(const urdf::Link& link, const Pose& frame_T_shape, const urdf::Geometry& geometry, int number) {
    if (chain_.body.size() == kArmFileCapsulesMax) {
      fail("{:.80}: more than {} collision shapes; give the links fewer", file_, kArmFileCapsulesMax);
    }
    if (!has_size(geometry)) fail("{:.80}: link {}: a collision shape needs sizes above 0", file_, link.name);
    Capsule capsule;
    if (geometry.type == urdf::Geometry::SPHERE) {
      const double radius = static_cast<const urdf::Sphere&>(geometry).radius;
      capsule = {Vector3d::Zero(), Vector3d::Zero(), radius, number};
    } else {
      const std::vector<Vector3d> points = points_of(link, geometry);
      capsule = fit_capsule(points, number);
      if (farthest_outside_m(capsule, points) > 0) {
        fail("{:.80}: link {}: a vertex lies outside of the capsule that was fitted", file_, link.name);
      }
    }
    capsule.a = frame_T_shape * capsule.a;
    capsule.b = frame_T_shape * capsule.b;
    if (!capsule.a.allFinite() || !capsule.b.allFinite() || !(capsule.radius_m > 0)) {
      fail("{:.80}: link {}: a collision shape stands at no finite place", file_, link.name);
    }
    chain_.body.push_back(capsule);
  }

  std::vector<Vector3d> points_of(const urdf::Link& link, const urdf::Geometry& geometry) const {
    std::vector<Vector3d> points;
    if (geometry.type == urdf::Geometry::BOX) {
      const urdf::Vector3& dim = static_cast<const urdf::Box&>(geometry).dim;
      for (int corner = 0; corner < 8; ++corner) {
        points.emplace_back((corner & 1 ? 0.5 : -0.5) * dim.x, (corner & 2 ? 0.5 : -0.5) * dim.y,
                            (corner & 4 ? 0.5 : -0.5) * dim.z);
      }
    } else if (geometry.type == urdf::Geometry::CYLINDER) {
      const auto& cylinder = static_cast<const urdf::Cylinder&>(geometry);
      // Points of a polygon around the edge.
      const double r = cylinder.radius / std::cos(std::numbers::pi / kCirclePoints);
      for (int i = 0; i < kCirclePoints; ++i) {
        const double angle = 2 * std::numbers::pi * i / kCirclePoints;
        for (const double side : {-0.5, 0.5}) {
          points.emplace_back(r * std::cos(angle), r * std::sin(angle), side * cylinder.length);
        }
      }
    } else {
      const auto& mesh = static_cast<const urdf::Mesh&>(geometry);
      auto read = read_mesh_points(mesh_path(link, mesh.filename));
      if (!read) throw ArmFailure{read.error()};
      points = std::move(*read);
      for (Vector3d& p : points) p = p.cwiseProduct(Vector3d(mesh.scale.x, mesh.scale.y, mesh.scale.z));
    }
    double size_m = 0;
    for (const Vector3d& p : points) size_m = std::max(size_m, p.allFinite() ? p.norm() : kMeshMax_m + 1);
    if (size_m > kMeshMax_m) {
      fail(
          "{:.80}: link {}: a collision shape reaches {:.0f} m; is it in millimetres? <mesh scale=\"0.001 0.001 "
          "0.001\">",
          file_, link.name, size_m);
    }
    return points;
  }

  /// package://NAME/REST is NAME/REST or REST in the URDF's folder or one above it.
  std::string mesh_path(const urdf::Link& link, std::string name) const {
    namespace fs = std::filesystem;
    for (const std::string_view scheme : {"file://", "package://"}) {
      if (!name.starts_with(scheme)) continue;
      name = name.substr(scheme.size());
      if (scheme == "file://") return name;
      const std::string rest = name.substr(std::min(name.find('/') + 1, name.size()));
      std::error_code ignored;
      fs::path folder = fs::absolute(folder_.empty() ? "." : folder_, ignored);
      for (int up = 0; up < 8; ++up, folder = folder.parent_path()) {
        for (const std::string& candidate : {name, rest}) {
          if (fs::exists(folder / candidate, ignored)) return folder / candidate;
        }
        if (folder == folder.parent_path()) break;
      }
      fail("{:.80}: link {}: package://{:.80} is not found at or above the file's folder", file_, link.name, name);
    }
    return fs::path(name).is_absolute() ? name : (fs::path(folder_) / name).string();
  }

  ArmFromFile finish(const urdf::Link& base, const urdf::Link& tip) {
    ChainedArm made = arm_from_chain(chain_, model_.getName());
    const auto with_file = [&](const Status& status) {
      if (!status) fail("{:.80}: {}", file_, status.error().detail());
    };
    with_file(check_arm(made.arm, names_, bare_));
    with_file(complete_arm(made.arm));
    ArmFromFile read{made.arm, {}};
    read.summary = fmt::format("{}: {} joints from {} to {}, {} capsules, from {}", model_.getName(), made.arm.joints,
                               base.name, tip.name, made.arm.body.size(), file_);
    const Vector3d moved = made.root_T_base.translation();
    if (!made.root_T_base.isApprox(Pose::Identity(), 1e-12)) {
      const bool turned = !made.root_T_base.linear().isIdentity(1e-12);
      read.summary += fmt::format("; Base stands on axis 1, at {:.4f}, {:.4f}, {:.4f} m of {}{}", moved.x(), moved.y(),
                                  moved.z(), base.name, turned ? ", turned so that its z is that axis" : "");
    }
    if (!still_.empty()) {
      read.summary += fmt::format("; not moved and taken to stand at zero: {}", fmt::join(still_, ", "));
    }
    return read;
  }

  const urdf::ModelInterface& model_;
  std::string file_;
  std::string folder_;
  const ArmFileOptions& options_;
  JointChain chain_;
  std::vector<std::string> names_;
  std::vector<std::string> still_;
  unsigned bare_ = 0;
};

}  // namespace

Result<ArmFromFile> parse_arm_urdf(std::string_view urdf, const std::string& name, const std::string& folder,
                                   const ArmFileOptions& options) {
  try {
    const Complaints complaints;
    const auto model = urdf::parseURDF(std::string(urdf));
    if (model == nullptr || model->getRoot() == nullptr) {
      return failure(Fault::kConfigBadValue, "{:.80}: no URDF: {}", name,
                     complaints.first().empty() ? "it is not understood" : complaints.first());
    }
    return Reader(*model, name, folder, options).read();
  } catch (const ArmFailure& wrong) {
    return std::unexpected(wrong.error);
  } catch (const std::exception& wrong) {
    return failure(Fault::kConfigBadValue, "{:.80}: no URDF: {}", name, wrong.what());
  }
}

}  // namespace firstlook
