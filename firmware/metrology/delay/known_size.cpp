#include "firmware/metrology/delay/known_size.hpp"

#include <Eigen/Core>
#include <array>
#include <string>

#include "firmware/metrology/dataset/configuration.hpp"

namespace probebox::metrology {
namespace {

constexpr std::array<std::string_view, 2> kTouchedFrom{"internal", "external"};

// Within a feature the normals point towards its middle.
bool pointInwards(const std::vector<Touch>& touches) {
  Eigen::RowVector3d middle = Eigen::RowVector3d::Zero();
  for (const auto& touch : touches) middle += touch.machine.values.row(0) / static_cast<double>(touches.size());
  double outwards = 0.0;
  for (const auto& touch : touches) outwards += (touch.machine.values.row(0) - middle).dot(touch.plan.normal);
  return outwards < 0.0;
}

}  // namespace

Outcome<double, Refusal> effectiveSize(const Dataset& dataset, const std::vector<Touch>& touches,
                                       std::string_view size_key) {
  const std::string key{size_key};
  TRY(const auto size, requiredPositive(dataset, key));
  TRY(const auto ball, requiredPositive(dataset, "stylus_ball_diameter_mm"));
  TRY(const auto feature, configWord(dataset, "feature", kTouchedFrom));
  const bool internal = pointInwards(touches);
  if (feature && (*feature == "internal") != internal)
    return Refusal{"bad-config", "feature is '" + *feature + "', but the normals point " +
                                     (internal ? "inwards as from an internal" : "outwards as from an external") +
                                     " one: correct the configuration or the normals"};
  const double size_mm = internal ? size - ball : size + ball;
  if (size_mm > 0.0) return size_mm;
  return Refusal{"bad-config", "the stylus ball (" + text(ball) + " mm) does not fit into " + text(size) +
                                   " mm: check " + key + " and stylus_ball_diameter_mm"};
}

}  // namespace probebox::metrology
