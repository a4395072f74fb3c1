#include "tools/interference/scene.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <fcl/fcl.h>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "board/describe/cell.hpp"
#include "protocol/units/angle.hpp"
#include "tools/interference/program.hpp"

namespace probebox::interference {

// A ball around something that an axis carries, mm.
struct Around {
  Eigen::Vector3d middle{};
  double radius_mm{};
};

// Where the rotary axes of a cell turn what they carry, and how far they move it.
class Turning {
 public:
  // gauge_mm: height of the gauge line above the tip, from which the axes of a head are described.
  Turning(const std::vector<board::CellRotary>& axes, double gauge_mm);

  // Of the solids that the axis at `place` carries, from their place at zero.
  Eigen::Isometry3d ofSolids(std::size_t place, const Angles& angles_deg) const;
  // Of the tool, from upright; the origin is its tip, if it were on the spindle axis.
  Eigen::Isometry3d ofTool(const Angles& angles_deg) const;

  // Adds a ball at angles 0 that the axis at `place`, or the head, carries; far() then has an upper bound for it.
  void carry(std::size_t place, const Around& around);
  void carryTool(const Around& around);
  // An upper bound for the Z of a ball that the axis at `place` carries, however the axes stand.
  double highest(std::size_t place, const Around& around) const;
  // How far all of these move at most while the axes turn, mm.
  double far(const Angles& from_deg, const Angles& to_deg) const;

 private:
  struct Axis {
    std::size_t letter{};
    board::Carries carries{};
    Eigen::Vector3d direction, through;
    double arm_mm{};  // of the furthest point that it turns
  };
  std::vector<std::size_t> chain(board::Carries carries, std::size_t last) const;
  Eigen::Isometry3d along(std::span<const std::size_t> chain, const Angles& angles_deg) const;
  void lengthen(std::span<const std::size_t> chain, const Around& around);

