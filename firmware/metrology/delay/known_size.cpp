#include "firmware/metrology/delay/known_size.hpp"

#include <Eigen/Core>
#include <string>

#include "firmware/metrology/dataset/configuration.hpp"

namespace probebox::metrology {
namespace {

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
  const double size_mm = pointInwards(touches) ? size - ball : size + ball;
  if (size_mm > 0.0) return size_mm;
  return Refusal{"bad-config", "the stylus ball (" + text(ball) + " mm) does not fit into " + text(size) +
                                   " mm: check " + key + " and stylus_ball_diameter_mm"};
}

}  // namespace probebox::metrology
