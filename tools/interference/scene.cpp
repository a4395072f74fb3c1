#include "tools/interference/scene.hpp"

#include <fcl/fcl.h>
#include <limits>
#include <utility>

#include "protocol/units/angle.hpp"

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
  };
  struct Part {
    ToolPart part{};
    double middle_mm{};  // above the tip
    std::unique_ptr<Object> object;
  };
  std::vector<Solid> solids;
  std::vector<Part> parts;

  void add(ToolPart part, double radius_mm, double from_mm, double to_mm) {
    if (!(to_mm > from_mm)) return;
    parts.push_back({part, (from_mm + to_mm) / 2,
                     std::make_unique<Object>(std::make_shared<fcl::Cylinderd>(radius_mm, to_mm - from_mm))});
  }
};

Scene::Scene() : objects_{std::make_unique<Objects>()} {}
Scene::~Scene() = default;

Outcome<std::unique_ptr<Scene>> Scene::open(const board::Cell& cell, const board::CellTool& tool,
                                            const std::filesystem::path& folder) {
  std::unique_ptr<Scene> scene{new Scene};
  for (const auto& solid : cell.solids) {
    TRY(auto geometry, geometryOf(solid, folder));
    scene->objects_->solids.push_back({solid.name, solid.part == board::SolidPart::workpiece,
                                       std::make_unique<Object>(std::move(geometry), poseOf(solid))});
  }
  const auto lengths = scene->lengths_ = lengthsOf(tool);
  scene->objects_->add(ToolPart::cutter, tool.radius_mm, 0, tool.cutting_mm);
  scene->objects_->add(ToolPart::shank, tool.radius_mm, tool.cutting_mm, lengths.assembled_mm);
  scene->objects_->add(ToolPart::holder, tool.holder_radius_mm, lengths.assembled_mm,
                       lengths.assembled_mm + lengths.holder_mm);
  return scene;
}

Nearest Scene::nearest(const Point& tip, bool cuts) const {
  Nearest best{.distance_mm = std::numeric_limits<double>::infinity(), .solid = {}};
  for (const auto& part : objects_->parts) {
    part.object->setTranslation({tip[0] + lengths_.tip_mm[0], tip[1] + lengths_.tip_mm[1], tip[2] + part.middle_mm});
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
