#include "protocol/modbus/map.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "protocol/modbus/result_blocks.hpp"
#include "protocol/modbus/tables.hpp"
#include "protocol/units/angle.hpp"
#include "protocol/units/correction_sources.hpp"

namespace probebox::modbus {
namespace {

using enum Kind;
using enum Access;
using namespace published;

double status(const RegisterInputs& inputs, std::size_t) {
  return inputs.status;
}

template <int units_per_mm>
double correction(const RegisterInputs& inputs, std::size_t axis) {
  return inputs.correction_mm[axis] * units_per_mm;
}

double age_s(const RegisterInputs& inputs, std::size_t) {
  return static_cast<double>(inputs.state.age_ms / 100) * 0.1;
}

template <Health health>
double sources(const RegisterInputs& inputs, std::size_t) {
  unsigned set = 0;
  for (std::size_t kind = 0; kind < kSourceKinds; ++kind) set |= inputs.state.health[kind] == health ? 1U << kind : 0U;
  return set;
}

template <auto member, int units_per_s>
double delay(const RegisterInputs& inputs, std::size_t axis) {
  const auto& in_force = inputs.state.delay;
  return in_force.result_id != 0 ? (in_force.*member)[axis] * units_per_s : 0;
}

// A result that was accepted is in force, whichever quantity it is about.
double calibrationState(const RegisterInputs& inputs, std::size_t) {
  const auto id = inputs.state.calibration_result_id;
  const auto& in_force = inputs.results.in_force;
  const bool is_in_force = id != 0 && std::ranges::find(in_force, id, &ServedResult::result_id) != in_force.end();
  const bool is_accepted = is_in_force && inputs.state.calibration == CalibrationState::proposed;
  return static_cast<double>(is_accepted ? CalibrationState::accepted : inputs.state.calibration);
}

double centrelineOf(const RegisterInputs& inputs, std::size_t) {
  const auto id = inputs.state.centreline.result.result_id;
  const auto found = std::ranges::find(inputs.results.in_force, id, &ServedResult::result_id);
  if (id == 0 || found == inputs.results.in_force.end()) return 0;
  return (found->subject == "centreline-slide" ? 1 : 0) + (found->rests_on_retired ? kRestsOnRetired : 0);
}

double centrelineHere(const RegisterInputs& inputs, std::size_t axis) {
  const auto& centreline = inputs.state.centreline;
  return centreline.has_z ? centreline.here_mm[axis] : 0;
}

template <auto member>
double centreline(const RegisterInputs& inputs, std::size_t axis) {
  return of<&Snapshot::centreline, &CentrelineInForce::result, member>(inputs, axis);
}

double screwFault(const RegisterInputs& inputs, std::size_t axis) {
  const auto& screw = inputs.state.axes[axis].screw;
  return screw.fitted ? static_cast<double>(screw.sensor_fault) : 0;
}

double triggerPosition(const RegisterInputs& inputs, std::size_t axis) {
  const auto& trigger = inputs.state.last_trigger;
  return trigger.has_position[axis] ? trigger.position_mm[axis] : 0;
}

double triggerState(const RegisterInputs& inputs, std::size_t) {
  const auto& trigger = inputs.state.last_trigger;
  unsigned state = (trigger.served.valid ? 1U : 0U) | (trigger.served.degraded ? 2U : 0U);
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis) state |= trigger.has_position[axis] ? 16U << axis : 0U;
  return state;
}

double angle_deg(const RegisterInputs& inputs, std::size_t axis) {
  const auto& state = inputs.state.rotary[axis];
  return state.known ? degrees(state.angle_rad) : 0;
}

// part: 6 x axis + direction.
double rotaryError(const RegisterInputs& inputs, std::size_t part) {
  const auto& state = inputs.state.rotary[part / 6];
  return state.has_errors ? state.errors[part % 6] : 0;
}
double rotaryErrorSd(const RegisterInputs& inputs, std::size_t part) {
  return inputs.state.rotary[part / 6].sd_errors[part % 6];
}

constexpr std::array kRegisters = std::to_array<Register>({
    {address::magic, "magic", u16, 1, "", read, "0x5042", constant<kMagic>},
    {1, "map version", u16, 1, "", read, "version of this map; a higher one only adds", constant<kMapVersion>},
    {address::status, "status", u16, 1, "", read,
     "bit 0 corrections valid, 1 clock locked, 2 delay calibrated, 3 centreline calibrated, 4 screw sensors good, "
     "5 degraded (value held or saturated), 6 loss seen, 7 all needed axes referenced",
     status},
    {address::sequence, "sequence", u16, 1, "", read, "+1 whenever any correction changes; wraps",
     of<&Snapshot::sequence>},
    {address::heartbeat, "heartbeat", u16, 1, "", read,
     "+1 every 0.1 s while inputs arrive and the corrections follow them, with or without the probe. It goes on while "
     "a source is held or invalid, which registers 2, 41 and 42 say; wraps",
     of<&Snapshot::heartbeat>},
    {address::correction_i16, "XYZ correction", i16, 0.1, "um", read,
     "machine axes, radius; add it to the commanded position", correction<1000>},
    {address::correction_offset, "XYZ correction", offset_i16, 0.1, "um", read,
     "register 5 + 32768|register 6 + 32768|register 7 + 32768", correction<1000>},
    {11, "age", u16, 0.1, "s", read, "age of the corrections; saturates", age_s},
    {address::mask, "mask", u16, 1, "", read, kSourceBits, of<&Snapshot::mask>},
    {address::correction_f32, "XYZ correction", f32, 1, "mm", read,
     "the value of register 5|the value of register 6|the value of register 7", correction<1>},
    {address::correction_i32, "XYZ correction", i32, 1, "nm", read,
     "the value of register 5|the value of register 6|the value of register 7", correction<1'000'000>},

    {40, "sources good", u16, 1, "", read, "bits as in register 12: all inputs of the source are present and plausible",
     sources<Health::good>},
    {41, "sources held", u16, 1, "", read, "bits as in register 12: in doubt, its last good value is held",
     sources<Health::held>},
    {address::sources_invalid, "sources invalid", u16, 1, "", read,
     "bits as in register 12: an input is missing, or in doubt for longer than the hold time",
     sources<Health::invalid>},
    {43, "axes referenced", u16, 1, "", read, "bit 0 X, 1 Y, 2 Z", bits<&Snapshot::axes, &AxisState::referenced>},
    {44, "XYZ reference fault", u16, 1, "", read,
     "last cause of a lost reference: 0 none, 1 impossible speed, 2 index at the wrong count, 3 encoder lost",
     of<&Snapshot::axes, &AxisState::last_fault>},
    {47, "inhibited", u16, 1, "", read,
     "1 during a cut, by an inhibit line or the inhibit of any line, host or person: no result comes into force. It "
     "follows "
     "a write of register 138 within milliseconds; the inhibit itself holds from the answer on",
     of<&Snapshot::inhibited>},
    {address::settled, "settled", u16, 1, "", read,
     "1 when the correction has reached its target; 0 while the maximum rate limits it", of<&Snapshot::settled>},
    {49, "refused homings", u16, 1, "", read,
     "homings that were taken and then refused, because the axis began to move or its encoder fell silent; wraps",
     wraps16<&Snapshot::refused_homings>},
    {50, "boots", u16, 1, "", read,
     "+1 at every start of the box; wraps. Where it has changed, markers, homings, poses and requests have to be "
     "written "
     "again, and "
     "axes that are not absolute to be homed",
     of<&LineState::boots>},
    {51, "due", u16, 1, "", read,
     "number of subjects that are to be measured again, or were never measured, by [[requirement]] of machine.toml",
     of<&LineState::due>},

    {address::delay_f32, "XYZ system delay", f32, 1, "ms", read,
     "tau = t machine - t probe in force; 0 with sd 0 for an axis whose delay was never measured: status bit 2 is set "
     "when that of every axis was",
     delay<&DelayInForce::tau_s, 1000>},
    {address::delay_sd_f32, "XYZ system delay, sd", f32, 1, "ms", read, "standard deviation (k = 1)",
     delay<&DelayInForce::sd_s, 1000>},
    {address::delay_i32, "XYZ system delay", i32, 1, "ns", read,
     "the value of register 64|the value of register 66|the value of register 68",
     delay<&DelayInForce::tau_s, 1'000'000'000>},
    {86, "XYZ system delay, sd", i32, 1, "ns", read,
     "the value of register 70|the value of register 72|the value of register 74",
     delay<&DelayInForce::sd_s, 1'000'000'000>},
    {address::delay_result, "delay result", u32, 1, "", read,
     "number of the result about a delay that came into force last; 0 when there is none. Each axis keeps the delay of "
     "the "
     "last result that observed it",
     wraps32<&Snapshot::delay, &DelayInForce::result_id>},

    {address::calibration_state, "calibration state", u16, 1, "", read,
     "the last calibration: 0 idle, 1 running, 2 proposed, 3 accepted, 4 refused, 5 aborted", calibrationState},
    {address::calibration_method, "calibration method", u16, 1, "", read, "number of its method; 0 when there was none",
     of<&Snapshot::calibration_method>},
    {address::calibration_run, "calibration run", u32, 1, "", read, "number of its run, for register 144",
     of<&Snapshot::calibration_run>},
    {address::calibration_step, "calibration step", u16, 1, "", read, "number of the next step, from 0",
     of<&Snapshot::calibration_step>},
    {101, "calibration steps", u16, 1, "", read, "number of steps", of<&Snapshot::calibration_steps>},
    {address::calibration_result, "calibration result", u32, 1, "", read,
     "number of the stored result or refusal; 0 when there is none yet", wraps32<&Snapshot::calibration_result_id>},

    {address::calibration_refusal, "calibration refusal", u16, 1, "", read,
     "why the last run was refused, a code of the list below; 0 when it was not", of<&LineState::calibration_refusal>},

    {112, "clock state", u16, 1, "", read, "0 unlocked, 1 locked, 2 holdover, 3 ambiguous",
     of<&Snapshot::clock, &ClockStatus::state>},
    {114, "clock sigma", u32, 1, "ns", read,
     "standard deviation (k = 1) of the master clock's ticks; among the samples, where the sync line is on the "
     "receiver",
     of<&Snapshot::clock, &ClockStatus::sigma_ns>},
    {address::samples_produced, "samples produced", u32, 1, "", read, "modulo 2^32",
     wraps32<&Snapshot::ledger, &Ledger::produced>},
    {address::samples_lost_at_source, "samples lost at the source", u32, 1, "", read, "modulo 2^32",
     wraps32<&Snapshot::ledger, &Ledger::lost_at_source>},
    {address::samples_lost_in_queue, "samples lost in the queue", u32, 1, "", read, "modulo 2^32",
     wraps32<&Snapshot::ledger, &Ledger::lost_in_queue>},
    {122, "clock sigma, absolute", u32, 1, "ns", read,
     "standard deviation (k = 1) of the ticks on the clock of the box's computer; 4000000000: not known",
     of<&Snapshot::clock, &ClockStatus::absolute_sigma_ns>},

    {address::word_order, "word order", u16, 1, "", write,
     "order of the words of all 32-bit values on this line: 0 high word first (until it is written), 1 low word first; "
     "kept "
     "over restarts of the box and an unplugged adapter"},

    {address::home_position, "homing: XYZ position", i32, 0.0001, "mm", write,
     "machine position of the axis at standstill, within its travel"},
    {address::home_axes, "homing: axes", u16, 1, "", write, "axes to reference: bit 0 X, 1 Y, 2 Z"},
    {address::home_commit, "homing: commit", u16, 1, "", write,
     "write a number from 1 to 65535 that differs from the present one: the axes of register 136 are referenced at the "
     "positions in registers 130 to 135; they must be at standstill"},
    {address::inhibit, "inhibit", u16, 1, "", write,
     "write 1 at the begin of a cut: no result comes into force. This line's own inhibit, beside those of other lines, "
     "hosts "
     "and persons (register 47 has them all). It remains set when this line goes silent, is unplugged or the box "
     "restarts, "
     "until 0 is written or a person clears it by name (`probebox inhibit`)"},

    {address::marker_run, "marker: run", u32, 1, "", write, "number of the calibration run of the step"},
    {address::marker_step, "marker: step", u16, 1, "", write, "step of the run, from 0"},
    {address::marker_phase, "marker: phase", u16, 1, "", write,
     "0 begin, 1 end, 2 abandon (the step is repeated), 3 pass: in a dry run the motion of the step was made in the "
     "air; "
     "nothing is recorded, and after the last step the first one is asked for again, to be measured. A dry run comes "
     "before the first begin marker, and goes through all steps that are known then"},
    {address::marker_speed, "marker: nominal speed", u16, 0.1, "mm/s", write, "commanded measuring speed of the step"},
    {address::marker_tool, "marker: tool", u16, 1, "", write, "tool number, 0 for none"},
    {address::marker_angle, "marker: ABC angle", i32, 0.001, "deg", write, "-3600 to 3600 degrees"},
    {address::marker_at_rest, "marker: at rest", u16, 1, "", write, "1 when all axes are at standstill"},
    {address::marker_commit, "marker: commit", u16, 1, "", write,
     "write a number from 1 to 65535 that differs from the present one: registers 144 to 156 are sent as one marker. "
     "The same number again does nothing, so a request may be repeated when its answer was lost"},

    {159, "turning axis, of", u16, 1, "", read,
     "bit 0 registers 160 to 179 are of a chuck on the Z slide, and the slope is the slide's; 1 the result rests on a "
     "retired one",
     centrelineOf},
    {address::centreline_here, "turning axis, XY", f32, 1, "mm", read,
     "machine position, radius, at the present Z; 0 without a Z reference, or while the encoder of Z is silent for "
     "longer than hold_s of the centreline; 0 and status bit 3 clear when no result is in force",
     centrelineHere},
    {address::centreline_slope, "turning axis, XY over Z", f32, 1, "mm/mm", read,
     "tilt of the turning axis, about Y|as X, about -X", centreline<&CentrelineActivated::slope>},
    {address::centreline_sd, "turning axis, XY, sd", f32, 1, "mm", read, "standard deviation (k = 1) at register 176",
     centreline<&CentrelineActivated::sd_centre_mm>},
    {address::centreline_slope_sd, "turning axis, XY over Z, sd", f32, 1, "mm/mm", read, "standard deviation (k = 1)",
     centreline<&CentrelineActivated::sd_slope>},
    {address::centreline_z, "turning axis, reference Z", f32, 1, "mm", read, "machine Z at which it was measured",
     centreline<&CentrelineActivated::reference_z_mm>},
    {178, "centreline result", u32, 1, "", read, "number of the result in force; 0 when there is none",
     wraps32<&Snapshot::centreline, &CentrelineInForce::result, &CentrelineActivated::result_id>},

    {192, "XYZ screw, offset", f32, 1, "mm", read,
     "correction of the screw = offset + slope (position - reference position), for controllers that compensate by "
     "position",
     of<&Snapshot::axes, &AxisState::screw, &ScrewState::offset_mm>},
    {198, "XYZ screw, slope", f32, 1, "mm/mm", read, "see register 192",
     of<&Snapshot::axes, &AxisState::screw, &ScrewState::slope>},
    {204, "XYZ screw, reference position", f32, 1, "mm", read, "see register 192", constant<0>},
    {210, "XYZ screw, extension", i16, 0.1, "um", read,
     "extension of the whole screw since it was cold; 0 without a sensor",
     of<&Snapshot::axes, &AxisState::screw, &ScrewState::extension_um>},
    {213, "XYZ screw, sensor", u16, 1, "", read, "0 good or not fitted, 1 silent, 2 out of range, 3 unplugged",
     screwFault},

    {216, "triggers", u32, 1, "", read, "number since the box started; the registers up to 231 describe the last one",
     of<&Snapshot::last_trigger, &TriggerStamp::number>},
    {218, "trigger: XYZ position", i32, 0.00001, "mm", read,
     "machine position at the trigger, including the correction; 0 when its bit in register 230 is clear",
     triggerPosition},
    {224, "trigger: XYZ correction", i32, 1, "nm", read,
     "correction at that time: subtract it from measured positions, or it is corrected twice",
     of<&Snapshot::last_trigger, &TriggerStamp::served, &Served::correction_nm>},
    {230, "trigger: state", u16, 1, "", read,
     "bit 0 the correction was valid, 1 it was degraded, 4 X position known, 5 Y, 6 Z", triggerState},
    {231, "trigger: sequence", u16, 1, "", read, "register 3 at that time",
     of<&Snapshot::last_trigger, &TriggerStamp::served, &Served::sequence>},
    {232, "triggers unplaced", u16, 1, "", read, "triggers without a known machine position; wraps",
     wraps16<&Snapshot::unplaced_triggers>},

    {address::pose_angle, "pose: ABC angle", i32, 0.0001, "deg", write,
     "angle of an axis that only the control knows, from -3600 to 3600 deg"},
    {address::pose_told, "pose: told", u16, 1, "", write, "values that are valid: bit 0 A angle, 1 B, 2 C, 3 the tool"},
    {address::pose_tool, "pose: tool", u16, 1, "", write, "its number, 0 for none"},
    {address::pose_tool_length, "pose: tool length", i32, 0.0001, "mm", write,
     "0 to 2000 mm; 0: take the length of assembly-N in force, or of machine.toml where there is none"},
    {address::pose_commit, "pose: commit", u16, 1, "", write,
     "write a number from 1 to 65535 that differs from the present one: the box takes over registers 240 to 248"},

    {256, "angles known", u16, 1, "", read,
     "bit 0 A, 1 B, 2 C: the encoder is referenced, or the control has sent the angle",
     bits<&Snapshot::rotary, &RotaryAxisState::known>},
    {257, "angles in doubt", u16, 1, "", read, "bits as in register 256: no new value for too long",
     bits<&Snapshot::rotary, &RotaryAxisState::doubtful>},
    {258, "ABC angle", f32, 1, "deg", read, "angle that the corrections use; 0 when it is unknown", angle_deg},
    {264, "tool", u16, 1, "", read, "number of the tool in the spindle, as sent last; 0 for none",
     of<&Snapshot::swivel, &SwivelState::tool>},
    {266, "tool length", f32, 1, "mm", read, "0 when it is unknown",
     of<&Snapshot::swivel, &SwivelState::tool_length_mm>},
    {268, "swivel result", u32, 1, "", read, "number of the result in force; 0 when there is none",
     wraps32<&Snapshot::swivel, &SwivelState::result_id>},
    {270, "swivel, XYZ", f32, 1, "mm", read,
     "contribution of the head at the present angle with the present tool; 0 unless the source is good or held",
     of<&Snapshot::swivel, &SwivelState::error_mm>},
    {276, "rotary errors known", u16, 1, "", read,
     "bits as in register 256: a result in force covers the present angle",
     bits<&Snapshot::rotary, &RotaryAxisState::has_errors>},
    {278, "ABC axis result", u32, 1, "", read, "number of the result in force; 0 when there is none",
     wraps32<&Snapshot::rotary, &RotaryAxisState::result_id>},
});

constexpr bool inOrderAndInside() {
  std::size_t free = 0;
  for (const auto& entry : kRegisters) {
    if (entry.address < free) return false;
    free = entry.address + std::max<std::size_t>(1, seriesIn(entry.name).parts.size()) * registersOf(entry.kind);
  }
  return free <= 384;  // the first part of the map
}
static_assert(inOrderAndInside(), "registers are listed by address and do not overlap");

// Rounds to the nearest count and stops at the ends of Count. Nothing sensible stands behind a value that is not a
// number.
template <class Count>
Count saturated(double counts, Count lowest = std::numeric_limits<Count>::min()) {
  if (std::isnan(counts)) return 0;
  const auto highest = static_cast<double>(std::numeric_limits<Count>::max());
  return static_cast<Count>(std::clamp(std::nearbyint(counts), static_cast<double>(lowest), highest));
}

// No register shows an infinity or NaN: a controller may calculate with what it reads.
float finite(double counts) {
  if (std::isnan(counts)) return 0;
  constexpr double kMost = std::numeric_limits<float>::max();
  return static_cast<float>(std::clamp(counts, -kMost, kMost));
}

std::uint32_t bitsOf(Kind kind, double counts) {
  switch (kind) {
    case u16:
      return saturated<std::uint16_t>(counts);
    case i16:
      // -32768 is left out, so that the limits are the same on both sides and in offset binary.
      return static_cast<std::uint16_t>(saturated<std::int16_t>(counts, -32767));
    case offset_i16:
      return static_cast<std::uint32_t>(saturated<std::int16_t>(counts, -32767) + 32768);
    case u32:
      return saturated<std::uint32_t>(counts);
    case i32:
      return static_cast<std::uint32_t>(saturated<std::int32_t>(counts));
    case f32:
      return std::bit_cast<std::uint32_t>(finite(counts));
  }
  return 0;
}

double countsOf(Kind kind, std::uint32_t bits) {
  switch (kind) {
    case i16:
      return static_cast<std::int16_t>(static_cast<std::uint16_t>(bits));
    case offset_i16:
      return static_cast<double>(bits) - 32768;
    case i32:
      return static_cast<std::int32_t>(bits);
    case f32:
      return static_cast<double>(std::bit_cast<float>(bits));
    case u16:
    case u32:
      break;
  }
  return bits;
}

// Meaning of the register `part` of a row.
std::string_view meaningOf(const Register& row, const Series& series, std::size_t part) {
  auto meaning = row.meaning;
  const auto bar = meaning.find('|');
  if (part == 0) return meaning.substr(0, bar);
  if (bar == std::string_view::npos) return kept(std::string{"as "} + series.parts[0]);
  for (std::size_t i = 0; i < part && meaning.find('|') != std::string_view::npos; ++i)
    meaning.remove_prefix(meaning.find('|') + 1);
  return meaning.substr(0, meaning.find('|'));
}

void append(std::vector<Register>& all, const Register& row) {
  const auto series = seriesIn(row.name);
  if (series.parts.empty()) return all.push_back(row);
  for (std::size_t i = 0; i < series.parts.size(); ++i) {
    auto part = row;
    part.address = static_cast<std::uint16_t>(row.address + i * registersOf(row.kind));
    part.part = static_cast<std::uint8_t>(i);
    std::string name{row.name};
    part.name = kept(name.replace(name.find(series.token), series.token.size(), 1, series.parts[i]));
    part.meaning = meaningOf(row, series, i);
    all.push_back(part);
  }
}

// Deviations of what a rotary axis turns, along X, Y, Z and about them: its location and its error motion (EXA to ECC
// of ISO 230-7) together. The sum has no name there; it is called as results call it, "deviation XA".
void appendRotaryErrors(std::vector<Register>& all) {
  constexpr std::uint16_t kErrors = 288, kSds = 324;
  for (std::size_t part = 0; part < 6 * kRotaryAxes; ++part) {
    const bool is_angle = part % 6 >= 3;
    const auto name = std::string{"deviation "} + "XYZABC"[part % 6] + "ABC"[part / 6];
    const auto unit = is_angle ? "rad" : "mm";
    const auto of_part = [&](std::uint16_t first, const std::string& title, std::string_view meaning, ValueOf value) {
      all.push_back({static_cast<std::uint16_t>(first + 2 * part), kept(title), f32, 1, unit, read, meaning, value});
      all.back().part = static_cast<std::uint8_t>(part);
    };
    of_part(kErrors, name,
            part == 0
                ? "along X, of the table turned by axis A, at the present angle: location (XOA) and error motion (EXA "
                  "of ISO 230-7) together; 0 when its bit in register 276 is clear"
            : part == 3 ? "about X, else as deviation XA"
            : is_angle  ? "as deviation AA"
                        : "as deviation XA",
            rotaryError);
    of_part(kSds, name + ", sd",
            part == 0 ? "standard deviation (k = 1), the largest of all angles" : "as deviation XA, sd", rotaryErrorSd);
  }
}

std::vector<Register> everything() {
  std::vector<Register> all;
  for (const auto& row : kRegisters) append(all, row);
  appendRotaryErrors(all);
  for (const auto& row : procedureRegisters()) append(all, row);
  for (const auto& entry : resultRegisters()) all.push_back(entry);
  std::ranges::sort(all, {}, &Register::address);
  return all;
}

// The same place in the first row, for an address in a table.
std::uint16_t inFirstRow(std::uint16_t address) {
  for (const auto& table : toolTables()) {
    const unsigned offset = address - unsigned{table.first};
    if (address < table.first || offset >= unsigned{kMostToolNumber} * kRegistersOfTool) continue;
    return static_cast<std::uint16_t>(table.first + offset % kRegistersOfTool);
  }
  return address;
}

}  // namespace

std::size_t Register::end() const {
  return address + static_cast<std::size_t>(rows - 1) * row_registers + registersOf(kind);
}

std::span<const Register> registers() {
  static const std::vector<Register> all = everything();
  return all;
}

const Register* covering(std::uint16_t address) {
  const auto first_row = inFirstRow(address);
  const auto all = registers();
  const auto after =
      std::upper_bound(all.begin(), all.end(), first_row,
                       [](std::uint16_t wanted, const Register& entry) { return wanted < entry.address; });
  if (after == all.begin()) return nullptr;
  const auto* entry = &*(after - 1);
  return first_row < entry->address + registersOf(entry->kind) ? entry : nullptr;
}

const Register* find(std::uint16_t address) {
  const auto* entry = covering(address);
  return entry != nullptr && entry->address == inFirstRow(address) ? entry : nullptr;
}

void encode(const Register& entry, double value, WordOrder order, std::span<std::uint16_t> image) {
  encodeAt(entry, entry.address, value, order, image);
}

void encodeAt(const Register& entry, std::uint16_t address, double value, WordOrder order,
              std::span<std::uint16_t> image) {
  const auto bits = bitsOf(entry.kind, value / entry.scale);
  const auto low = static_cast<std::uint16_t>(bits);
  if (registersOf(entry.kind) == 1) {
    image[address] = low;
    return;
  }
  const auto first = order == WordOrder::high_first ? 0U : 1U;
  image[address + first] = static_cast<std::uint16_t>(bits >> 16);
  image[address + 1U - first] = low;
}

double decode(const Register& entry, WordOrder order, std::span<const std::uint16_t> image) {
  const auto first = image[entry.address];
  if (registersOf(entry.kind) == 1) return countsOf(entry.kind, first) * entry.scale;
  const auto second = image[entry.address + 1U];
  const auto high = order == WordOrder::high_first ? first : second;
  const auto low = order == WordOrder::high_first ? second : first;
  return countsOf(entry.kind, static_cast<std::uint32_t>(high) << 16 | low) * entry.scale;
}

}  // namespace probebox::modbus
