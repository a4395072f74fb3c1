#include "firmware/procedure/facts/readiness.hpp"

#include <algorithm>
#include <string>

#include "firmware/procedure/plan/methods.hpp"
#include "firmware/procedure/plan/wording.hpp"

namespace probebox::procedure {

namespace {

constexpr const char* kNoShank =
    " with the shank needs its description: give [probe_shank] tool, radius_mm, from_mm, to_mm and height_mm in "
    "machine.toml, and the length of that [[tool]].";

constexpr const char* kNoSensorHead =
    " needs a sensor head: give [sensor_head] tool, range_mm and centre_offset_mm in machine.toml.";

constexpr const char* kNoLengths =
    " needs the probe in tools whose lengths differ by 10 mm or more: give [probe_tools] numbers in machine.toml, and "
    "[[tool]] with the length of each.";

// As the solvers want them.
constexpr double kLeastLengths_mm = 10;

constexpr const char* kNoHead =
    " needs a swivelling head: give [swivel_head] axis, angles_deg and pivot_mm in machine.toml.";

const char* missingOfTheHead(Needs needs, const Facts& facts, ReadBy by) {
  const bool swivels = needs == Needs::swivel_head || needs == Needs::swivel_lengths;
  if (swivels && !facts.swivel_head) return kNoHead;
  if (needs == Needs::swivel_head) {
    return facts.swivel_head->ball_mm ? nullptr
                                      : " needs the position of the datum sphere: give [swivel_head] ball_mm in "
                                        "machine.toml, relative to the reference from which the pivot is wanted.";
  }
  return by != ReadBy::shank && facts.probe_tools.span_mm() < kLeastLengths_mm ? kNoLengths : nullptr;
}

// What has to be described and is not, and where; nullptr when nothing is missing.
const char* missingFact(Needs needs, const Facts& facts, ReadBy by) {
  switch (needs) {
    case Needs::nothing:
    case Needs::screw:  // sweepOptions() has asked
    case Needs::delay_in_force:
      return nullptr;
    case Needs::sphere_diameter:
      return facts.sphere_diameter_mm ? nullptr
                                      : " needs the size of the sphere: give [datum_sphere] diameter_mm in "
                                        "machine.toml, or use delay-multi-speed, which finds it.";
    case Needs::plates_gap:
      return facts.gap_mm ? nullptr
                          : " needs the distance between the plates: give [datum_plates] gap_mm in machine.toml.";
    case Needs::checked_ball:
      return facts.checked_ball ? nullptr
                                : " needs a description of the ball: give [periodic_check] ball_diameter_mm and "
                                  "ball_centre_z_mm in machine.toml.";
    case Needs::rim_ball:
      return facts.rim_ball ? nullptr
                            : " needs the angle of C at which the ball is above the axis, along +Y: give [rim_ball] "
                              "c_deg in machine.toml.";
    case Needs::ball_plate:
      return facts.ball_plate
                 ? nullptr
                 : " needs the certified positions of the balls: give [ball_plate] and its balls in machine.toml.";
    case Needs::tilting_table:
      return facts.tilting_table ? nullptr
                                 : " needs a tilting table: give [tilting_table] axis and tilts_deg in machine.toml.";
    case Needs::swivel_lengths:
    case Needs::swivel_head:
    case Needs::probe_lengths:
      return missingOfTheHead(needs, facts, by);
    case Needs::tool_setter:
      return facts.tool_setter ? nullptr
                               : " needs a tool-setting device: give [tool_setter] in machine.toml, and its line as a "
                                 "[[trigger]] in box.toml.";
    case Needs::measuring_unit:
      return facts.tool_setter && facts.tool_setter->accepted_mm
                 ? nullptr
                 : " needs a tool-setting device at a known position: give [tool_setter] with accepted_mm in "
                   "machine.toml; tool-setter finds it (setter_mm of its result).";
    case Needs::sensor_head:
      return facts.sensor_head ? nullptr : kNoSensorHead;
  }
  return nullptr;
}

}  // namespace

std::optional<Error> whyUnready(Method method, const Facts& facts, bool delay_in_force, ReadBy by) {
  const std::string name{nameOf(method)};
  if (const char* missing = missingFact(needsOf(method), facts, by)) return Error{name + missing};
  if (!findsAPlace(method) || delay_in_force || by == ReadBy::head) return std::nullopt;
  return Error{name +
               " needs the system delay, and none is in force: calibrate it first (probebox calibrate "
               "delay-multi-speed) and accept it."};
}

std::optional<Error> whyNoHead(Method method, const Facts& facts) {
  const std::string name{nameOf(method)};
  if (!canReadByHead(method)) return Error{name + " does not use a sensor head: omit that option."};
  if (!facts.sensor_head) return Error{name + " with a sensor head" + kNoSensorHead};
  if (needsHead(method) || facts.sensor_head->calibrated) return std::nullopt;
  return Error{name +
               " with a sensor head needs the calibration of the head, and none is in force: calibrate it first "
               "(probebox calibrate sensor-head-calibration) and accept it."};
}

std::optional<Error> whyNoShank(Method method, const Facts& facts) {
  const std::string name{nameOf(method)};
  if (!canTouchByShank(method)) return Error{name + " does not use a shank: omit that option."};
  if (!facts.probe_shank) return Error{name + kNoShank};
  // Lower down the stylus' ball would come to the ball as well.
  const bool of_part = needsOf(method) == Needs::probe_lengths;
  const double ball_mm =
      of_part ? (facts.checked_ball ? facts.checked_ball->diameter_mm : 0) : facts.sphere_diameter_mm.value_or(0);
  const double least_mm = (ball_mm + facts.stylus_ball_diameter_mm) / 2;
  if (facts.probe_shank->height_mm > least_mm) return std::nullopt;
  return Error{name + " with the shank: " + number(facts.probe_shank->height_mm) +
               " mm above its ball the stylus ball would touch as well: choose [probe_shank] height_mm above " +
               number(least_mm) + " in machine.toml."};
}

std::optional<Error> whyNoSuchBall(Method method, const ProcedureOptions& options, const Facts& facts) {
  if (needsOf(method) != Needs::ball_plate || !facts.ball_plate) return std::nullopt;
  const std::size_t known = facts.ball_plate->balls_mm.size();
  if (options.balls <= known) return std::nullopt;
  return Error{"[ball_plate] of machine.toml has " + std::to_string(known) + " balls, but " +
               std::to_string(options.balls) + " are to be measured: describe the others, or measure fewer."};
}

ProcedureOptions described(Method method, ProcedureOptions options, const Facts& facts, ReadBy by) {
  const Needs needs = needsOf(method);
  if ((by == ReadBy::head || needsHead(method)) && facts.sensor_head) {
    options.head_tool = facts.sensor_head->tool;
    options.head_range_mm = facts.sensor_head->range_mm;
  }
  const auto take = [&options](const BFacts& b) {
    options.b_count = static_cast<std::uint8_t>(b.count);
    options.b_angles_rad = b.angles_rad;
    options.b_axis = b.axis;
  };
  if (needs == Needs::tilting_table && facts.tilting_table) take(*facts.tilting_table);
  const bool swivels = needs == Needs::swivel_head || needs == Needs::swivel_lengths;
  if (swivels && facts.swivel_head) take(facts.swivel_head->b);
  if (needs == Needs::rim_ball && facts.rim_ball) options.c_on_line_rad = facts.rim_ball->c_on_line_rad;
  if (by == ReadBy::shank && facts.probe_shank) {
    options.tool_count = 2;
    options.tools = {facts.probe_shank->tool, facts.probe_shank->tool};
    options.shank_height_mm = facts.probe_shank->height_mm;
  } else if (needs == Needs::swivel_lengths || needs == Needs::probe_lengths) {
    options.tool_count = static_cast<std::uint8_t>(facts.probe_tools.count);
    options.tools = facts.probe_tools.numbers;
  }
  return options;
}

std::optional<Error> whyUnknownTool(Method method, std::uint32_t tool, const Facts& facts) {
  if (!measuresATool(method) || tool == 0) return std::nullopt;  // that there is none is said elsewhere
  const auto found = std::ranges::find(facts.tools, tool, &ToolFacts::number);
  if (found == facts.tools.end()) {
    std::string known;
    for (const auto& each : facts.tools) known += (known.empty() ? "" : ", ") + std::to_string(each.number);
    return Error{"machine.toml has no [[tool]] with number " + std::to_string(tool) +
                 (known.empty() ? ": add it." : ": add it, or measure one of " + known + ".")};
  }
  if (needsOf(method) != Needs::measuring_unit || found->holder) return std::nullopt;
  return Error{"The holder of tool " + std::to_string(tool) +
               " is unknown: name it in its [[tool]] in machine.toml, and add a [[holder]] with its length."};
}

bool findsAPlace(Method method) {
  return readsBalls(method) || measuresATool(method);
}

}  // namespace probebox::procedure
