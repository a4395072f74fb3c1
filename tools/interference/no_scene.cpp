#include "tools/interference/scene.hpp"

namespace probebox::interference {

// Takes the place of scene.cpp where FCL is missing.
struct Scene::Objects {};
Scene::Scene() = default;
Scene::~Scene() = default;

Outcome<std::unique_ptr<Scene>> Scene::open(const board::Cell&, const board::CellTool&, const std::filesystem::path&) {
  return Error{"this probebox was built without FCL, which measures distances: install libfcl-dev and build again"};
}

Nearest Scene::nearest(const Pose&, bool) const {
  return {};
}

double Scene::travel(const Move&) const {
  return 0;
}

}  // namespace probebox::interference
