#include "firmware/procedure/methods/needs.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "firmware/metrology/dataset/conditions.hpp"
#include "firmware/procedure/plan/plan.hpp"
#include "firmware/procedure/plan/wording.hpp"
#include "protocol/units/tolerances.hpp"

namespace probebox::procedure {
namespace {

constexpr double kLeastWay_mm = 0.3;

}  // namespace

constinit const Fact kSphereDiameter{
    .place = "`[datum_sphere] diameter_mm`",
    .known = [](const Facts& facts) { return facts.sphere_diameter_mm.has_value(); },
    .missing =
        "the size of the sphere: give [datum_sphere] diameter_mm in machine.toml, or use delay-multi-speed, "
        "which finds it."};

constinit const Fact kTiltingTable{
    .place = "`[tilting_table]`",
    .known = [](const Facts& facts) { return facts.tilting_table.has_value(); },
    .missing = "a tilting table: give [tilting_table] axis and tilts_deg in machine.toml."};

constinit const Fact kSwivelHead{
    .place = "`[swivel_head]`",
    .known = [](const Facts& facts) { return facts.swivel_head.has_value(); },
    .missing = "a swivelling head: give [swivel_head] axis, angles_deg and pivot_mm in machine.toml."};

constinit const Fact kProbeLengths{
    .place = "`[probe_tools]`",
    .known = [](const Facts& facts) { return facts.probe_tools.span_mm() >= kLeastLengthSpan_mm; },
    .missing =
        "the probe in tools whose lengths differ by 10 mm or more: give [probe_tools] numbers in machine.toml, "
        "and [[tool]] with the length of each.",
    .shank_replaces = true};

constinit const Fact kSensorHead{
    .place = "`[sensor_head]`",
    .known = [](const Facts& facts) { return facts.sensor_head.has_value(); },
    .missing = "a sensor head: give [sensor_head] tool, range_mm and centre_offset_mm in machine.toml."};

constinit const Fact kTriggerProbe{
    .place = "probe.toml `[probe] kind = \"trigger\"`",
    .known = [](const Facts& facts) { return facts.trigger_probe.has_value(); },
    .missing =
        "a touch-trigger probe: give [probe] kind = \"trigger\" in probe.toml; a scanning probe has no pre-travel."};

void addStylusBall(metrology::Dataset& dataset, const Facts& facts) {
  const auto& sd = facts.sd_stylus_ball_diameter_mm;
  const std::string stated = sd ? "sd " + number(*sd) + " mm (k = 1)" : "sd not stated";
  dataset.config[std::string{metrology::kStylusBall}] =
      "diameter " + number(facts.stylus_ball_diameter_mm) + " mm, " + stated +
      (sd ? ", as stated in probe.toml" : ", " + std::string{metrology::kAssumedExact});
}

void addStylusBallSize(metrology::Dataset& dataset, const Facts& facts) {
  dataset.config["stylus_ball_diameter_mm"] = facts.stylus_ball_diameter_mm;
  if (const auto& sd = facts.sd_stylus_ball_diameter_mm) dataset.config["sd_stylus_ball_diameter_mm"] = *sd;
  addStylusBall(dataset, facts);
}

void addGaugeSize(metrology::Dataset& dataset, const std::string& key, const std::optional<KnownSize>& size,
                  const Facts& facts) {
  if (size) {
    dataset.config[key] = size->mm;
    if (size->sd_mm) dataset.config["sd_" + key] = *size->sd_mm;
  }
  addStylusBallSize(dataset, facts);
}

void addEffectiveDiameter(metrology::Dataset& dataset, const Facts& facts) {
  if (!facts.sphere_diameter_mm) return;
  dataset.config["effective_diameter_mm"] = *facts.sphere_diameter_mm + facts.stylus_ball_diameter_mm;
  if (const auto& sd = facts.sd_stylus_ball_diameter_mm; sd && *sd > 0)
    dataset.config["sd_stylus_ball_diameter_mm"] = *sd;
  if (const auto& sphere = facts.sphere_temperature) {
    if (const auto celsius = facts.temperature_c ? facts.temperature_c : sphere->celsius) {
      dataset.config["temperature_c"] = *celsius;
      dataset.config["expansion_per_k"] = sphere->expansion_per_k;
      if (sphere->sd_k > 0) dataset.config["sd_temperature_k"] = sphere->sd_k;
    }
  }
  if (const auto& sd = facts.sd_sphere_diameter_mm; sd && *sd > 0) dataset.config["sd_effective_diameter_mm"] = *sd;
}

void addSphereSize(metrology::Dataset& dataset, const Facts& facts) {
  if (!facts.sphere_diameter_mm) return;
  addEffectiveDiameter(dataset, facts);
  addStylusBall(dataset, facts);
  const auto& certificate = facts.sphere_certificate;
  if (!certificate) return;
  dataset.config["sphere_certificate"] = certificate->in_words;
  dataset.config["sphere_next_due"] = certificate->next_due;
}

Outcome<ProcedureOptions> withReach(ProcedureOptions options, const Facts& facts) {
  options.reach_mm = facts.sphereReach_mm().value_or(0);
  return options;
}

void takeB(ProcedureOptions& options, const BFacts& b) {
  options.b_count = static_cast<std::uint8_t>(b.count);
  options.b_angles_rad = b.angles_rad;
  options.b_axis = b.axis;
}

void takeTools(ProcedureOptions& options, const Facts& facts) {
  options.tool_count = static_cast<std::uint8_t>(facts.probe_tools.count);
  options.tools = facts.probe_tools.numbers;
}

std::optional<Error> whyTooNarrow(double gap_mm, double stylus_ball_mm, double clearance_mm) {
  const double beside_mm = clearance_mm + kRunOut_mm;
  if (gap_mm - stylus_ball_mm > beside_mm) return std::nullopt;
  std::string remedy = "use a wider gap or a smaller stylus ball";
  if (gap_mm - stylus_ball_mm > kLeastClearance_mm + kRunOut_mm)
    remedy += ", or choose less clearance (--clearance), below " + number(gap_mm - stylus_ball_mm - kRunOut_mm) + " mm";
  return Error{"A gap or bore of " + number(gap_mm) + " mm is too narrow for a stylus ball of " +
               number(stylus_ball_mm) + " mm: on its way out it goes " + number(beside_mm) +
               " mm off the surface (clearance " + number(clearance_mm) + ", run-out " + number(kRunOut_mm) +
               "), into the opposite side: " + remedy + "."};
}

std::optional<NotReady> whyUnknownTool(const ProcedureOptions& options, const Facts& facts) {
  if (options.tool == 0) return std::nullopt;  // whyNoTool() refuses it
  if (std::ranges::find(facts.tools, options.tool, &ToolFacts::number) != facts.tools.end()) return std::nullopt;
  std::string known;
  for (const auto& each : facts.tools) known += (known.empty() ? "" : ", ") + std::to_string(each.number);
  return NotReady{Obstacle::option, "machine.toml has no [[tool]] with number " + std::to_string(options.tool) +
                                        (known.empty() ? ": add it." : ": add it, or measure one of " + known + ".")};
}

std::optional<Error> whyNoTool(const ProcedureOptions& options) {
  if (options.tool == 0) return Error{"The tool to measure is missing: give its number (--tool)."};
  if (auto error = outside("An overtravel", options.overtravel_mm, kLeastWay_mm, 100, "mm")) return error;
  return outside("A clearance", options.clearance_mm, kLeastWay_mm, 10, "mm");
}

}  // namespace probebox::procedure