  std::vector<Axis> axes_;
};

Turning::Turning(const std::vector<board::CellRotary>& axes, double gauge_mm) {
  for (const auto& axis : axes) {
    const bool head = axis.carries == board::Carries::tool;
    axes_.push_back({static_cast<std::size_t>(axis.letter), axis.carries, Eigen::Vector3d{axis.direction.data()},
                     Eigen::Vector3d{axis.through_mm.data()} + (head ? gauge_mm : 0.0) * Eigen::Vector3d::UnitZ()});
  }
}

// Places of the axes of one chain, from the base to `last`.
std::vector<std::size_t> Turning::chain(board::Carries carries, std::size_t last) const {
  std::vector<std::size_t> all;
  for (std::size_t k = 0; k < axes_.size() && k <= last; ++k) {
    if (axes_[k].carries == carries) all.push_back(k);
  }
  return all;
}

Eigen::Isometry3d Turning::along(std::span<const std::size_t> chain, const Angles& angles_deg) const {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  for (const auto place : chain) {
    const auto& axis = axes_[place];
    pose.translate(axis.through);
    pose.rotate(Eigen::AngleAxisd{angles_deg[axis.letter] * kDegree, axis.direction});
    pose.translate(-axis.through);
  }
  return pose;
}

Eigen::Isometry3d Turning::ofSolids(std::size_t place, const Angles& angles_deg) const {
  return along(chain(board::Carries::solids, place), angles_deg);
}

Eigen::Isometry3d Turning::ofTool(const Angles& angles_deg) const {
  return along(chain(board::Carries::tool, axes_.size()), angles_deg);
}

void Turning::carry(std::size_t place, const Around& around) {
  lengthen(chain(board::Carries::solids, place), around);
}

void Turning::carryTool(const Around& around) {
  lengthen(chain(board::Carries::tool, axes_.size()), around);
}

// The outermost axis keeps the ball at one distance from itself, and the points of its axis at one distance from the
// axis that carries it: the sum of these is the longest arm, however the axes in between stand.
void Turning::lengthen(std::span<const std::size_t> chain, const Around& around) {
  double beyond = 0;
  for (std::size_t k = chain.size(); k-- > 0;) {
    auto& axis = axes_[chain[k]];
    const bool outermost = k + 1 == chain.size();
    const double from_line = (around.middle - axis.through).cross(axis.direction).norm();
    axis.arm_mm = std::max(axis.arm_mm, outermost ? from_line + around.radius_mm : beyond);
    beyond += outermost ? (around.middle - axis.through).norm() + around.radius_mm : 0;
    if (k > 0) beyond += (axis.through - axes_[chain[k - 1]].through).norm();
  }
}

double Turning::highest(std::size_t place, const Around& around) const {
  const auto axes = chain(board::Carries::solids, place);
  double reach = around.radius_mm;
  Eigen::Vector3d at = around.middle;
  for (auto k = axes.rbegin(); k != axes.rend(); ++k) {
    reach += (at - axes_[*k].through).norm();
    at = axes_[*k].through;
  }
  return at[2] + reach;
}

double Turning::far(const Angles& from_deg, const Angles& to_deg) const {
  double all = 0;
  for (const auto& axis : axes_) all += std::abs(to_deg[axis.letter] - from_deg[axis.letter]) * kDegree * axis.arm_mm;
  return all;
}

namespace {

using Object = fcl::CollisionObject<double>;

Point pointOf(const fcl::Vector3d& v) {
  return {v[0], v[1], v[2]};
}

fcl::Transform3d poseOf(const board::CellSolid& solid) {
  fcl::Transform3d pose = fcl::Transform3d::Identity();
  pose.translation() = fcl::Vector3d{solid.at_mm[0], solid.at_mm[1], solid.at_mm[2]};
  pose.linear() = (Eigen::AngleAxisd{solid.turn_deg[2] * kDegree, fcl::Vector3d::UnitZ()} *
                   Eigen::AngleAxisd{solid.turn_deg[1] * kDegree, fcl::Vector3d::UnitY()} *
                   Eigen::AngleAxisd{solid.turn_deg[0] * kDegree, fcl::Vector3d::UnitX()})
                      .toRotationMatrix();
  return pose;
}

using Geometry = std::shared_ptr<fcl::CollisionGeometryd>;

// inside and sizes: of a mesh.
Outcome<Geometry> geometryOf(const board::CellSolid& solid, const std::filesystem::path& folder,
                             std::shared_ptr<const Inside>& inside, std::vector<MeshSize>& sizes) {
  switch (solid.shape) {
    case board::SolidShape::box:
      return Geometry{std::make_shared<fcl::Boxd>(solid.size_mm[0], solid.size_mm[1], solid.size_mm[2])};
    case board::SolidShape::cylinder:
      return Geometry{std::make_shared<fcl::Cylinderd>(solid.radius_mm, solid.height_mm)};
    case board::SolidShape::sphere:
      return Geometry{std::make_shared<fcl::Sphered>(solid.radius_mm)};
    case board::SolidShape::mesh:
      break;
  }
  TRY(const auto mesh, meshOf(solid, folder));
  sizes.push_back({solid.name, sizeOf(mesh), solid.unit_mm.has_value()});
  inside = std::make_shared<const Inside>(mesh);
  auto model = std::make_shared<fcl::BVHModel<fcl::OBBRSSd>>();
  std::vector<fcl::Vector3d> points;
  for (const auto& point : mesh.points) points.emplace_back(point[0], point[1], point[2]);
  std::vector<fcl::Triangle> triangles;
  for (const auto& [a, b, c] : mesh.triangles) triangles.emplace_back(a, b, c);
  model->beginModel();
  model->addSubModel(points, triangles);
  model->endModel();
  return Geometry{std::move(model)};
}

// Whether a part of the tool that does not touch the surface of a mesh is enclosed by it.
bool isWithin(const Object& part, const Object& solid, const Inside& inside) {
  if (!solid.getAABB().contain(part.getAABB())) return false;
  const fcl::Vector3d from_solid = part.getTranslation() - solid.getTranslation();
  return inside.contains(pointOf(solid.getRotation().transpose() * from_solid));
}

}  // namespace

struct Scene::Objects {
  struct Solid {
    std::string name;
    bool workpiece{};
    std::unique_ptr<Object> object;
    std::optional<std::size_t> moves_with;
    fcl::Transform3d at_zero;
    Geometry geometry;
    std::shared_ptr<const Inside> inside;  // of a mesh
  };
  struct Part {
    ToolPart part{};
    fcl::Vector3d middle;  // from the tip, upright
    std::unique_ptr<Object> object;
  };
  explicit Objects(Turning of_cell) : turning{std::move(of_cell)} {}
  std::vector<Solid> solids;
  std::vector<Part> parts;
  Turning turning;
  Angles turned_deg{};  // as the solids stand
  double top = -std::numeric_limits<double>::infinity();

