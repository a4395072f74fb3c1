#include "firmware/app/wiring/corrections_config.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace probebox::app {
namespace {

Nanoseconds nanoseconds(double seconds) {
  return Nanoseconds{std::llround(seconds * 1e9)};
}

corrections::ReferenceConfig referenceOf(const board::AxisDescription& axis) {
  const auto& reference = axis.reference;
  const auto by = reference.by == board::ReferenceBy::absolute ? corrections::ReferenceBy::absolute
                  : reference.by == board::ReferenceBy::index  ? corrections::ReferenceBy::index
                                                               : corrections::ReferenceBy::homing;
  return {.by = by,
          .mm_per_count = axis.sense / axis.counts_per_mm,
          .has_mark = reference.has_index,
          .index_mm = reference.index_mm,
          .index_width_mm = reference.index_width_mm,
          .index_pitch_mm = reference.index_pitch_mm,
          .index_tolerance_mm = reference.index_tolerance_mm,
          .maximum_speed_mm_s = reference.maximum_speed_mm_s,
          .travel = {axis.travel_min_mm, axis.travel_max_mm}};
}

corrections::ScrewConfig screwOf(const board::ScrewDescription& screw) {
  corrections::ScrewConfig config;
  config.fitted = true;
  static_cast<BallScrew&>(config.model) = screw;
  config.model.gain = screw.gain_is == board::GainIs::correction ? screw.gain : -screw.gain;
  config.model.reference_um = screw.reference_um;
  config.model.threshold_rpm = screw.threshold_rpm;
  config.limits = {.least_extension_um = screw.extension_min_um,
                   .greatest_extension_um = screw.extension_max_um,
                   .rate_um_s = screw.rate_um_s};
  config.angle_zero_mm = screw.sector_zero_mm;
  config.stale = nanoseconds(screw.stale_s);
  config.hold = nanoseconds(screw.hold_s);
  return config;
}

corrections::RotaryAngleConfig angleOf(const board::RotaryAxisDescription& axis) {
  corrections::RotaryAngleConfig config{.described = true,
                                        .from = corrections::AngleFrom::controller,
                                        .reference = {},
                                        .stale = nanoseconds(axis.stale_s)};
  if (axis.angle_from == board::AngleFrom::controller) return config;
  config.from = corrections::AngleFrom::encoder;
  config.reference.by = axis.reference == board::ReferenceBy::absolute ? corrections::ReferenceBy::absolute
                                                                       : corrections::ReferenceBy::homing;
  config.reference.mm_per_count = axis.sense / axis.counts_per_deg;
  config.reference.maximum_speed_mm_s = axis.maximum_speed_deg_s;
  return config;
}

corrections::RotaryConfig tableOf(const board::RotaryTableDescription& table) {
  corrections::RotaryConfig config{.count = table.chain.size(),
                                   .chain = {},
                                   .between = {},
                                   .at_tip = table.at_tip,
                                   .tool_direction = table.tool_direction,
                                   .measured_length_mm = table.measured_length_mm,
                                   .hold = nanoseconds(table.hold_s)};
  std::ranges::transform(table.between_of, config.between.begin(), [](board::BetweenAngles between) {
    return between == board::BetweenAngles::fourier ? metrology::Between::fourier : metrology::Between::linear;
  });
  std::ranges::transform(table.chain, config.chain.begin(),
                         [](board::RotaryLetter letter) { return static_cast<RotaryAxis>(letter); });
  return config;
}

void addRotary(const board::Machine& machine, corrections::CorrectionsConfig& config) {
  for (std::size_t axis = 0; axis < kRotaryAxes; ++axis) {
    if (machine.rotary_axes[axis]) config.angles[axis] = angleOf(*machine.rotary_axes[axis]);
  }
  if (machine.rotary_table) config.rotary = tableOf(*machine.rotary_table);
  if (const auto& swivel = machine.swivel)
    config.swivel = {.fitted = true,
                     .axis = static_cast<RotaryAxis>(swivel->axis),
                     .by_angle = swivel->by_angle,
                     .hold = nanoseconds(swivel->hold_s)};
  static_assert(board::kMostTools <= std::tuple_size_v<decltype(config.tools.lengths)>);
  for (const auto& tool : machine.tools)
    config.tools.lengths[config.tools.count++] = {.number = tool.number, .length_mm = tool.length_mm};
}

}  // namespace

corrections::CorrectionsConfig correctionsConfig(const board::Machine& machine) {
  corrections::CorrectionsConfig config;
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis) {
    const auto& described = machine.axes[axis];
    config.references[axis] = referenceOf(described);
    config.limits[axis] = {.size_mm = described.correction_limit_mm, .rate_mm_s = described.correction_rate_mm_s};
    if (machine.screws[axis]) config.screws[axis] = screwOf(*machine.screws[axis]);
  }
  const auto& centreline = machine.centreline;
  config.centreline = {.assumed_mm = {centreline.assumed_x_mm, centreline.assumed_y_mm},
                       .corrected = {centreline.correct_x, centreline.correct_y},
                       .hold = nanoseconds(centreline.hold_s)};
  addRotary(machine, config);
  config.mask = machine.corrections.mask;
  return config;
}

}  // namespace probebox::app
