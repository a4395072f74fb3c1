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

Outcome<std::shared_ptr<fcl::CollisionGeometryd>> geometryOf(const board::CellSolid& solid,
                                                             const std::filesystem::path& folder) {
  using Geometry = std::shared_ptr<fcl::CollisionGeometryd>;
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
  TRY(const auto mesh, readStl(folder / solid.file));
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

}  // namespace

struct Scene::Objects {
  struct Solid {
    std::string name;
    bool workpiece{};
    std::unique_ptr<Object> object;
    std::optional<std::size_t> moves_with;
    fcl::Transform3d at_zero;
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

  void add(ToolPart part, const std::array<double, 2>& across_mm, double radius_mm, double from_mm, double to_mm) {
    if (!(to_mm > from_mm)) return;
    const fcl::Vector3d middle{across_mm[0], across_mm[1], (from_mm + to_mm) / 2};
    parts.push_back(
        {part, middle, std::make_unique<Object>(std::make_shared<fcl::Cylinderd>(radius_mm, to_mm - from_mm))});
    turning.carryTool({middle, std::hypot(radius_mm, (to_mm - from_mm) / 2)});
  }
  void add(const board::CellSolid& solid, std::shared_ptr<fcl::CollisionGeometryd> geometry) {
    const auto pose = poseOf(solid);
    auto object = std::make_unique<Object>(geometry, pose);
    geometry->computeLocalAABB();
    if (solid.moves_with) turning.carry(*solid.moves_with, {pose * geometry->aabb_center, geometry->aabb_radius});
    const bool workpiece = solid.part == board::SolidPart::workpiece;
    solids.push_back({solid.name, workpiece, std::move(object), solid.moves_with, pose});
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

Outcome<std::unique_ptr<Scene>> Scene::open(const board::Cell& cell, const board::CellTool& tool,
                                            const std::filesystem::path& folder) {
  std::unique_ptr<Scene> scene{new Scene};
  const auto lengths = scene->lengths_ = lengthsOf(tool);
  const double gauge_mm = lengths.assembled_mm + lengths.holder_mm;
  scene->objects_ = std::make_unique<Objects>(Turning{cell.rotary, gauge_mm});
  for (const auto& solid : cell.solids) {
    TRY(auto geometry, geometryOf(solid, folder));
    scene->objects_->add(solid, std::move(geometry));
  }
  scene->objects_->add(ToolPart::cutter, lengths.tip_mm, tool.radius_mm, 0, tool.cutting_mm);
  scene->objects_->add(ToolPart::shank, lengths.tip_mm, tool.radius_mm, tool.cutting_mm, lengths.assembled_mm);
  scene->objects_->add(ToolPart::holder, lengths.tip_mm, tool.holder_radius_mm, lengths.assembled_mm, gauge_mm);
  return scene;
}

double Scene::travel(const Move& move) const {
  return std::hypot(move.to[0] - move.from[0], move.to[1] - move.from[1], move.to[2] - move.from[2]) +
         objects_->turning.far(move.from_deg, move.to_deg);
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
      if (part.object->getAABB().distance(solid.object->getAABB()) >= best.distance_mm) continue;
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
      if (distance < best.distance_mm)
        best = {distance, solid.name, part.part, pointOf(answer.nearest_points[0]), pointOf(answer.nearest_points[1])};
    }
  }
  return best;
}

}  // namespace probebox::interference
