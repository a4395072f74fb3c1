#include "tools/interference/scene.hpp"

#include <cmath>
#include <fcl/fcl.h>
#include <limits>
#include <utility>

#include "protocol/units/angle.hpp"
#include "tools/interference/turning.hpp"

namespace probebox::interference {
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
