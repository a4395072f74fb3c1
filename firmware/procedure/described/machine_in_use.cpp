#include "firmware/procedure/described/machine_in_use.hpp"

#include <cstddef>
#include <cstdint>

namespace probebox::procedure {
namespace {

messages::SphereInUse sphereInUse(const Facts& facts) {
  messages::SphereInUse sphere{.diameter_mm = facts.sphere_diameter_mm.value_or(0)};
  sphere.sd_diameter_mm = facts.sd_sphere_diameter_mm.value_or(0);
  if (const auto& certificate = facts.sphere_certificate) sphere.certificate = certificate->in_words;
  if (const auto& stated = facts.sphere_temperature) {
    sphere.has_temperature = stated->celsius.has_value();
    sphere.temperature_c = stated->celsius.value_or(0);
    sphere.sd_temperature_k = stated->sd_k;
    sphere.expansion_per_k = stated->expansion_per_k;
  }
  return sphere;
}

messages::TiltInUse tiltInUse(const BFacts& b) {
  return {.axis = b.axis,
          .angles_rad = {b.angles_rad.begin(), b.angles_rad.begin() + static_cast<std::ptrdiff_t>(b.count)},
          .sigma_rad = b.sigma_rad,
          .has_point = b.point_mm.has_value(),
          .point_mm = b.point_mm.value_or(std::array<double, 3>{})};
}

messages::TiltInUse headInUse(const HeadFacts& described) {
  messages::TiltInUse head = tiltInUse(described.b);
  head.pivot_mm = described.pivot_mm;
  head.has_ball = described.ball_mm.has_value();
  head.sd_ball_mm = described.sd_ball_mm.value_or(0);
  return head;
}

messages::PlateInUse plateInUse(const BallPlate& plate) {
  return {.axis_point_mm = plate.axis_point_mm,
          .sd_mm = plate.sd_mm.value_or(0),
          .station_correction = plate.station_correction,
          .balls_mm = plate.balls_mm};
}

messages::ShankInUse shankInUse(const ProbeShank& shank) {
  return {.tool = shank.tool,
          .tip_length_mm = shank.tip_length_mm,
          .radius_mm = shank.radius_mm,
          .height_mm = shank.height_mm,
          .from_mm = shank.from_mm};
}

messages::SetterInUse setterInUse(const ToolSetter& setter) {
  return {.half_width_mm = setter.half_width_mm,
          .sd_half_width_mm = setter.sd_half_width_mm.value_or(0),
          .sd_probe_offset_mm = setter.sd_probe_offset_mm.value_or(0),
          .accepted = setter.accepted_mm.has_value(),
          .sd_accepted_mm = setter.sd_accepted_mm,
          .limit_mm = setter.limit_mm,
          .swivels_rad = setter.swivels_rad};
}

messages::CheckInUse checkInUse(const CheckedBall& ball, bool has_y) {
  const auto &x = ball.accepted_x, &y = ball.accepted_y;
  return {.ball_diameter_mm = ball.diameter_mm,
          .limit_mm = ball.limit_mm.value_or(0),
          .accepted = x && (y || !has_y),
          .sd_accepted_mm = {x ? x->sd_mm : 0, y ? y->sd_mm : 0},
          .sd_centre_z_mm = ball.centre_z.sd_mm,
          .swivels_rad = ball.swivels_rad};
}

messages::SensorHeadInUse sensorHeadInUse(const SensorHead& head) {
  messages::SensorHeadInUse in_use{
      .tool = head.tool, .range_mm = head.range_mm, .sd_centre_offset_mm = head.sd_centre_offset_mm};
  if (const auto& calibrated = head.calibrated) {
    in_use.result_id = calibrated->result_id;
    in_use.matrix = calibrated->matrix;
    in_use.sd_matrix = calibrated->sd;
  }
  return in_use;
}

void addTools(messages::DescribeMachine::Answer& answer, const Facts& facts) {
  const auto& carriers = facts.probe_tools;
  for (std::size_t i = 0; i < carriers.count; ++i)
    answer.carriers.push_back({.number = carriers.numbers.at(i),
                               .length_mm = carriers.lengths_mm.at(i),
                               .result_id = carriers.results.at(i)});
  for (const auto& tool : facts.tools) {
    messages::ToolInUse in_use{
        .number = tool.number, .length_mm = tool.length_mm, .sd_mm = tool.sd_mm, .faces = tool.faces};
    if (const auto& holder = tool.holder) {
      in_use.holder = holder->number;
      in_use.holder_length_mm = holder->length_mm;
      in_use.sd_holder_mm = holder->sd_mm;
    }
    answer.tools.push_back(in_use);
  }
}

void addScrews(messages::DescribeMachine::Answer& answer, const Facts& facts) {
  for (std::size_t axis = 0; axis < facts.screws.size(); ++axis) {
    const auto& screw = facts.screws[axis];
    if (!screw) continue;
    messages::ScrewInUse in_use{.axis = static_cast<std::uint8_t>(axis), .pitch_mm = screw->pitch_mm};
    if (const auto& face = screw->face) {
      in_use.face_result_id = face->result_id;
      in_use.sd_face_um = face->sd_um;
    }
    answer.screws.push_back(in_use);
  }
}

}  // namespace

messages::DescribeMachine::Answer machineInUse(const Facts& facts) {
  messages::DescribeMachine::Answer answer;
  answer.has_y = facts.has_y;
  answer.sphere = sphereInUse(facts);
  for (std::size_t axis = 0; axis < facts.gaps.size(); ++axis)
    answer.gaps_mm[axis] = facts.gaps[axis].value_or(KnownSize{}).mm;
  if (const auto& cylinder = facts.datum_cylinder) {
    answer.cylinder_diameter_mm = cylinder->diameter.mm;
    answer.cylinder_inside = cylinder->inside;
  }
  if (facts.datum_cube) answer.cube_edges_mm = facts.datum_cube->edges_mm;
  answer.sigma_c_rad = facts.sigma_c_rad;
  if (facts.tilting_table) answer.table.push_back(tiltInUse(*facts.tilting_table));
  if (facts.swivel_head) answer.head.push_back(headInUse(*facts.swivel_head));
  if (facts.ball_plate) answer.plate.push_back(plateInUse(*facts.ball_plate));
  if (facts.probe_shank) answer.shank.push_back(shankInUse(*facts.probe_shank));
  if (facts.tool_setter) answer.setter.push_back(setterInUse(*facts.tool_setter));
  if (facts.sensor_head) answer.sensor_head.push_back(sensorHeadInUse(*facts.sensor_head));
  addTools(answer, facts);
  addScrews(answer, facts);
  answer.has_rim_ball = facts.rim_ball.has_value();
  if (facts.accuracy || !facts.measured_errors.empty()) {
    answer.accuracy.push_back({facts.accuracy.value_or(MachineAccuracy{})});
    for (const auto& [error, value] : facts.measured_errors) answer.accuracy.back().*error->member = value;
  }
  if (facts.checked_ball) answer.checked_ball.push_back(checkInUse(*facts.checked_ball, facts.has_y));
  for (const auto& [subject, limit_um, limit_us, limit_urad] : facts.requirements)
    answer.requirements.push_back({subject, limit_um.value_or(0), limit_us.value_or(0), limit_urad.value_or(0)});
  return answer;
}

}  // namespace probebox::procedure
