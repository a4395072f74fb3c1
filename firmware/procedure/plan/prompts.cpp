#include "firmware/procedure/plan/prompts.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <span>

#include "firmware/procedure/plan/holds.hpp"
#include "firmware/procedure/plan/live_method.hpp"
#include "firmware/procedure/plan/scans.hpp"
#include "firmware/procedure/plan/turns.hpp"
#include "firmware/procedure/plan/wording.hpp"
#include "protocol/units/angle.hpp"

namespace probebox::procedure {

namespace {

std::string spindleOf(const Step& step) {
  return step.touch.tool == 0 ? "the probe" : "tool " + std::to_string(step.touch.tool);
}

// The edges of the way in count as well.
const char* motionOf(const Step& step) {
  if (step.touch.by_edges) return "in, pause, and back at ";
  return step.kind == Kind::in_out ? "in and back without a pause at " : "retract at ";
}

std::string approachOf(const Step& step) {
  const auto& u = step.touch.retract_direction;
  std::array<char, 80> text{};
  std::snprintf(text.data(), text.size(), ", approaching along (%.3f, %.3f, %.3f)", -u[0], -u[1], -u[2]);
  return text.data();
}

std::string ofAll(const Plan& plan, std::size_t step) {
  return std::to_string(step + 1) + " of " + std::to_string(plan.step_count) + ": ";
}

char axisOf(const capture::TouchRequest& touch) {
  return "XYZ"[axisAlong(touch.outward_normal)];
}

std::string jogPrompt(const Plan& plan, std::size_t step) {
  const auto& jog = plan.steps[step].touch;
  const char axis = axisOf(jog);
  return "step " + ofAll(plan, step) + "with free space around the probe, jog " + axis + " alone by +" +
         number(jog.travel_mm) + " mm on the control's display";
}

std::string sweepPrompt(const Plan& plan, std::size_t step) {
  const auto& sweep = plan.steps[step].touch;
  const char axis = axisOf(sweep);
  return "step " + ofAll(plan, step) + "when the temperature of the screw of " + axis +
         " is stable and its travel is clear, move " + axis + " alone by +" + number(sweep.travel_mm) + " mm at " +
         number(sweep.retract_speed_mm_s) + " mm/s without stopping";
}

std::string restPrompt(const Plan& plan, std::size_t step) {
  const auto& rest = plan.steps[step].touch;
  return "step " + ofAll(plan, step) + "with the screw of " + axisOf(rest) +
         " cold (the machine has stood since the temperature of its room was reached), stand still for " +
         number(rest.rest_s) + " s";
}

// The remedy of a run that cannot tell lost motion from the delay.
std::string ofOneSpeed(const Plan& plan) {
  const double speed_mm_s = plan.steps[0].touch.retract_speed_mm_s;
  const auto is_as_fast = [&](const Step& step) { return step.touch.retract_speed_mm_s == speed_mm_s; };
  if (plan.method->closes == 0 || &plan.method->poses != &kAtZero ||
      !std::ranges::all_of(std::span{plan.steps}.first(plan.step_count), is_as_fast))
    return {};
  return "; at one speed 1 um of lost motion is " + number(1e3 / (2 * speed_mm_s)) +
         " us of delay: a second speed parts them";
}

}  // namespace

std::string anglesOf(const Step& step) {
  const auto& [a_rad, b_rad, c_rad] = step.touch.rotary_angles_rad;
  const std::string a = number(degrees(a_rad)), c = " and C at " + number(degrees(c_rad)) + " deg";
  if (step.b_moves != BMoves::nothing) return "A at " + a + c;
  if (a_rad == 0 && b_rad == 0 && c_rad == 0) return "A, B and C at 0 deg";
  return "A at " + a + ", B at " + number(degrees(b_rad)) + c;
}

std::string surfaceOf(const Step& step) {
  const auto& n = step.touch.outward_normal;
  std::array<char, 80> along{};
  std::snprintf(along.data(), along.size(), "(%.3f, %.3f, %.3f)", n[0], n[1], n[2]);
  std::string side = along.data();
  for (const Side& known : kSixSides) {
    if (known.outward_normal == step.touch.outward_normal) side = known.name;
  }
  switch (step.feature) {
    case Feature::datum_sphere:
      return side + " side of the sphere";
    case Feature::plates:
      return std::string{"the face of the gap across "} + axisOf(step.touch) + " whose normal points to " + side;
    case Feature::cylinder:
      return "the datum cylinder where its normal points to " + side;
    case Feature::cube:
      return side + " face of the datum cube";
    case Feature::part_ball:
      return side + " side of ball " + std::to_string(step.touch.ball);
    case Feature::second_part_ball:
      return side + " side of ball " + std::to_string(step.touch.ball) + " in the second chuck";
    case Feature::tool_setter:
      return side + " face of the tool-setting device";
  }
  return {};
}

std::string promptFor(const Plan& plan, std::size_t step) {
  if (step >= plan.step_count) return {};
  const Step& wanted = plan.steps[step];
  if (wanted.kind == Kind::jog) return jogPrompt(plan, step);
  if (wanted.kind == Kind::sweep) return sweepPrompt(plan, step);
  if (wanted.kind == Kind::scan) return "scan " + ofAll(plan, step) + anglesOf(wanted) + "; " + scanPrompt(wanted);
  if (wanted.kind == Kind::rest) return restPrompt(plan, step);
  if (wanted.kind == Kind::turn) return "step " + ofAll(plan, step) + turnPrompt(wanted);
  if (wanted.kind == Kind::hold) return "step " + ofAll(plan, step) + holdPrompt(wanted);
  if (plan.method->prompt != nullptr) return plan.method->prompt(plan, step);
  std::string text = "touch " + ofAll(plan, step);
  if (wanted.turns) {
    const auto& angles = wanted.touch.rotary_angles_rad;
    text += mountPrompt(wanted.touch, plan.method->clamps_further_out);
    if (wanted.touch.tool != 0 && wanted.feature != Feature::tool_setter)
      text += "tool " + std::to_string(wanted.touch.tool) + ", ";
    if (wanted.b_moves == BMoves::head) text += "the head at B " + number(degrees(angles[1])) + " deg, ";
    if (wanted.b_moves == BMoves::table) text += "the table at a tilt of " + number(degrees(angles[1])) + " deg, ";
    text += anglesOf(wanted) + "; ";
  }
  if (wanted.feature == Feature::tool_setter) text += "with " + spindleOf(wanted) + " in the spindle, ";
  text += surfaceOf(wanted);
  if (wanted.touch.shank_height_mm > 0)
    text += " with the shank, " + number(wanted.touch.shank_height_mm) + " mm above the centre of the stylus ball";
  if (wanted.touch.retract_direction != wanted.touch.outward_normal) text += approachOf(wanted);
  text += ", " + number(wanted.overtravel_mm) +
          (wanted.by_distance ? " mm nearer than the middle of the probe's range, " : " mm deep, ") + motionOf(wanted) +
          number(wanted.touch.retract_speed_mm_s) + " mm/s until " + number(wanted.run_out_mm) +
          " mm beyond the clearance of " + number(wanted.clearance_mm) + " mm";
  if (step == 0) text += ofOneSpeed(plan);
  return text;
}

}  // namespace probebox::procedure
