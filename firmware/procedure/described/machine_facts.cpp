#include "firmware/procedure/described/machine_facts.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "protocol/units/angle.hpp"

namespace probebox::procedure {
namespace {

std::array<std::optional<ScrewFacts>, kLinearAxes> screwFacts(const board::Machine& machine) {
  std::array<std::optional<ScrewFacts>, kLinearAxes> all;
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis) {
    const auto& screw = machine.screws[axis];
    if (!screw) continue;
    auto& facts = all[axis].emplace(ScrewFacts{*screw});
    facts.gain = screw->gain_is == board::GainIs::error ? screw->gain : -screw->gain;
    facts.sector_zero_mm = screw->sector_zero_mm;
    facts.threshold_rpm = screw->threshold_rpm;
    facts.travel_min_mm = machine.axes[axis].travel_min_mm;
    facts.travel_max_mm = machine.axes[axis].travel_max_mm;
  }
  return all;
}

BFacts bFacts(const board::TiltDescription& tilt) {
  static_assert(board::kMostTilts <= kMostBAngles);
  BFacts facts{.axis = tilt.axis,
               .count = tilt.angles_deg.size(),
               .angles_rad = {},
               .sigma_rad = tilt.sigma_rad,
               .point_mm = tilt.point_mm};
  std::ranges::transform(tilt.angles_deg, facts.angles_rad.begin(),
                         [](double angle_deg) { return radians(angle_deg); });
  return facts;
}

std::vector<double> inRadians(std::vector<double> angles_deg) {
  for (double& angle : angles_deg) angle = radians(angle);
  return angles_deg;
}

std::optional<HeadFacts> headFacts(const board::Machine& machine) {
  const auto& head = machine.swivel_head;
  if (!head) return std::nullopt;
  return HeadFacts{
      .b = bFacts(head->swivel), .pivot_mm = head->pivot_mm, .ball_mm = head->ball_mm, .sd_ball_mm = head->sd_ball_mm};
}

ProbeTools probeTools(const board::Machine& machine) {
  static_assert(board::kMostProbeTools <= kMostProbeTools);
  ProbeTools tools;
  for (const auto& tool : machine.probe_tools) {
    tools.numbers.at(tools.count) = tool.number;
    tools.lengths_mm.at(tools.count) = tool.length_mm;
    tools.sds_mm.at(tools.count) = tool.sd_mm;
    ++tools.count;
  }
  return tools;
}

std::optional<RimBall> rimBall(const board::Machine& machine) {
  const auto& ball = machine.rim_ball;
  if (!ball) return std::nullopt;
  const auto& c = machine.rotary_axes[static_cast<std::size_t>(RotaryAxis::c)];
  return RimBall{.c_on_line_rad = radians(ball->c_deg),
                 .level_limit_mm = ball->level_limit_mm,
                 .beside_mm = ball->beside_mm,
                 .radius_mm = ball->radius_mm,
                 .c_has_encoder = c && c->angle_from == board::AngleFrom::encoder};
}

std::optional<ProbeShank> probeShank(const board::Machine& machine) {
  const auto& shank = machine.probe_shank;
  if (!shank) return std::nullopt;
  const auto tool = std::ranges::find(machine.tools, shank->tool, &board::ToolDescription::number);
  if (tool == machine.tools.end()) return std::nullopt;  // the description would have been refused
  return ProbeShank{.tool = shank->tool,
                    .tip_length_mm = tool->length_mm,
                    .sd_tip_length_mm = tool->sd_mm,
                    .radius_mm = shank->radius_mm,
                    .height_mm = shank->height_mm,
                    .from_mm = shank->from_mm};
}

std::optional<AcceptedValue> accepted(std::optional<double> value_mm) {
  return value_mm ? std::optional{AcceptedValue{.mm = *value_mm}} : std::nullopt;
}

std::optional<CheckedBall> checkedBall(const board::Machine& machine) {
  const auto& check = machine.periodic_check;
  if (!check) return std::nullopt;
  return CheckedBall{.diameter_mm = check->ball_diameter_mm,
                     .sd_diameter_mm = check->sd_ball_diameter_mm.value_or(0),
                     .centre_z = {.mm = check->ball_centre_z_mm},
                     .accepted_x = accepted(check->accepted_x_mm),
                     .accepted_y = accepted(check->accepted_y_mm),
                     .limit_mm = check->limit_mm,
                     .swivels_rad = inRadians(check->swivels_deg)};
}

std::optional<BallPlate> ballPlate(const board::Machine& machine) {
  const auto& plate = machine.ball_plate;
  if (!plate) return std::nullopt;
  return BallPlate{.axis_point_mm = plate->axis_point_mm,
                   .sd_mm = plate->sd_mm,
                   .ball_diameter_mm = plate->ball_diameter_mm,
                   .b_axis_point_mm = plate->b_axis_point_mm,
                   .station_correction = plate->station_correction,
                   .balls_mm = plate->balls_mm,
                   .mount_turns_rad = inRadians(plate->mount_turns_deg)};
}

std::array<bool, kRotaryAxes> byHarmonics(const board::Machine& machine) {
  std::array<bool, kRotaryAxes> by{};
  if (!machine.rotary_table) return by;
  for (const auto letter : machine.rotary_table->chain) {
    const auto axis = static_cast<std::size_t>(letter);
    by.at(axis) = machine.rotary_table->between_of.at(axis) == board::BetweenAngles::fourier;
  }
  return by;
}

std::optional<ToolSetter> toolSetter(const board::Machine& machine) {
  const auto& described = machine.tool_setter;
  if (!described) return std::nullopt;
  return ToolSetter{.half_width_mm = described->half_width_mm,
                    .sd_half_width_mm = described->sd_half_width_mm,
                    .probe_offset_mm = described->probe_offset_mm,
                    .sd_probe_offset_mm = described->sd_probe_offset_mm,
                    .accepted_mm = described->accepted_mm,
                    .limit_mm = described->limit_mm,
                    .sd_accepted_mm = described->sd_accepted_mm,
                    .swivels_rad = inRadians(described->swivels_deg)};
}

std::vector<ToolFacts> toolFacts(const board::Machine& machine) {
  std::vector<ToolFacts> tools;
  for (const auto& tool : machine.tools) {
    auto& facts = tools.emplace_back(ToolFacts{.number = tool.number,
                                               .length_mm = tool.length_mm,
                                               .sd_mm = tool.sd_mm,
                                               .holder = std::nullopt,
                                               .faces = tool.faces});
    for (const auto& [number, length_mm, sd_mm] : machine.holders)
      if (number == tool.holder) facts.holder = HolderFacts{number, length_mm, sd_mm};
  }
  return tools;
}

std::optional<SensorHead> sensorHead(const board::Machine& machine) {
  const auto& described = machine.sensor_head;
  if (!described) return std::nullopt;
  return SensorHead{.tool = described->tool,
                    .range_mm = described->range_mm,
                    .centre_offset_mm = described->centre_offset_mm,
                    .sd_centre_offset_mm = described->sd_centre_offset_mm.value_or(0)};
}

std::optional<TriggerProbe> triggerProbe(const board::Probe& probe) {
  if (!probe.by_switch) return std::nullopt;
  return TriggerProbe{.repeatability_mm = 1e-3 * probe.by_switch->repeatability_um};
}

std::optional<SphereCertificate> sphereCertificate(const board::Machine& machine) {
  const auto& certified = machine.datum_sphere_certificate;
  if (!certified) return std::nullopt;
  return SphereCertificate{.in_words = certified->inWords(), .next_due = certified->next_due};
}

// That of the certificate, where there is one.
std::optional<double> sdOfSphere_mm(const board::Machine& machine) {
  const auto& certified = machine.datum_sphere_certificate;
  return certified ? std::optional{certified->sd_mm()} : machine.datum_sphere_sd_mm;
}

std::optional<SphereTemperature> sphereTemperature(const board::Machine& machine) {
  const auto& stated = machine.datum_sphere_temperature;
  if (!stated) return std::nullopt;
  return SphereTemperature{
      .celsius = stated->celsius, .sd_k = stated->sd_k, .expansion_per_k = stated->expansion_per_k};
}

std::array<std::optional<KnownSize>, kLinearAxes> gaps(const board::Machine& machine) {
  std::array<std::optional<KnownSize>, kLinearAxes> all;
  for (std::size_t axis = 0; axis < all.size(); ++axis) {
    if (const auto& plates = machine.datum_plates.at(axis)) all.at(axis) = {plates->gap_mm, plates->sd_gap_mm};
  }
  return all;
}

std::optional<DatumCylinder> datumCylinder(const board::Machine& machine) {
  const auto& described = machine.datum_cylinder;
  if (!described) return std::nullopt;
  return DatumCylinder{.diameter = {described->diameter_mm, described->sd_diameter_mm},
                       .inside = described->touched == board::CylinderDescription::Touched::inside};
}

std::optional<DatumCube> datumCube(const board::Machine& machine) {
  const auto& described = machine.datum_cube;
  if (!described) return std::nullopt;
  return DatumCube{.edges_mm = described->edges_mm, .sd_edge_mm = described->sd_edge_mm};
}

std::vector<Requirement> requirements(const board::Machine& machine) {
  std::vector<Requirement> all;
  for (const auto& one : machine.requirements) all.push_back({one.subject, one.limit_um, one.limit_us, one.limit_urad});
  return all;
}

}  // namespace

