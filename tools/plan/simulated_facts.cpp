#include "tools/plan/simulated_facts.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>
#include <vector>

#include "firmware/procedure/methods/needs.hpp"
#include "protocol/units/angle.hpp"

namespace probebox::plan {
namespace {

constexpr double kReference_c = 20;  // ISO 1

std::optional<double> ifStated(double sd) {
  return sd > 0 ? std::optional{sd} : std::nullopt;
}

procedure::CheckedBall checkedBall(const SetUp& set_up) {
  procedure::CheckedBall ball;
  ball.diameter_mm = set_up.sphere_diameter_mm;
  ball.centre_z = {.mm = ballAt(set_up, 1).z(), .sd_mm = set_up.sd_checked_height_mm};
  ball.limit_mm = set_up.check_limit_mm;
  if (const auto& sd = set_up.sd_accepted_mm) {
    ball.accepted_x = procedure::AcceptedValue{.mm = 0, .sd_mm = (*sd)[0]};
    ball.accepted_y = procedure::AcceptedValue{.mm = 0, .sd_mm = (*sd)[1]};
  }
  return ball;
}

procedure::BallPlate ballPlate(const SetUp& set_up) {
  procedure::BallPlate plate;
  const std::size_t count = set_up.balls_mm.empty() ? 7 : set_up.balls_mm.size();
  for (std::uint16_t number = 1; number <= count; ++number) {
    const Eigen::Vector3d at = ballAt(set_up, number);
    plate.balls_mm.push_back({at.x(), at.y(), at.z()});
  }
  plate.b_axis_point_mm = set_up.table.point_mm;
  plate.sd_mm = ifStated(set_up.sd_plate_mm);
  plate.station_correction = set_up.station_correction;
  return plate;
}

procedure::ScrewFacts screw(const SetUp& set_up) {
  procedure::ScrewFacts screw{{.length_mm = 800, .offset_mm = 100, .pitch_mm = set_up.screw_pitch_mm}};
  screw.gain = 1;
  screw.threshold_rpm = 60;
  screw.travel_max_mm = 600;
  screw.face = procedure::ScrewFace{
      .result_id = 1, .sector_um = std::vector<double>(kMostScrewSectors, 0.0), .sd_um = set_up.sd_screw_sector_um};
  return screw;
}

procedure::ToolSetter toolSetter(const SetUp& set_up) {
  procedure::ToolSetter setter;
  setter.half_width_mm = set_up.setter_half_width_mm;
  setter.sd_half_width_mm = ifStated(set_up.sd_half_width_mm);
  setter.probe_offset_mm = {0, 0, -set_up.tool_lengths_mm[0]};
  setter.sd_probe_offset_mm = ifStated(set_up.sd_probe_offset_mm);
  setter.accepted_mm = {0, 0, 0};
  setter.limit_mm = set_up.setter_limit_mm;
  setter.sd_accepted_mm = set_up.sd_setter_mm;
  return setter;
}

procedure::SensorHead sensorHead(const SetUp& set_up) {
  procedure::SensorHead head;
  head.tool = set_up.head_tool;
  head.range_mm = set_up.head_range_mm;
  head.sd_centre_offset_mm = set_up.sd_head_centre_mm;
  head.calibrated = set_up.head_calibrated;
  if (head.calibrated) return head;
  head.calibrated = procedure::CalibratedHead{.result_id = 1, .tool = head.tool, .matrix = {}, .sd = {}};
  // Three sensors, a third of a turn apart, that look up at the ball by 35 degrees.
  head.calibrated->matrix = {{{0.82, 0, 0.57}, {-0.41, 0.71, 0.57}, {-0.41, -0.71, 0.57}}};
  for (auto& row : head.calibrated->sd) row.fill(set_up.sd_head_matrix);
  return head;
}

procedure::TriggerProbe triggerProbe(const SetUp& set_up, std::span<const std::uint32_t> tools) {
  if (!set_up.pre_travels.empty())
    return {.repeatability_mm = 1e-3 * *set_up.switch_repeatability_um, .pre_travels = set_up.pre_travels};
  procedure::PreTravel pre_travel{.result_id = 1, .parts_mm = {}, .covariance = {}};
  const double sd_mm = 1e-3 * set_up.sd_pre_travel_um;
  for (std::size_t part = 0; part < procedure::PreTravel::kParts; ++part)
    pre_travel.covariance[part][part] = sd_mm * sd_mm;
  procedure::TriggerProbe probe{.repeatability_mm = 1e-3 * *set_up.switch_repeatability_um,
                                .pre_travels = {pre_travel}};
  for (const std::uint32_t tool : tools) {
    pre_travel.tool = tool;
    probe.pre_travels.push_back(pre_travel);
  }
  return probe;
}

procedure::ProbeShank probeShank(const SetUp& set_up, const procedure::ProbeTools& tools) {
  procedure::ProbeShank shank{.tool = set_up.shank_tool != 0 ? set_up.shank_tool : tools.numbers[0],
                              .radius_mm = set_up.shank_radius_mm,
                              .height_mm = set_up.shank_height_mm,
                              .from_mm = set_up.shank_from_mm};
  const double of_tool_mm = tools.lengthOf(shank.tool);
  shank.tip_length_mm = of_tool_mm > 0 ? of_tool_mm : set_up.shank_tip_length_mm;
  return shank;
}

std::vector<procedure::ToolFacts> toolsOf(const SetUp& set_up, std::uint32_t asked) {
  if (!set_up.tools.empty()) return set_up.tools;
  return {{.number = asked,
           .length_mm = 120,
           .sd_mm = 0,
           .holder = procedure::HolderFacts{.number = 1, .length_mm = 62, .sd_mm = set_up.sd_holder_mm}}};
}

}  // namespace

double touchedSphere_mm(const SetUp& set_up) {
  const double at_20_mm = set_up.sphere_diameter_mm + set_up.stylus_ball_diameter_mm;
  const auto& at = set_up.sphere_temperature;
  return at && at->celsius ? at_20_mm * (1 + at->expansion_per_k * (*at->celsius - kReference_c)) : at_20_mm;
}

SetUp withProbeFor(const procedure::LiveMethod& method, SetUp set_up) {
  constexpr double kUsual_um = 0.5;
  const bool needs_switch = std::ranges::find(method.needs, &procedure::kTriggerProbe) != method.needs.end();
  if (needs_switch && !set_up.switch_repeatability_um) set_up.switch_repeatability_um = kUsual_um;
  set_up.plate_in_mounts = method.of_plate;
  return set_up;
}

Eigen::Vector3d ballAt(const SetUp& set_up, std::uint16_t number) {
  if (const auto& balls = set_up.balls_mm; !balls.empty())
    return Eigen::Vector3d{balls[(number - 1U) % balls.size()].data()};
  const double at_rad = kTurn / 3 * (number - 1);
  return set_up.ball_reach_mm * Eigen::Vector3d{std::cos(at_rad), std::sin(at_rad), static_cast<double>(number)};
}

procedure::Facts factsOf(const SetUp& set_up, std::uint32_t tool) {
  constexpr double kFoundBy_rad = 0.01;  // how far off the line the ball is found by eye
  procedure::Facts facts{
      .has_y = set_up.has_y,
      .has_second_spindle = true,
      .sphere_diameter_mm = set_up.sphere_diameter_mm,
      .gaps = {{procedure::KnownSize{set_up.gaps_mm[0]}, procedure::KnownSize{set_up.gaps_mm[1]},
                procedure::KnownSize{set_up.gaps_mm[2]}}},
      .datum_cylinder =
          procedure::DatumCylinder{.diameter = {set_up.cylinder_diameter_mm}, .inside = set_up.cylinder_inside},
      .datum_cube = procedure::DatumCube{.edges_mm = set_up.cube_edges_mm},
      .stylus_ball_diameter_mm = set_up.stylus_ball_diameter_mm,
      .sigma_c_rad = set_up.sigma_c_rad,
      .accuracy = set_up.accuracy,
      .screws = {screw(set_up), screw(set_up), screw(set_up)},
      .checked_ball = checkedBall(set_up),
      .ball_plate = ballPlate(set_up),
      .tilting_table = set_up.table,
      .swivel_head = procedure::HeadFacts{
          .b = set_up.head, .pivot_mm = set_up.pivot_mm, .ball_mm = std::array<double, 3>{}, .sd_ball_mm = {}}};
  facts.sphere_temperature = set_up.sphere_temperature;
  facts.sd_stylus_ball_diameter_mm = ifStated(set_up.sd_stylus_ball_diameter_mm);
  facts.sd_sphere_diameter_mm = ifStated(set_up.sd_sphere_diameter_mm);
  facts.swivel_head->sd_ball_mm = ifStated(set_up.sd_head_ball_mm);
  facts.probe_tools = {
      .count = set_up.tool_count, .numbers = set_up.tool_numbers, .lengths_mm = set_up.tool_lengths_mm};
  const double touching_mm = (set_up.sphere_diameter_mm + set_up.stylus_ball_diameter_mm) / 2;
  facts.rim_ball = procedure::RimBall{.c_on_line_rad = std::numbers::pi / 2 + kFoundBy_rad,
                                      .level_limit_mm = {},
                                      .beside_mm = 1.5 * touching_mm,
                                      .radius_mm = ballAt(set_up, 1).head<2>().norm(),
                                      .c_has_encoder = true};
  facts.probe_shank = probeShank(set_up, facts.probe_tools);
  facts.tool_setter = toolSetter(set_up);
  facts.tools = toolsOf(set_up, tool);
  facts.sensor_head = sensorHead(set_up);
  facts.distance_probe = set_up.distance_probe;
  if (set_up.switch_repeatability_um) facts.trigger_probe = triggerProbe(set_up, facts.carriers());
  return facts;
}

}  // namespace probebox::plan
