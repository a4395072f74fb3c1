#include "tools/probebox/commands/planned_machine.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "board/describe/file_content.hpp"
#include "board/describe/machine.hpp"
#include "board/describe/parse.hpp"
#include "board/describe/probe.hpp"
#include "firmware/procedure/described/machine_facts.hpp"
#include "firmware/procedure/described/machine_in_use.hpp"
#include "firmware/procedure/facts/facts.hpp"
#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/plan/readiness.hpp"
#include "protocol/messages/machine.hpp"
#include "tools/plan/set_up.hpp"
#include "tools/plan/simulated_facts.hpp"
#include "tools/plan/wanted.hpp"
#include "tools/probebox/text/report.hpp"

namespace probebox::command {
namespace {

// Conversions between the descriptions of a machine: machine.toml, what a box says, and the set-up of a forecast.

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

// Replaces the machine that a box has named by that of a machine.toml, with the results in force about its parts. The
// certificate of the sphere stays where the file has that sphere, without one of its own.
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

// Replaces the probe by that of a probe.toml, at its nominal rate; what was calibrated with another one is gone.
void replaceProbe(Described& says, const board::Probe& probe) {
  if (probe.name() != says.probe.name) {
    says.delay = {};
    says.pre_travels.clear();
  }
  const auto& by_switch = probe.by_switch;
  const auto distance = probe.by_distance.value_or(board::ProbeDistance{});
  says.probe = {.name = probe.name(),
                .switches = by_switch.has_value(),
                .repeatability_um = by_switch ? by_switch->repeatability_um : 0,
                .noise_um = by_switch ? 0 : probe.noise_um,
                .ball_diameter_mm = probe.ball_diameter_mm,
                .sd_ball_diameter_mm = probe.sd_ball_diameter_mm.value_or(0),
                .deflection_limit_mm = probe.deflection_limit_mm,
                .stand_off_mm = distance.stand_off_mm,
                .range_mm = distance.range_mm};
  says.deflections_hz = by_switch ? 0 : probe.rate_hz;
}

// Takes the probe that is described, its rate and that of the positions into a set-up; the rest stays as it is.
void takeProbe(plan::SetUp& set_up, const Described& says) {
  const auto& probe = says.probe;
  if (probe.ball_diameter_mm > 0) set_up.stylus_ball_diameter_mm = probe.ball_diameter_mm;
  set_up.sd_stylus_ball_diameter_mm = probe.sd_ball_diameter_mm;
  if (probe.deflection_limit_mm > 0) set_up.deflection_limit_mm = probe.deflection_limit_mm;
  if (probe.stand_off_mm > 0) {
    set_up.distance_probe = procedure::DistanceProbe{probe.stand_off_mm, probe.range_mm};
    set_up.stylus_ball_diameter_mm = 0;
  }
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

// Takes what is described into a set-up; the rest stays as it is. wanted: for the screw that it is about.
void takeMachine(plan::SetUp& set_up, const Described& says, const plan::Wanted& wanted) {
  takeProbe(set_up, says);
  omitMissing(set_up, says, wanted);
  set_up.has_y = says.has_y;
  takeSphere(set_up, says.sphere);
  for (std::size_t axis = 0; axis < says.gaps_mm.size(); ++axis) {
    if (says.gaps_mm[axis] > 0) set_up.gaps_mm[axis] = says.gaps_mm[axis];
  }
  if (says.cylinder_diameter_mm > 0) {
    set_up.cylinder_diameter_mm = says.cylinder_diameter_mm;
    set_up.cylinder_inside = says.cylinder_inside;
  }
  if (says.cube_edges_mm[0] > 0) set_up.cube_edges_mm = says.cube_edges_mm;
  set_up.sigma_c_rad = says.sigma_c_rad;
  for (const auto& accuracy : says.accuracy) set_up.accuracy = accuracy;
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

// The facts of a set-up without those of parts that are not described; where a box was asked, also without results that
// are not in force.
procedure::Facts describedFacts(const plan::SetUp& set_up, const Described& says, const plan::Wanted& wanted,
                                bool of_box) {
  auto facts = plan::factsOf(set_up, wanted.options.tool);
  if (says.sphere.diameter_mm == 0) facts.sphere_diameter_mm.reset();
  for (std::size_t axis = 0; axis < facts.gaps.size(); ++axis) {
    if (says.gaps_mm[axis] == 0) facts.gaps[axis].reset();
  }
  if (says.cylinder_diameter_mm == 0) facts.datum_cylinder.reset();
  if (says.cube_edges_mm[0] == 0) facts.datum_cube.reset();
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

// what: "machine.toml of the box (--machine)".
Outcome<std::string> textOf(const std::string& path, const char* what) {
  auto text = board::fileContent(path);
  if (!text) return Error{path + " cannot be read (" + text.error().what + "): give the " + what + "."};
  return text;
}

// The machine of a file, with the certified sphere of another.
Outcome<board::Machine> machineIn(const Plan& options, std::vector<std::string>& notes) {
  TRY(const auto text, textOf(options.machine, "machine.toml of the box (--machine)"));
  board::Descriptions described;
  TRY(described.machine, board::parseMachine(text, options.machine));
  if (options.unit.empty()) return described.machine;
  TRY(const auto of_unit, textOf(options.unit, "unit.toml of the box (--unit)"));
  TRY(const auto unit, board::parseUnit(of_unit, options.unit));
  if (auto other = board::applyUnit(unit, described)) notes.push_back(*std::move(other));
  return described.machine;
}

Outcome<board::Probe> probeIn(const Plan& options) {
  TRY(const auto text, textOf(options.probe, "probe.toml of the box (--probe)"));
  return board::parseProbe(text, options.probe);
}

std::string listed(const std::vector<std::string>& texts) {
  std::string all;
  for (const auto& text : texts) all += (all.empty() ? "" : ", ") + text;
  return all;
}

// Of a measured rate no more than its whole hertz are of interest.
double rounded(double value) {
  return value >= 100 ? std::round(value) : value;
}

// Options replace what is described. What neither says is usual.
void choose(PlannedMachine& machine, const Plan& options, const messages::DescribeMachine::Answer& says) {
  plan::SetUp& set_up = machine.set_up;
  const auto take = [&](double& value, const std::optional<double>& given, bool described, const char* in_words) {
    if (!given) (described ? machine.told : machine.usual).push_back(printed(in_words, rounded(value)));
    value = given.value_or(value);
  };
  if (options.machine_rate_hz) set_up.axis_rates_hz.fill(0);
  const bool has_positions = says.positions_hz[0] > 0 && says.positions_hz[1] > 0 && says.positions_hz[2] > 0;
  take(set_up.machine_rate_hz, options.machine_rate_hz, has_positions, "%g positions a second");
  take(set_up.machine_noise_um, options.machine_noise_um, false, "positions with %g um of noise");
  if (options.switch_noise_um) set_up.switch_repeatability_um = options.switch_noise_um;
  if (!set_up.switch_repeatability_um) {
    take(set_up.probe_rate_hz, options.probe_rate_hz, says.deflections_hz > 0, "%g deflections a second");
    take(set_up.probe_noise_um, options.probe_noise_um, says.probe.noise_um > 0, "deflections with %g um of noise");
  }
  if (says.probe.ball_diameter_mm == 0)
    machine.usual.push_back(printed("a stylus ball of %g mm", set_up.stylus_ball_diameter_mm));
  take(set_up.acceleration_mm_s2, options.acceleration_mm_s2, false, "an acceleration of %g mm/s2");
}

// Runs at several angles of the head are forecast at one.
bool swivelsToo(const plan::Wanted& wanted, const messages::DescribeMachine::Answer& says) {
  if (wanted.method == &procedure::kPeriodicCheck)
    return !says.checked_ball.empty() && !says.checked_ball.front().swivels_rad.empty();
  return wanted.method == &procedure::kToolSetter && !says.setter.empty() && says.setter.front().swivels_rad.size() > 1;
}

// As the box would refuse the run now. Which results are in force is known from a box alone.
std::string whyRefusedThere(const PlannedMachine& machine, const plan::Wanted& wanted,
                            const messages::DescribeMachine::Answer& says) {
  const auto& [method, options] = wanted;
  const bool of_box = !machine.box.empty();
  const auto facts = describedFacts(machine.set_up, says, wanted, of_box);
  const auto by = procedure::readBy(options);
  const bool has_delay = !of_box || says.delay.calibrated;
  if (const auto why = procedure::whyUnready(*method, facts, has_delay, by)) return why->what;
  if (by == procedure::ReadBy::head) {
    if (const auto why = procedure::whyNoHead(*method, facts)) return why->what;
  }
  if (by == procedure::ReadBy::shank) {
    if (const auto why = procedure::whyNoShank(*method, facts)) return why->what;
  }
  const auto unfit = method->why_unfit != nullptr ? method->why_unfit(options, facts) : std::nullopt;
  if (unfit) return unfit->what;
  const auto completed = procedure::described(*method, options, facts, by);
  return completed ? std::string{} : completed.error().what;
}

}  // namespace

Outcome<PlannedMachine, Trouble> plannedMachine(const Plan& options, const plan::Wanted& wanted,
                                                const std::optional<AskedBox>& box) {
  PlannedMachine machine;
  machine.set_up.accuracy.reset();
  messages::DescribeMachine::Answer says;
  if (box) {
    says = box->says;
    machine.box = box->uri;
    machine.name_in_box = says.machine;
    machine.probe = says.probe.name;
  }
  if (!options.machine.empty()) {
    const auto in_file = machineIn(options, machine.notes);
    if (!in_file) return Trouble{ExitStatus::usage, "bad-description", in_file.error().what};
    replaceMachine(says, *in_file);
    machine.file = options.machine;
    machine.unit_file = options.unit;
  }
  if (!options.probe.empty()) {
    const auto in_file = probeIn(options);
    if (!in_file) return Trouble{ExitStatus::usage, "bad-description", in_file.error().what};
    replaceProbe(says, *in_file);
    machine.probe = says.probe.name;
    machine.probe_file = options.probe;
  }
  machine.name = says.machine;
  const bool is_described = box || !machine.file.empty();
  if (!is_described) takeProbe(machine.set_up, says);
  if (is_described) takeMachine(machine.set_up, says, wanted);
  choose(machine, options, says);
  if (swivelsToo(wanted, says)) machine.usual.emplace_back("the head at 0 alone");
  if (is_described) machine.why_refused = whyRefusedThere(machine, wanted, says);
  return machine;
}

Json describe(const PlannedMachine& machine) {
  const auto orNull = [](const std::string& text) { return text.empty() ? Json(nullptr) : Json(text); };
  const auto& set_up = machine.set_up;
  return {{"name", orNull(machine.name)},
          {"box", orNull(machine.box)},
          {"file", orNull(machine.file)},
          {"unit_file", orNull(machine.unit_file)},
          {"probe_file", orNull(machine.probe_file)},
          {"probe", orNull(machine.probe)},
          {"positions_hz", set_up.machine_rate_hz},
          {"positions_noise_um", set_up.machine_noise_um},
          {"deflections_hz", set_up.switch_repeatability_um ? Json(nullptr) : Json(set_up.probe_rate_hz)},
          {"deflections_noise_um", set_up.switch_repeatability_um ? Json(nullptr) : Json(set_up.probe_noise_um)},
          {"switch_noise_um", set_up.switch_repeatability_um ? Json(*set_up.switch_repeatability_um) : Json(nullptr)},
          {"usual", machine.usual},
          {"why_refused", orNull(machine.why_refused)}};
}

std::vector<std::string> inWords(const PlannedMachine& machine) {
  std::vector<std::string> lines;
  const bool own_probe = !machine.probe_file.empty();
  if (machine.name.empty()) {
    lines.emplace_back("for a usual machine, no particular one: name a box with -u, or give --machine FILE");
  } else if (machine.file.empty()) {
    lines.push_back("for " + machine.name + (own_probe ? "" : " with " + machine.probe) + ", as the box " +
                    machine.box + " says");
  } else if (machine.box.empty()) {
    lines.push_back("for " + machine.name + ", as " + machine.file + " says; no box was asked");
  } else {
    lines.push_back(
        "for " + machine.name + ", as " + machine.file + " says in the place of " + machine.name_in_box +
        " of the box " + machine.box +
        (own_probe ? "; with its rates of positions" : "; with its " + machine.probe + ", rates and delay"));
  }
  if (!machine.unit_file.empty()) lines.push_back("with the datum sphere of " + machine.unit_file);
  if (own_probe) lines.push_back("with the probe " + machine.probe + ", as " + machine.probe_file + " says");
  if (!machine.told.empty())
    lines.push_back((machine.box.empty() || own_probe ? "described: " : "of the box: ") + listed(machine.told));
  lines.insert(lines.end(), machine.notes.begin(), machine.notes.end());
  if (!machine.usual.empty()) lines.push_back("usual, because nothing says otherwise: " + listed(machine.usual));
  if (!machine.why_refused.empty()) lines.push_back("there the run would be refused: " + machine.why_refused);
  return lines;
}

}  // namespace probebox::command