  void add(ToolPart part, const std::array<double, 2>& across_mm, double radius_mm, double from_mm, double to_mm) {
    if (!(to_mm > from_mm)) return;
    const fcl::Vector3d middle{across_mm[0], across_mm[1], (from_mm + to_mm) / 2};
    parts.push_back(
        {part, middle, std::make_unique<Object>(std::make_shared<fcl::Cylinderd>(radius_mm, to_mm - from_mm))});
    turning.carryTool({middle, std::hypot(radius_mm, (to_mm - from_mm) / 2)});
  }
  void add(const Solid& solid) {
    auto object = std::make_unique<Object>(solid.geometry, solid.at_zero);
    solid.geometry->computeLocalAABB();
    const fcl::Vector3d middle = solid.at_zero * solid.geometry->aabb_center;
    const double radius = solid.geometry->aabb_radius;
    if (solid.moves_with) turning.carry(*solid.moves_with, {middle, radius});
    top = std::max(top,
                   solid.moves_with ? turning.highest(*solid.moves_with, {middle, radius}) : object->getAABB().max_[2]);
    solids.push_back({solid.name, solid.workpiece, std::move(object), solid.moves_with, solid.at_zero, solid.geometry,
                      solid.inside});
  }
  void add(const board::CellTool& tool, const Lengths& lengths) {
    add(ToolPart::cutter, lengths.tip_mm, tool.radius_mm, 0, tool.cutting_mm);
    add(ToolPart::shank, lengths.tip_mm, tool.radius_mm, tool.cutting_mm, lengths.assembled_mm);
    add(ToolPart::holder, lengths.tip_mm, tool.holder_radius_mm, lengths.assembled_mm,
        lengths.assembled_mm + lengths.holder_mm);
  }
  void turn(const Angles& angles_deg) {
    if (angles_deg == turned_deg) return;
    turned_deg = angles_deg;
    for (auto& solid : solids) {
      if (!solid.moves_with) continue;
      solid.object->setTransform(turning.ofSolids(*solid.moves_with, angles_deg) * solid.at_zero);
      solid.object->computeAABB();
    }
  }
};

Scene::Scene() = default;
Scene::~Scene() = default;

Outcome<std::shared_ptr<const Scene>> Scene::open(const board::Cell& cell, const board::CellTool& tool,
                                                  const std::filesystem::path& folder) {
  std::shared_ptr<Scene> scene{new Scene};
  const auto lengths = scene->lengths_ = lengthsOf(tool);
  scene->rotary_ = cell.rotary;
  scene->objects_ = std::make_unique<Objects>(Turning{cell.rotary, lengths.assembled_mm + lengths.holder_mm});
  for (const auto& solid : cell.solids) {
    std::shared_ptr<const Inside> inside;
    TRY(auto geometry, geometryOf(solid, folder, inside, scene->meshes_));
    const bool workpiece = solid.part == board::SolidPart::workpiece;
    scene->objects_->add({solid.name, workpiece, {}, solid.moves_with, poseOf(solid), geometry, inside});
  }
  scene->objects_->add(tool, lengths);
  return std::shared_ptr<const Scene>{std::move(scene)};
}

std::shared_ptr<const Scene> Scene::with(const board::CellTool& tool) const {
  std::shared_ptr<Scene> scene{new Scene};
  const auto lengths = scene->lengths_ = lengthsOf(tool);
  scene->rotary_ = rotary_;
  scene->meshes_ = meshes_;
  scene->objects_ = std::make_unique<Objects>(Turning{rotary_, lengths.assembled_mm + lengths.holder_mm});
  for (const auto& solid : objects_->solids) scene->objects_->add(solid);
  scene->objects_->add(tool, lengths);
  return scene;
}

double Scene::top() const {
  return objects_->top;
}

double Scene::travel(const Move& move) const {
  return lengthOf(move) + objects_->turning.far(move.from_deg, move.to_deg);
}

Nearest Scene::nearest(const Pose& pose, bool cuts) const {
  objects_->turn(pose.angles_deg);
  fcl::Transform3d stands = fcl::Transform3d::Identity();
  stands.translation() = fcl::Vector3d{pose.tip[0], pose.tip[1], pose.tip[2]};
  stands = stands * objects_->turning.ofTool(pose.angles_deg);
  Nearest best{.distance_mm = std::numeric_limits<double>::infinity(), .solid = {}};
  for (const auto& part : objects_->parts) {
    part.object->setTransform(stands * Eigen::Translation3d{part.middle});
    part.object->computeAABB();
    for (const auto& solid : objects_->solids) {
      if (cuts && solid.workpiece && part.part == ToolPart::cutter) continue;
      // Boxes around both bound the distance from below: most solids are far away.
      const double apart = part.object->getAABB().distance(solid.object->getAABB());
      if (apart > 0 && apart >= best.distance_mm) continue;
      fcl::CollisionRequestd collides;
      collides.enable_contact = true;
      fcl::CollisionResultd contact;
      if (fcl::collide(part.object.get(), solid.object.get(), collides, contact) > 0) {
        const auto where = pointOf(contact.getContact(0).pos);
        return {0, solid.name, part.part, where, where};
      }
      fcl::DistanceRequestd asked;
      asked.enable_nearest_points = true;
      asked.distance_tolerance = 1e-7;
      fcl::DistanceResultd answer;
      const double distance = std::max(0.0, fcl::distance(part.object.get(), solid.object.get(), asked, answer));
      if (solid.inside && distance > 0 && isWithin(*part.object, *solid.object, *solid.inside)) {
        const auto where = pointOf(part.object->getTranslation());
        return {0, solid.name, part.part, where, where};
      }
      if (distance < best.distance_mm)
        best = {distance, solid.name, part.part, pointOf(answer.nearest_points[0]), pointOf(answer.nearest_points[1])};
    }
  }
  return best;
}

}  // namespace probebox::interference
