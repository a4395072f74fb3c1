#include "tools/gcode/neighbours.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <string>

#include "firmware/procedure/plan/wording.hpp"
#include "protocol/units/angle.hpp"
#include "tools/gcode/place_of.hpp"

namespace probebox::gcode {
namespace {

using Eigen::Vector3d;

constexpr double kBeside_mm = 1;  // less than from a ball after its touches

double distanceTo(const Vector3d& point, const Vector3d& from, const Vector3d& to) {
  const Vector3d way = to - from;
  const double length2 = way.squaredNorm();
  const double share = length2 > 0 ? std::clamp((point - from).dot(way) / length2, 0.0, 1.0) : 0;
  return (from + share * way - point).norm();
}

// Where the stylus, the axes and the run are behind the blocks so far.
struct Progress {
  std::optional<Vector3d> at_mm;
  std::array<double, 3> angles_rad{};
  std::size_t step{};

  void take(const Block& block) {
    if (const auto* turn = std::get_if<Turn>(&block)) {
      for (std::size_t axis = 0; axis < angles_rad.size(); ++axis) {
        if (turn->used[axis]) angles_rad[axis] = radians(turn->to_deg[axis]);
      }
    } else if (const auto* mark = std::get_if<Mark>(&block)) {
      step = mark->begin ? mark->step : mark->step + 1;
    } else if (std::holds_alternative<Retract>(block)) {
      at_mm.reset();
    } else if (const auto* move = std::get_if<Move>(&block); move != nullptr && knowsPlace(*move)) {
      at_mm = move->to_mm;
    }
  }
};

Error through(std::size_t ball, const Progress& at) {
  const auto angle = [&](std::size_t axis) {
    return procedure::number(std::round(degrees(at.angles_rad[axis])) + 0.0);
  };
  return Error{"On the way to or from step " + std::to_string(at.step + 1) + ", with B " + angle(1) + " and C " +
               angle(2) + ", the stylus would come to ball " + std::to_string(ball + 1) +
               " of the part: choose other angles (--tilts, --angles, --arc), or balls that stand further apart."};
}

bool touchesBalls(const procedure::Plan& plan) {
  return std::ranges::any_of(std::span{plan.steps}.first(plan.step_count), [](const procedure::Step& step) {
    return step.feature == procedure::Feature::part_ball && step.kind != procedure::Kind::hold;
  });
}

}  // namespace

std::optional<Error> whyThroughNeighbour(const procedure::Plan& plan, const Blocks& blocks, const Setting& setting) {
  if (!touchesBalls(plan)) return std::nullopt;
  const double met_mm = (*setting.ball_diameter_mm + *setting.stylus_diameter_mm) / 2;
  Progress at;
  for (const auto& block : blocks) {
    const auto* move = std::get_if<Move>(&block);
    if (move != nullptr && at.at_mm && move->axes == Move::Axes::xyz) {
      const auto& step = plan.steps[std::min(at.step, plan.step_count - 1)];
      const bool tilts = step.b_moves == procedure::BMoves::table;
      for (std::size_t ball = 0; ball < setting.balls_mm.size(); ++ball) {
        const bool own = ball + 1 == step.touch.ball;
        if (own && move->way == Way::measure) continue;
        const Vector3d centre = ballInPose(ball, at.angles_rad, tilts, setting);
        if (distanceTo(centre, *at.at_mm, move->to_mm) < met_mm + (own ? 0 : kBeside_mm)) return through(ball, at);
      }
    }
    at.take(block);
  }
  return std::nullopt;
}

}  // namespace probebox::gcode
