#include "firmware/procedure/plan/readiness.hpp"

#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "firmware/procedure/plan/plan.hpp"
#include "firmware/procedure/plan/ways.hpp"
#include "firmware/procedure/plan/wording.hpp"

namespace probebox::procedure {
namespace {

constexpr const char* kNoShank =
    " with the shank needs its description: give [probe_shank] tool, radius_mm, from_mm, to_mm and height_mm in "
    "machine.toml, and the length of that [[tool]].";

constexpr const char* kNoSensorHead =
    " with a sensor head needs a sensor head: give [sensor_head] tool, range_mm and centre_offset_mm in machine.toml.";

constexpr double kLeastWay_mm = 0.3;  // for lines through the positions about an edge

// The tools whose stylus balls read; 0 where the method names none.
std::vector<std::uint32_t> tipsOf(const LiveMethod& method, const Facts& facts, ReadBy by) {
  if (method.usual.tool_count == 0) return {0};
  if (by == ReadBy::shank)
    return facts.probe_shank ? std::vector{facts.probe_shank->tool} : std::vector<std::uint32_t>{};
  const auto& tools = facts.probe_tools;
  return {tools.numbers.begin(), tools.numbers.begin() + tools.count};
}

// Why a touch-trigger probe cannot make the run; nothing where it can. It needs no delay: in and out cancel it.
std::optional<NotReady> whyNoTrigger(const LiveMethod& method, const Facts& facts, ReadBy by) {
  const std::string name{method.name()};
  const ByTrigger runs = byTrigger(method, by);
  if (runs == ByTrigger::refused && !method.why_no_trigger.empty())
    return NotReady{Obstacle::option, name + " " + std::string{method.why_no_trigger}};
  if (runs == ByTrigger::refused)
    return NotReady{
        Obstacle::option,
        name +
            " with a sensor head reads samples of its sensors while it stands beside the ball, and a box with a "
            "touch-trigger probe has no channels for them: " +
            (method.kind == Kind::touch ? "omit --head, and the same balls are touched with the touch-trigger "
                                          "probe; or describe"
                                        : "describe") +
            " the probe as kind = \"scanning\" in probe.toml, and connect the head in its place."};
  if (runs == ByTrigger::as_it_is) return std::nullopt;
  for (const std::uint32_t tool : tipsOf(method, facts, by)) {
    if (facts.preTravelOf(tool) != nullptr) continue;
    const std::string number = std::to_string(tool);
    return NotReady{Obstacle::state, name + " needs the pre-travel of the touch-trigger probe" +
                                         (tool == 0 ? "" : " in tool " + number) +
                                         ", and none is in force: calibrate it first (" + preTravelCommand(tool) +
                                         ") and accept it."};
  }
  return std::nullopt;
}

// Why a probe that does not touch cannot make the run; nothing where it can, or where none is used.
std::optional<NotReady> whyNoContact(const LiveMethod& method, const Facts& facts, ReadBy by) {
  const bool uses_probe = !method.of_screw && method.kind != Kind::hold && by != ReadBy::head;
  if (!facts.distance_probe || !uses_probe || method.by_distance) return std::nullopt;
  return NotReady{Obstacle::option,
                  std::string{method.name()} +
                      " touches, and the probe of probe.toml (kind = \"distance\") does not: delay-in-out measures its "
                      "delay; for other methods describe a probe that touches."};
}

std::optional<Error> whyTooShort(const ProcedureOptions& asked) {
  if (asked.overtravel_mm != 0) {
    if (auto error = outside("An overtravel with a touch-trigger probe", asked.overtravel_mm, kLeastWay_mm, 100, "mm"))
      return error;
  }
  if (asked.clearance_mm == 0) return std::nullopt;
  return outside("A clearance with a touch-trigger probe", asked.clearance_mm, kLeastWay_mm, 10, "mm");
}

// Options that no plan can be made of are refused elsewhere.
std::optional<NotReady> whyNoWay(const LiveMethod& method, const ProcedureOptions& options, const Facts& facts) {
  if (!method.of_plate || validate(method, options, std::numeric_limits<double>::infinity())) return std::nullopt;
  const auto plan = std::make_unique<Plan>();
  fill(*plan, method, options);
  const auto error = whyThroughBall(*plan, facts);
  return error ? std::optional{NotReady{Obstacle::way, error->what}} : std::nullopt;
}

}  // namespace

std::optional<NotReady> whyNoY(const LiveMethod& method, const ProcedureOptions& asked, const Facts& facts) {
  if (facts.has_y) return std::nullopt;
  const std::string name{method.name()};
  if (!method.why_no_y.empty()) return NotReady{Obstacle::option, name + " " + std::string{method.why_no_y}};
  constexpr std::uint8_t kAxisY = 2;
  if (method.takes_axis && asked.axis == kAxisY)
    return NotReady{Obstacle::option, name + " is about one axis, and this machine has no Y: give --axis X or Z."};
  return std::nullopt;
}

ByTrigger byTrigger(const LiveMethod& method, ReadBy by) {
  if (!method.why_no_trigger.empty() || by == ReadBy::head || method.kind == Kind::hold) return ByTrigger::refused;
  const bool reads_by_probe = method.kind == Kind::touch && method.feature != Feature::tool_setter;
  return method.finds_a_place && reads_by_probe && !method.cancels_pre_travel ? ByTrigger::with_pre_travel
                                                                              : ByTrigger::as_it_is;
}

ReadBy readBy(const ProcedureOptions& asked) {
  if (asked.head) return ReadBy::head;
  return asked.shank ? ReadBy::shank : ReadBy::tip;
}

Outcome<ProcedureOptions, NotReady> readied(const LiveMethod& method, const ProcedureOptions& asked, const Facts& facts,
                                            const MachineNow& now) {
  if (facts.trigger_probe) {
    // Before anything that would have to be described or calibrated for it in vain.
    if (byTrigger(method, readBy(asked)) == ByTrigger::refused) return *whyNoTrigger(method, facts, readBy(asked));
    if (const auto error = whyTooShort(asked)) return NotReady{Obstacle::option, error->what};
  }
  if (const auto why = whyNoContact(method, facts, readBy(asked))) return *why;
  if (const auto why = whyNoY(method, asked, facts)) return *why;
  if (asked.head) {
    if (const auto why = whyNoHead(method, facts)) return *why;
  }
  if (asked.shank) {
    if (const auto why = whyNoShank(method, facts)) return *why;
  }
  if (asked.spindle > 1 && method.takesSpindle() && !facts.has_second_spindle)
    return NotReady{Obstacle::option, std::string{method.name()} +
                                          " about the second chuck needs one: give [machine] second_spindle = true in "
                                          "machine.toml, or omit that option for the main one."};
  if (asked.contacts && !method.takes_contacts)
    return NotReady{Obstacle::option,
                    std::string{method.name()} + " takes no contacts by turning C: omit that option."};
  if (asked.turns != 0 && !method.takes_turns) {
    const char* all = method.of_screw ? " takes no turns of the screw: omit that option."
                                      : " has no options axis and turns: omit them.";
    return NotReady{Obstacle::option, std::string{method.name()} + all};
  }
  if (method.isAboutB(asked)) {
    for (const Fact* fact : method.needs_about_b) {
      if (fact->known(facts)) continue;
      return NotReady{Obstacle::option, std::string{method.name()} + " about B needs " + std::string{fact->missing}};
    }
  }
  if (method.why_unfit != nullptr) {
    if (const auto unfit = method.why_unfit(asked, facts)) return *unfit;
  }
  const auto options = described(method, asked, facts, readBy(asked));
  if (!options) return NotReady{Obstacle::option, options.error().what};
  if (method.why_not_now != nullptr) {
    if (const auto error = method.why_not_now(*options, now, facts)) return NotReady{Obstacle::state, error->what};
  }
  if (auto why = whyNoWay(method, *options, facts)) return *why;
  return *options;
}

std::optional<NotReady> whyUnready(const LiveMethod& method, const Facts& facts, bool delay_in_force, ReadBy by) {
  const std::string name{method.name()};
  if (auto why = whyNoContact(method, facts, by)) return why;
  if (auto why = whyNoY(method, {}, facts)) return why;
  if (facts.trigger_probe) {
    if (auto why = whyNoTrigger(method, facts, by)) return why;
  }
  for (const Fact* fact : method.needs) {
    const bool replaced = fact->shank_replaces && by == ReadBy::shank;
    if (fact->known == nullptr || replaced || fact->known(facts)) continue;
    return NotReady{Obstacle::option, name + " needs " + std::string{fact->missing}};
  }
  if (!method.finds_a_place || delay_in_force || by == ReadBy::head || facts.trigger_probe) return std::nullopt;
  return NotReady{Obstacle::state,
                  name +
                      " needs the system delay, and none is in force: calibrate it first (probebox calibrate "
                      "delay-multi-speed) and accept it."};
}

std::optional<NotReady> whyNoHead(const LiveMethod& method, const Facts& facts) {
  const std::string name{method.name()};
  if (!method.takesHead()) return NotReady{Obstacle::option, name + " does not use a sensor head: omit that option."};
  if (!facts.sensor_head) return NotReady{Obstacle::option, name + kNoSensorHead};
  if (method.kind == Kind::hold || facts.sensor_head->calibrated) return std::nullopt;
  return NotReady{Obstacle::state,
                  name +
                      " with a sensor head needs the calibration of the head, and none is in force: calibrate it first "
                      "(probebox calibrate sensor-head-calibration) and accept it."};
}

std::optional<NotReady> whyNoShank(const LiveMethod& method, const Facts& facts) {
  const std::string name{method.name()};
  if (!method.takesShank()) return NotReady{Obstacle::option, name + " does not use a shank: omit that option."};
  if (!facts.probe_shank) return NotReady{Obstacle::option, name + kNoShank};
  // Lower down the stylus' ball would come to the ball as well.
  const bool of_part = method.feature == Feature::part_ball;
  const double ball_mm =
      of_part ? (facts.checked_ball ? facts.checked_ball->diameter_mm : 0) : facts.sphere_diameter_mm.value_or(0);
  const double least_mm = (ball_mm + facts.stylus_ball_diameter_mm) / 2;
  if (facts.probe_shank->height_mm > least_mm) return std::nullopt;
  return NotReady{Obstacle::option,
                  name + " with the shank: " + number(facts.probe_shank->height_mm) +
                      " mm above its ball the stylus ball would touch as well: choose [probe_shank] height_mm above " +
                      number(least_mm) + " in machine.toml."};
}

Outcome<ProcedureOptions> described(const LiveMethod& method, const ProcedureOptions& asked, const Facts& facts,
                                    ReadBy by) {
  ProcedureOptions options = asked;
  options.head = options.shank = false;
  if ((by == ReadBy::head || method.kind == Kind::hold) && facts.sensor_head) {
    options.head_tool = facts.sensor_head->tool;
    options.head_range_mm = facts.sensor_head->range_mm;
  }
  if (method.described != nullptr) {
    TRY(const auto completed, method.described(options, facts));
    options = completed;
  }
  options.contacts = false;
  if (!facts.has_y) {
    options.faces = (options.faces != 0 ? options.faces : kFacesAcrossY) & kFacesAcrossY;
    if (options.faces == 0)
      return Error{"Tool " + std::to_string(options.tool) +
                   " reaches faces along Y alone, and this machine has no Y: correct faces of its [[tool]] in "
                   "machine.toml."};
  }
  if (by == ReadBy::shank && facts.probe_shank) {
    options.tool_count = 2;
    options.tools = {facts.probe_shank->tool, facts.probe_shank->tool};
    options.shank_height_mm = facts.probe_shank->height_mm;
  }
  return options;
}

}  // namespace probebox::procedure
