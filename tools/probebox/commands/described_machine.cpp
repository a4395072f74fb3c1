#include "tools/probebox/commands/described_machine.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "firmware/procedure/described/machine_facts.hpp"
#include "firmware/procedure/described/machine_in_use.hpp"
#include "tools/plan/simulated_facts.hpp"

namespace probebox::command {
namespace {

using Described = messages::DescribeMachine::Answer;

// The certificate stays where the file has a sphere of that size, or states none.
void keepCertificate(messages::SphereInUse& sphere, const messages::SphereInUse& of_box) {
  constexpr double kRounding_mm = 5e-7;  // of a value written to the nanometre
  const double off_mm = std::abs(sphere.diameter_mm - of_box.diameter_mm);
  const bool is_same = sphere.diameter_mm == 0 || off_mm <= 2 * of_box.sd_diameter_mm + kRounding_mm;
  if (of_box.sd_diameter_mm == 0 || sphere.sd_diameter_mm > 0 || !is_same) return;
  sphere.diameter_mm = of_box.diameter_mm;
  sphere.sd_diameter_mm = of_box.sd_diameter_mm;
  sphere.certificate = of_box.certificate;
}

void takeB(procedure::BFacts& b, const messages::TiltInUse& described) {
  b.axis = described.axis;
  b.sigma_rad = described.sigma_rad;
  b.count = std::min(described.angles_rad.size(), b.angles_rad.size());
  std::copy_n(described.angles_rad.begin(), b.count, b.angles_rad.begin());
}

// Takes balls and the axis of the table from the point of C about which a run reports its errors.
void takePlate(plan::SetUp& set_up, const messages::PlateInUse& plate, const Described& says) {
  set_up.balls_mm = plate.balls_mm;
  set_up.sd_plate_mm = plate.sd_mm;
  set_up.station_correction = plate.station_correction;
  if (says.table.empty() || !says.table.front().has_point) return;
  auto point_mm = says.table.front().point_mm;
  for (std::size_t i = 0; i < point_mm.size(); ++i) point_mm.at(i) -= plate.axis_point_mm.at(i);
  set_up.table.point_mm = point_mm;
}

void takeTools(plan::SetUp& set_up, const Described& says) {
  if (!says.carriers.empty()) {
    set_up.tool_count = std::min(says.carriers.size(), set_up.tool_numbers.size());
    for (std::size_t i = 0; i < set_up.tool_count; ++i) {
      set_up.tool_numbers.at(i) = says.carriers[i].number;
      set_up.tool_lengths_mm.at(i) = says.carriers[i].length_mm;
    }
  }
  for (const auto& shank : says.shank) {
    set_up.shank_tool = shank.tool;
    set_up.shank_tip_length_mm = shank.tip_length_mm;
    set_up.shank_radius_mm = shank.radius_mm;
    set_up.shank_height_mm = shank.height_mm;
    set_up.shank_from_mm = shank.from_mm;
  }
  for (const auto& tool : says.tools) {
    set_up.tools.push_back(
        {.number = tool.number, .length_mm = tool.length_mm, .sd_mm = tool.sd_mm, .faces = tool.faces});
    if (tool.holder != 0)
      set_up.tools.back().holder = procedure::HolderFacts{tool.holder, tool.holder_length_mm, tool.sd_holder_mm};
  }
}

void takeSphere(plan::SetUp& set_up, const messages::SphereInUse& sphere) {
  if (sphere.diameter_mm > 0) set_up.sphere_diameter_mm = sphere.diameter_mm;
  set_up.sd_sphere_diameter_mm = sphere.sd_diameter_mm;
  if (sphere.has_temperature || sphere.expansion_per_k != 0)
    set_up.sphere_temperature = procedure::SphereTemperature{
        .celsius = sphere.has_temperature ? std::optional{sphere.temperature_c} : std::nullopt,
        .sd_k = sphere.sd_temperature_k,
        .expansion_per_k = sphere.expansion_per_k};
}

void takeSetter(plan::SetUp& set_up, const messages::SetterInUse& setter) {
  set_up.setter_half_width_mm = setter.half_width_mm;
  set_up.sd_half_width_mm = setter.sd_half_width_mm;
  set_up.sd_probe_offset_mm = setter.sd_probe_offset_mm;
  set_up.sd_setter_mm = setter.sd_accepted_mm;
  if (setter.limit_mm > 0) set_up.setter_limit_mm = setter.limit_mm;
}

void takeSensorHead(plan::SetUp& set_up, const messages::SensorHeadInUse& head) {
  set_up.head_tool = head.tool;
  set_up.head_range_mm = head.range_mm;
  set_up.sd_head_centre_mm = head.sd_centre_offset_mm;
  if (head.result_id == 0) return;
  set_up.head_calibrated = procedure::CalibratedHead{
      .result_id = head.result_id, .tool = head.tool, .matrix = head.matrix, .sd = head.sd_matrix};
}

bool allNeedsKnown(const plan::Wanted& wanted, const procedure::Facts& facts) {
  return std::ranges::all_of(wanted.method->needs,
                             [&](const procedure::Fact* fact) { return fact->known == nullptr || fact->known(facts); });
}

// What a machine does not have is off by nothing, unless the run needs it: it is usual then.
void omitMissing(plan::SetUp& set_up, const Described& says, const plan::Wanted& wanted) {
  const auto usual = plan::factsOf(set_up, wanted.options.tool);
  auto without = usual;
  without.tilting_table.reset();
  if (says.table.empty() && allNeedsKnown(wanted, without)) set_up.table.sigma_rad = 0;
  without = usual;
  without.swivel_head.reset();
  if (says.head.empty() && allNeedsKnown(wanted, without)) set_up.head.sigma_rad = 0;
}

}  // namespace

void replaceMachine(Described& says, const board::Machine& machine) {
  auto in_file = procedure::machineInUse(procedure::factsOf(machine));
  keepCertificate(in_file.sphere, says.sphere);
  in_file.machine = machine.name;
  in_file.mounting = machine.mounting;
  in_file.probe = std::move(says.probe);
  in_file.positions_hz = says.positions_hz;
  in_file.deflections_hz = says.deflections_hz;
  in_file.delay = says.delay;
  in_file.pre_travels = std::move(says.pre_travels);
  says = std::move(in_file);
}

void replaceProbe(Described& says, const board::Probe& probe) {
  if (probe.name() != says.probe.name) {
    says.delay = {};
    says.pre_travels.clear();
  }
  const auto& by_switch = probe.by_switch;
  says.probe = {.name = probe.name(),
                .switches = by_switch.has_value(),
                .repeatability_um = by_switch ? by_switch->repeatability_um : 0,
                .noise_um = by_switch ? 0 : probe.noise_um,
                .ball_diameter_mm = probe.ball_diameter_mm,
                .sd_ball_diameter_mm = probe.sd_ball_diameter_mm.value_or(0),
                .deflection_limit_mm = probe.deflection_limit_mm};
  says.deflections_hz = by_switch ? 0 : probe.rate_hz;
}

void takeProbe(plan::SetUp& set_up, const Described& says) {
  const auto& probe = says.probe;
  if (probe.ball_diameter_mm > 0) set_up.stylus_ball_diameter_mm = probe.ball_diameter_mm;
  set_up.sd_stylus_ball_diameter_mm = probe.sd_ball_diameter_mm;
  if (probe.deflection_limit_mm > 0) set_up.deflection_limit_mm = probe.deflection_limit_mm;
  if (probe.switches) set_up.switch_repeatability_um = probe.repeatability_um;
  if (probe.noise_um > 0) set_up.probe_noise_um = probe.noise_um;
  if (says.deflections_hz > 0) set_up.probe_rate_hz = says.deflections_hz;
  // The slowest of the axes.
  const double positions_hz = std::ranges::min(says.positions_hz);
  if (positions_hz > 0) {
    set_up.machine_rate_hz = positions_hz;
    set_up.axis_rates_hz = says.positions_hz;
  }
  if (says.delay.calibrated) set_up.sd_delay_s = says.delay.sd_s;
  for (const auto& one : says.pre_travels)
    set_up.pre_travels.push_back(
        {.result_id = one.result_id, .tool = one.tool, .parts_mm = {}, .covariance = one.covariance_mm2});
}

void takeMachine(plan::SetUp& set_up, const Described& says, const plan::Wanted& wanted) {
  takeProbe(set_up, says);
  omitMissing(set_up, says, wanted);
  takeSphere(set_up, says.sphere);
  if (says.gap_mm > 0) set_up.gap_mm = says.gap_mm;
  set_up.sigma_c_rad = says.sigma_c_rad;
  for (const auto& table : says.table) takeB(set_up.table, table);
  for (const auto& head : says.head) {
    takeB(set_up.head, head);
    set_up.pivot_mm = head.pivot_mm;
    set_up.sd_head_ball_mm = head.sd_ball_mm;
  }
  for (const auto& plate : says.plate) takePlate(set_up, plate, says);
  takeTools(set_up, says);
  for (const auto& setter : says.setter) takeSetter(set_up, setter);
  for (const auto& head : says.sensor_head) takeSensorHead(set_up, head);
  for (const auto& check : says.checked_ball) {
    if (check.accepted) set_up.sd_accepted_mm = check.sd_accepted_mm;
    set_up.sd_checked_height_mm = check.sd_centre_z_mm;
    if (check.limit_mm > 0) set_up.check_limit_mm = check.limit_mm;
  }
  for (const auto& screw : says.screws) {
    if (screw.axis + 1 != wanted.options.axis) continue;
    set_up.screw_pitch_mm = screw.pitch_mm;
    if (screw.face_result_id != 0) set_up.sd_screw_sector_um = screw.sd_face_um;
  }
}

procedure::Facts describedFacts(const plan::SetUp& set_up, const Described& says, const plan::Wanted& wanted,
                                bool of_box) {
  auto facts = plan::factsOf(set_up, wanted.options.tool);
  if (says.sphere.diameter_mm == 0) facts.sphere_diameter_mm.reset();
  if (says.gap_mm == 0) facts.gap_mm.reset();
  if (says.table.empty()) facts.tilting_table.reset();
  if (says.head.empty()) facts.swivel_head.reset();
  if (facts.swivel_head && !says.head.front().has_ball) facts.swivel_head->ball_mm.reset();
  if (says.plate.empty()) facts.ball_plate.reset();
  if (says.carriers.empty()) facts.probe_tools = {};
  if (says.shank.empty()) facts.probe_shank.reset();
  if (says.tools.empty()) facts.tools.clear();
  if (says.setter.empty()) facts.tool_setter.reset();
  if (facts.tool_setter && !says.setter.front().accepted) facts.tool_setter->accepted_mm.reset();
  if (says.sensor_head.empty()) facts.sensor_head.reset();
  if (facts.sensor_head && of_box && says.sensor_head.front().result_id == 0) facts.sensor_head->calibrated.reset();
  for (std::size_t axis = 0; axis < facts.screws.size(); ++axis) {
    const auto screw = std::ranges::find(says.screws, axis, &messages::ScrewInUse::axis);
    if (screw == says.screws.end())
      facts.screws[axis].reset();
    else if (of_box && screw->face_result_id == 0)
      facts.screws[axis]->face.reset();
  }
  if (!says.has_rim_ball) facts.rim_ball.reset();
  if (says.checked_ball.empty()) facts.checked_ball.reset();
  if (facts.trigger_probe && of_box) facts.trigger_probe->pre_travels = set_up.pre_travels;
  return facts;
}

}  // namespace probebox::command
