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
         step.touch.ball > 0;
}

bool stays(const Step& before, const Step& step) {
  return touchesPlate(before) && before.touch.ball == step.touch.ball && before.touch.tool == step.touch.tool &&
         before.touch.mount == step.touch.mount && before.touch.rotary_angles_rad == step.touch.rotary_angles_rad;
}

// Turns about C that the plate may have in the mount of a step. A shift moves all balls alike.
std::vector<double> turnsOf(const Step& step, const BallPlate& plate) {
  constexpr int kTried = 72;
  if (step.touch.mount <= 1) return {0};
  const std::size_t further = step.touch.mount - 2U;
  if (further < plate.mount_turns_rad.size()) return {plate.mount_turns_rad[further]};
  std::vector<double> all;
  for (int k = 0; k < kTried; ++k) all.push_back(kTurn * k / kTried);
  return all;
}

// The balls of the plate in the pose of a step.
std::vector<Vector3d> ballsAt(const Step& step, const Facts& facts, double mount_turn_rad) {
  const Vector3d on_c = vectorOf(facts.ball_plate->axis_point_mm);
  const Eigen::AngleAxisd by_c{mount_turn_rad + step.touch.rotary_angles_rad[2], Vector3d::UnitZ()};
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
    return hanging(balls_[own_] + (met_mm_ + kAround_mm) * from);
  }

 private:
  std::optional<std::size_t> along(const Vector3d& from, const Vector3d& to) const {
    constexpr int kParts = 12;
    const auto turn = Eigen::Quaterniond::FromTwoVectors(from, to);
    for (int part = 0; part <= kParts; ++part) {
      const Vector3d direction = Eigen::Quaterniond::Identity().slerp(static_cast<double>(part) / kParts, turn) * from;
      const Vector3d at = balls_[own_] + (met_mm_ + kAround_mm) * direction;
      if (const auto found = hanging(at)) return found;
    }
    return std::nullopt;
  }
  // With the ball of the stylus here, and the stylus above it.
  std::optional<std::size_t> hanging(const Vector3d& at) const {
    for (std::size_t k = 0; k < balls_.size(); ++k) {
      const Vector3d& ball = balls_[k];
      const Vector3d nearest{at.x(), at.y(), std::max(at.z(), ball.z())};
      if (k != own_ && (nearest - ball).norm() < met_mm_ + kBeside_mm) return k;
    }
    return std::nullopt;
  }

  std::vector<Vector3d> balls_;
  std::size_t own_;
  double met_mm_;
};

Error through(std::size_t ball, std::size_t step, const capture::TouchRequest& touch, bool turn_known) {
  const auto angle = [&](std::size_t axis) { return number(std::round(degrees(touch.rotary_angles_rad[axis])) + 0.0); };
  const std::string mount = touch.mount > 1 ? " in mount " + std::to_string(touch.mount) : "";
  return Error{"On the way to or from step " + std::to_string(step + 1) + mount + ", with B " + angle(1) + " and C " +
               angle(2) + ", the stylus would come to ball " + std::to_string(ball + 1) +
               " of [ball_plate]: " + (turn_known ? "" : "write mount_turns_deg of [ball_plate] in machine.toml, or ") +
               "choose other angles (tilts_deg of [tilting_table] in machine.toml, --angles, --arc), or balls that "
               "stand further apart."};
}

// The ball in the way of step i; nothing where none is.
std::optional<std::size_t> inTheWay(const Plan& plan, std::size_t i, const Around& around) {
  const Step& step = plan.steps[i];
  const Vector3d to = vectorOf(step.touch.outward_normal);
  const bool stayed = i > 0 && stays(plan.steps[i - 1], step);
  const auto ball = stayed ? around.round(vectorOf(plan.steps[i - 1].touch.outward_normal), to) : around.down(to);
  const bool leaves = i + 1 == plan.step_count || !stays(step, plan.steps[i + 1]);
  return ball || !leaves ? ball : around.upright(to);
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
    const auto turns = turnsOf(step, *plate);
    for (const double turn_rad : turns) {
      const Around around{ballsAt(step, facts, turn_rad), step.touch.ball - 1U, met_mm};
      if (const auto ball = inTheWay(plan, i, around)) return through(*ball, i, step.touch, turns.size() == 1);
    }
  }
  return std::nullopt;
}

}  // namespace probebox::procedure
