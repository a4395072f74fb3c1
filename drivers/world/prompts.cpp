#include "drivers/world/prompts.hpp"

#include <algorithm>
#include <cmath>
#include <span>

#include "board/describe/world.hpp"
#include "protocol/units/angle.hpp"

namespace probebox::world {

bool movesOneAxis(StepKind kind) {
  return kind == StepKind::jog || kind == StepKind::sweep;
}

bool touches(StepKind kind) {
  return kind == StepKind::touch || kind == StepKind::in_out;
}

namespace {

bool isPath(const ScanPath& scan) {
  const auto isArc = [](double rad) { return rad > 0 && rad < kTurn; };
  const auto isDepth = [](double mm) { return mm > 0 && mm < 10; };
  const auto arcs = std::span{scan.arcs_rad}.first(std::min<std::size_t>(scan.count, ScanPath::kMostArcs));
  return scan.count >= 1 && scan.count <= ScanPath::kMostArcs && std::ranges::all_of(arcs, isArc) &&
         std::ranges::all_of(scan.depths_mm, isDepth) && std::isfinite(scan.start_rad) && std::abs(scan.sense) == 1 &&
         (scan.chords || isArc(scan.ramp_rad));
}

}  // namespace

bool canBeFollowed(const Prompt& prompt) {
  const auto isDirection = [](const Vector3& v) { return std::abs(norm(v) - 1) < 1e-6; };
  const auto isLength = [](double mm) { return mm > 0 && mm < 100; };
  const auto isTravel = [](double mm) { return mm > 0 && mm < 1000; };
  const bool timed = prompt.nominal_speed_mm_s > 0 && std::isfinite(prompt.nominal_speed_mm_s);
  if (prompt.kind == StepKind::rest) return prompt.rest_s > 0 && prompt.rest_s < 3600;
  if (movesOneAxis(prompt.kind)) return isDirection(prompt.outward_normal) && isTravel(prompt.travel_mm) && timed;
  const bool turnable = std::isfinite(norm(prompt.rotary_angles_rad)) &&
                        (prompt.rotary_angles_rad[1] == 0 || prompt.b_moves != BMoves::nothing);
  const bool is_part = prompt.feature == StepFeature::part_ball;
  if (is_part && (prompt.ball < 1 || prompt.ball > board::WorldPartSpindle::kMostBalls)) return false;
  if (prompt.kind == StepKind::turn) {
    const bool turned = std::isfinite(prompt.turn_line_rad) && std::isfinite(prompt.turn_to_rad);
    return isDirection(prompt.outward_normal) && isTravel(prompt.travel_mm) && isLength(prompt.overtravel_mm) &&
           turnable && turned && prompt.turn_speed_rad_s > 0 && is_part;
  }
  if (prompt.kind == StepKind::hold)
    return isDirection(prompt.outward_normal) && prompt.travel_mm >= 0 && prompt.travel_mm < 10 && turnable && timed;
  if (prompt.kind == StepKind::scan)
    return prompt.feature == StepFeature::datum_sphere && isPath(prompt.scan) && isLength(prompt.clearance_mm) && timed;
  const bool approaches =
      prompt.approach_direction == Vector3{} ||
      (isDirection(prompt.approach_direction) && dot(prompt.outward_normal, prompt.approach_direction) < 0);
  const bool by_shank = prompt.shank_height_mm != 0;
  if (by_shank && (!isTravel(prompt.shank_height_mm) || prompt.kind != StepKind::touch)) return false;
  return isDirection(prompt.outward_normal) && isDirection(prompt.retract_direction) && approaches && turnable &&
         prompt.run_out_mm >= 0 && prompt.run_out_mm < 100 &&
         dot(prompt.outward_normal, prompt.retract_direction) > 0 && isLength(prompt.overtravel_mm) &&
         isLength(prompt.clearance_mm) && timed;
}

}  // namespace probebox::world
