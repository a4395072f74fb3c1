#include "tools/interference/scene.hpp"

namespace probebox::interference {

// Takes the place of scene.cpp where FCL is missing.
struct Scene::Objects {};
Scene::Scene() = default;
Scene::~Scene() = default;

Outcome<std::shared_ptr<const Scene>> Scene::open(const board::Cell&, const board::CellTool&,
                                                  const std::filesystem::path&) {
  return Error{"this probebox was built without FCL, which measures distances: install libfcl-dev and build again"};
}

std::shared_ptr<const Scene> Scene::with(const board::CellTool&) const {
  return nullptr;
}

double Scene::top() const {
  return 0;
}

Nearest Scene::nearest(const Pose&, bool) const {
  return {};
}

double Scene::travel(const Move&) const {
  return 0;
}

}  // namespace probebox::interference
