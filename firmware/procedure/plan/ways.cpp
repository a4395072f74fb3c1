#include "firmware/procedure/plan/ways.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "firmware/procedure/plan/wording.hpp"
#include "protocol/units/angle.hpp"

namespace probebox::procedure {
namespace {

using Eigen::Vector3d;

constexpr double kAround_mm = 4;  // further out than any clearance and its run-out
constexpr double kBeside_mm = 1;  // distance of surfaces that the places of features leave
constexpr double kOverTheTopFrom_rad = 1.75;

Vector3d vectorOf(const std::array<double, 3>& from) {
  return {from[0], from[1], from[2]};
}

bool touchesPlate(const Step& step) {
  return step.feature == Feature::part_ball && (step.kind == Kind::touch || step.kind == Kind::in_out) &&
         step.touch.mount <= 1 && step.touch.ball > 0;
}

bool stays(const Step& before, const Step& step) {
  return touchesPlate(before) && before.touch.ball == step.touch.ball && before.touch.tool == step.touch.tool &&
         before.touch.mount == step.touch.mount && before.touch.rotary_angles_rad == step.touch.rotary_angles_rad;
}

// The balls of the plate in the pose of a step.
std::vector<Vector3d> ballsAt(const Step& step, const Facts& facts) {
  const Vector3d on_c = vectorOf(facts.ball_plate->axis_point_mm);
  const Eigen::AngleAxisd by_c{step.touch.rotary_angles_rad[2], Vector3d::UnitZ()};
  std::vector<Vector3d> balls;
  for (const auto& at_mm : facts.ball_plate->balls_mm) balls.emplace_back(on_c + by_c * vectorOf(at_mm));
  if (step.b_moves != BMoves::table) return balls;
  const Vector3d on_b = vectorOf(*facts.tilting_table->point_mm);
  const Eigen::AngleAxisd by_b{step.touch.rotary_angles_rad[1], vectorOf(facts.tilting_table->axis)};
  for (auto& ball : balls) ball = on_b + by_b * (ball - on_b);
  return balls;
}

// Ways of the centre of the stylus ball round one ball.
class Around {
 public:
  Around(std::vector<Vector3d> balls, std::size_t own, double met_mm)
      : balls_{std::move(balls)}, own_{own}, met_mm_{met_mm} {}

  // The ball that stands in a way; nothing where none does.
  std::optional<std::size_t> down(const Vector3d& to) const {
    const auto met = upright(Vector3d::UnitZ());
    return met ? met : along(Vector3d::UnitZ(), to);
  }
  std::optional<std::size_t> round(const Vector3d& from, const Vector3d& to) const {
    if (std::acos(std::clamp(from.dot(to), -1.0, 1.0)) <= kOverTheTopFrom_rad) return along(from, to);
    const auto met = along(from, Vector3d::UnitZ());
    return met ? met : along(Vector3d::UnitZ(), to);
  }
  // Up from a touch, and any way down to one.
  std::optional<std::size_t> upright(const Vector3d& from) const {
    const Vector3d low = balls_[own_] + (met_mm_ + kAround_mm) * from;
    return met([&](const Vector3d& ball) { return Vector3d{low.x(), low.y(), std::max(low.z(), ball.z())}; });
  }

 private:
  std::optional<std::size_t> along(const Vector3d& from, const Vector3d& to) const {
    constexpr int kParts = 12;
    const auto turn = Eigen::Quaterniond::FromTwoVectors(from, to);
    for (int part = 0; part <= kParts; ++part) {
      const Vector3d direction = Eigen::Quaterniond::Identity().slerp(static_cast<double>(part) / kParts, turn) * from;
      const Vector3d at = balls_[own_] + (met_mm_ + kAround_mm) * direction;
      if (const auto found = met([&](const Vector3d&) { return at; })) return found;
    }
    return std::nullopt;
  }
  std::optional<std::size_t> met(const auto& nearestTo) const {
    for (std::size_t ball = 0; ball < balls_.size(); ++ball) {
      if (ball != own_ && (nearestTo(balls_[ball]) - balls_[ball]).norm() < met_mm_ + kBeside_mm) return ball;
    }
    return std::nullopt;
  }

  std::vector<Vector3d> balls_;
  std::size_t own_;
  double met_mm_;
};

Error through(std::size_t ball, std::size_t step, const std::array<double, 3>& angles_rad) {
  const auto angle = [&](std::size_t axis) { return number(std::round(degrees(angles_rad[axis])) + 0.0); };
  return Error{"On the way to or from step " + std::to_string(step + 1) + ", with B " + angle(1) + " and C " +
               angle(2) + ", the stylus would come to ball " + std::to_string(ball + 1) +
               " of [ball_plate]: choose other angles (tilts_deg of [tilting_table] in machine.toml, --angles, --arc), "
               "or balls that stand further apart."};
}

}  // namespace

std::optional<Error> whyThroughBall(const Plan& plan, const Facts& facts) {
  const auto& plate = facts.ball_plate;
  if (!plate || !plate->ball_diameter_mm) return std::nullopt;
  const double met_mm = (*plate->ball_diameter_mm + facts.stylus_ball_diameter_mm) / 2;
  for (std::size_t i = 0; i < plan.step_count; ++i) {
    const Step& step = plan.steps[i];
    const bool tilts = step.b_moves == BMoves::table;
    if (!touchesPlate(step) || step.touch.ball > plate->balls_mm.size()) continue;
    if (tilts && !(facts.tilting_table && facts.tilting_table->point_mm)) continue;
    const Around around{ballsAt(step, facts), step.touch.ball - 1U, met_mm};
    const Vector3d to = vectorOf(step.touch.outward_normal);
    const bool stayed = i > 0 && stays(plan.steps[i - 1], step);
    auto ball = stayed ? around.round(vectorOf(plan.steps[i - 1].touch.outward_normal), to) : around.down(to);
    const bool leaves = i + 1 == plan.step_count || !stays(step, plan.steps[i + 1]);
    if (!ball && leaves) ball = around.upright(to);
    if (ball) return through(*ball, i, step.touch.rotary_angles_rad);
  }
  return std::nullopt;
}

}  // namespace probebox::procedure