Facts factsOf(const board::Machine& machine) {
  return {.has_y = machine.has_y,
          .has_second_spindle = machine.has_second_spindle,
          .sphere_diameter_mm = machine.datum_sphere_diameter_mm,
          .sd_sphere_diameter_mm = sdOfSphere_mm(machine),
          .sphere_certificate = sphereCertificate(machine),
          .sphere_temperature = sphereTemperature(machine),
          .gaps = gaps(machine),
          .datum_cylinder = datumCylinder(machine),
          .datum_cube = datumCube(machine),
          .sigma_c_rad = machine.sigma_c_rad,
          .accuracy = machine.accuracy,
          .screws = screwFacts(machine),
          .checked_ball = checkedBall(machine),
          .rim_ball = rimBall(machine),
          .ball_plate = ballPlate(machine),
          .by_harmonics = byHarmonics(machine),
          .tilting_table = machine.tilting_table ? std::optional{bFacts(*machine.tilting_table)} : std::nullopt,
          .swivel_head = headFacts(machine),
          .probe_tools = probeTools(machine),
          .probe_shank = probeShank(machine),
          .tool_setter = toolSetter(machine),
          .tools = toolFacts(machine),
          .sensor_head = sensorHead(machine),
          .requirements = requirements(machine)};
}

Facts factsOf(const board::Descriptions& descriptions) {
  const auto& probe = descriptions.probe;
  auto facts = factsOf(descriptions.machine);
  facts.stylus_ball_diameter_mm = probe.ball_diameter_mm;
  facts.sd_stylus_ball_diameter_mm = probe.sd_ball_diameter_mm;
  facts.gain = probe.gain;
  facts.trigger_probe = triggerProbe(probe);
  if (const auto& distance = probe.by_distance)
    facts.distance_probe = DistanceProbe{.stand_off_mm = distance->stand_off_mm, .range_mm = distance->range_mm};
  return facts;
}

}  // namespace probebox::procedure
