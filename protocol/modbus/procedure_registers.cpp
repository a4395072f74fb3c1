// The block by which a controller starts a run, does its steps and accepts its result, and what is beside results.
#include <algorithm>
#include <cmath>
#include <optional>
#include <tuple>

#include "protocol/modbus/map.hpp"
#include "protocol/modbus/refusals.hpp"
#include "protocol/modbus/tables.hpp"
#include "protocol/units/angle.hpp"

namespace probebox::modbus {
namespace {

using enum Kind;
using enum Access;
using namespace published;

// 1 +X, 2 -X, 3 +Y, 4 -Y, 5 +Z, 6 -Z: the axis that the normal is nearest to.
double side(const RegisterInputs& inputs, std::size_t) {
  if (!inputs.state.step.present) return 0;
  const auto& normal = inputs.state.step.outward_normal;
  const auto most = std::ranges::max_element(normal, {}, [](double component) { return std::abs(component); });
  return static_cast<double>(2 * (most - normal.begin()) + (*most < 0 ? 2 : 1));
}

// Centre of the stylus' ball at contact, from the centre of the feature; nothing where its size is not known.
std::optional<Vector> targetOf(const StepNow& step, const KnownFeatures& known) {
  const bool touches = ((step.kind == StepKind::touch || step.kind == StepKind::in_out) && step.shank_height_mm == 0) ||
                       step.kind == StepKind::scan;
  if (!step.present || !touches) return std::nullopt;
  Vector reach_mm{};
  if (step.feature == StepFeature::datum_sphere) {
    reach_mm.fill(known.sphere_reach_mm);
  } else if (step.feature == StepFeature::plates) {
    for (std::size_t axis = 0; axis < kLinearAxes; ++axis)
      if (step.outward_normal[axis] != 0) reach_mm[axis] = known.plates_reach_mm[axis];
  } else if (step.feature == StepFeature::cylinder) {
    reach_mm = {known.cylinder_reach_mm, known.cylinder_reach_mm, 0};
  } else if (step.feature == StepFeature::cube) {
    reach_mm = known.cube_reach_mm;
  } else if (step.feature == StepFeature::tool_setter && known.has_setter) {
    // A tool ends at its tip, the probe at the centre of its ball.
    for (std::size_t axis = 0; axis < kLinearAxes; ++axis)
      reach_mm[axis] = known.setter_half_width_mm[axis] + (step.tool == 0 ? known.stylus_radius_mm : 0);
  }
  if (reach_mm == Vector{}) return std::nullopt;
  Vector target_mm{};
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis) target_mm[axis] = step.outward_normal[axis] * reach_mm[axis];
  return target_mm;
}

double target_mm(const RegisterInputs& inputs, std::size_t axis) {
  return targetOf(inputs.state.step, inputs.line.features).value_or(Vector{})[axis];
}

bool hasPlace(const RegisterInputs& inputs) {
  const auto& step = inputs.state.step;
  return step.present && step.feature == StepFeature::tool_setter && inputs.line.features.has_setter_place;
}

double place_mm(const RegisterInputs& inputs, std::size_t axis) {
  return hasPlace(inputs) ? inputs.line.features.setter_mm[axis] : 0;
}

double stepBits(const RegisterInputs& inputs, std::size_t) {
  const auto& step = inputs.state.step;
  unsigned set = step.present ? 1U : 0U;
  if (step.turns) set |= 2U;
  if (step.b_moves != BMoves::nothing) set |= step.b_moves == BMoves::table ? 4U : 8U;
  if (targetOf(step, inputs.line.features)) set |= 16U;
  if (hasPlace(inputs)) set |= 32U;
  return set;
}

double stepFault(const RegisterInputs& inputs, std::size_t) {
  const auto& step = inputs.state.step;
  if (step.timed_out) return refusal::step_never_ended;
  return step.fault != 0 ? refusal::of_step + step.fault : 0;
}

template <auto... path>
double degreesOf(const RegisterInputs& inputs, std::size_t part) {
  return degrees(of<&Snapshot::step, path...>(inputs, part));
}

double scanBits(const RegisterInputs& inputs, std::size_t) {
  const auto& scan = inputs.state.step.scan;
  return (scan.sense < 0 ? 1 : 0) + (scan.chords ? 2 : 0);
}

double scanRadius_mm(const RegisterInputs& inputs, std::size_t part) {
  const auto& [step, features] = std::tie(inputs.state.step, inputs.line.features);
  const double reach_mm = targetOf(step, features) ? features.sphere_reach_mm : 0;
  return reach_mm > 0 ? reach_mm - step.scan.depths_mm[part] : 0;
}

constexpr std::array kProcedureRegisters = std::to_array<Register>({
    {562, "setter, XYZ half width", f32, 1, "mm", read,
     "from the middle of the tool-setting device to its faces, as machine.toml has it",
     of<&LineState::features, &KnownFeatures::setter_half_width_mm>},
    {760, "XYZ screw, cold reading", f32, 1, "um", read,
     "reading of the sensor in use that means no extension (the reference)",
     of<&Snapshot::axes, &AxisState::screw, &ScrewState::reference_um>},

    {address::request_method, "request: method", u16, 1, "", write, "number of the method, see the list below"},
    {address::request_speeds, "request: speeds", u16, 1, "", write,
     "how many of the next eight are chosen; 0: the method's own. In all registers up to 821, 0 is the method's own"},
    {address::request_speed, "request: speed 1..8", u16, 0.1, "mm/s", write, "of the touches|as speed 1"},
    {address::request_overtravel, "request: overtravel", u16, 0.001, "mm", write,
     "depth into the surface after contact"},
    {address::request_clearance, "request: clearance", u16, 0.001, "mm", write,
     "distance from the surface before and after a touch"},
    {address::request_approach, "request: approach", u16, 0.01, "deg", write, "angle between retract and normal"},
    {address::request_arc, "request: arc", u16, 0.01, "deg", write, "range over which the angles of C are spread"},
    {address::request_angles, "request: angles", u16, 1, "", write, "how many angles of C"},
    {address::request_balls, "request: balls", u16, 1, "", write, "how many balls of the rotating part"},
    {address::request_axis, "request: axis", u16, 1, "", write, "1 X, 2 Y, 3 Z: whose screw; 5 B, 6 C: whose errors"},
    {address::request_turns, "request: turns", u16, 1, "", write, "whole turns of the screw"},
    {address::request_tool, "request: tool", u16, 1, "", write, "number of the tool that is measured"},
    {address::request_read_by, "request: read by", u16, 1, "", write,
     "0 the tip of the stylus, 1 a sensor head, 2 the shank too"},
    {address::request_stations, "request: stations", u16, 1, "", write,
     "places at which the balls of a plate are read"},
    {address::request_mounts, "request: mounts", u16, 1, "", write,
     "number of mounts in which the plate is measured on the table, or of clampings of the ball of centreline-x; 0: "
     "the "
     "method's own"},
    {address::request_contacts, "request: contacts", u16, 1, "", write,
     "1: C turns until the ball touches the stylus on either side, before everything else"},
    {address::request_spindle, "request: spindle", u16, 1, "", write,
     "2: the second chuck, for the methods of a turning axis; 0 or 1: the main one"},
    {address::request_of, "request: run or result", u32, 1, "", write,
     "for abort the run (0: whichever is in progress), for accept the result; register 102 has the last one's"},
    {address::request_what, "request: what", u16, 1, "", write,
     "1 start, 2 abort, 3 accept, 4 accept although the answer was code 10"},
    {address::request_commit, "request: commit", u16, 1, "", write,
     "write a number from 1 to 65535 that differs from the present one: the request of registers 800 to 836 is made. "
     "The same "
     "number again does nothing, so it may be repeated when its answer was lost. A master that does not know what "
     "another one "
     "left writes all of these registers, then the present number + 1"},

    {address::request_answered, "request: answered", u16, 1, "", read,
     "commit number of the last request that was answered; the answer is that of register 839 when both are equal",
     of<&LineState::controller_request, &ControllerRequestState::answered>},
    {address::request_outcome, "request: outcome", u16, 1, "", read, "0 none yet, 1 in hand, 2 done, 3 refused",
     of<&LineState::controller_request, &ControllerRequestState::outcome>},
    {address::request_refusal, "request: refusal", u16, 1, "", read, "code of the refusal, see the list below; 0: none",
     of<&LineState::controller_request, &ControllerRequestState::refusal>},
    {address::request_number, "request: number", u32, 1, "", read,
     "the run that was started, or the result that was accepted",
     of<&LineState::controller_request, &ControllerRequestState::number>},
    {address::request_waits, "request: waits", u16, 1, "", read,
     "1: accepted, and comes into force when the cut is over; once it is in force, register 96 is 3",
     of<&LineState::controller_request, &ControllerRequestState::waits>},

    {address::step_state, "step: state", u16, 1, "", read,
     "of the run: 0 idle, 1 waits for the begin marker, 2 recording until the end marker, 3 solving, 4 proposed, 5 "
     "refused, "
     "6 aborted",
     of<&Snapshot::step, &StepNow::state>},
    {address::step_number, "step: number", u16, 1, "", read,
     "for register 146; it rises when the box has taken the step. A scanning probe need not have touched anything for "
     "that: "
     "only solving finds it",
     of<&Snapshot::calibration_step>},
    {address::step_run, "step: run", u32, 1, "", read, "for register 144", of<&Snapshot::calibration_run>},
    {address::step_kind, "step: kind", u16, 1, "", read,
     "0 touch: in, a dwell, out; 1 in and out without a dwell; 2 jog of one axis in free space; 3 sweep: the same at "
     "constant speed; 4 hold: stand still, nothing is touched; 5 rest: stand still anywhere for the time of register "
     "862; 6 scan: in contact all the way along registers 908 to 933; 7 turn: stand beside the nominal line above the "
     "axis of C by the travel along the normal, at the height that the ball's centre has there, turn C from its angle "
     "towards that of register 936 until the ball touches, stop, and turn back. The registers from here on are 0 when "
     "no step is to be done",
     of<&Snapshot::step, &StepNow::kind>},
    {address::step_feature, "step: feature", u16, 1, "", read,
     "0 datum sphere, 1 plates across the axis of the normal, 2 ball on the part, 3 tool-setting device, 4 datum "
     "cylinder, 5 datum cube, 6 ball in the second chuck, whose angle of C register 892 then has",
     of<&Snapshot::step, &StepNow::feature>},
    {854, "step: side", u16, 1, "", read,
     "1 +X, 2 -X, 3 +Y, 4 -Y, 5 +Z, 6 -Z: the machine axis next to the normal of register 864", side},
    {address::step_ball, "step: ball", u16, 1, "", read, "of the part, from 1; 0 for another feature",
     of<&Snapshot::step, &StepNow::ball>},
    {address::step_tool, "step: tool", u16, 1, "", read, "number of the tool; 0: any that carries the probe",
     of<&Snapshot::step, &StepNow::tool>},
    {address::step_mount, "step: mount", u16, 1, "", read,
     "number of the mount of a plate on the table, from 1; 0: leave the plate as it is mounted",
     of<&Snapshot::step, &StepNow::mount>},
    {address::step_bits, "step: bits", u16, 1, "", read,
     "bit 0 a step is to be done, 1 the angles of registers 888 to 893 must be taken, 2 B is the table, 3 B is the "
     "head, "
     "4 the target of registers 896 to 901 is known, 5 the place of registers 902 to 907 is known",
     stepBits},
    {859, "step: repeats", u16, 1, "", read, "times that this step was repeated",
     of<&Snapshot::step, &StepNow::repeats>},
    {address::step_fault, "step: fault", u16, 1, "", read, "why, a code of the list below; 0: it is not repeated",
     stepFault},
    {address::step_rest, "step: rest", f32, 1, "s", read, "of a rest: the time to stand still; 0 for other kinds",
     of<&Snapshot::step, &StepNow::rest_s>},
    {address::step_normal, "step: XYZ normal", f32, 1, "", read,
     "outward normal of the surface; of a jog or sweep its direction; of a turn from the line to the stylus",
     of<&Snapshot::step, &StepNow::outward_normal>},
    {address::step_retract, "step: XYZ retract", f32, 1, "", read,
     "direction of the retract; the approach is its opposite", of<&Snapshot::step, &StepNow::retract_direction>},
    {address::step_overtravel, "step: overtravel", f32, 1, "mm", read, "from contact on, against the retract direction",
     of<&Snapshot::step, &StepNow::overtravel_mm>},
    {address::step_clearance, "step: clearance", f32, 1, "mm", read,
     "distance from the surface at which the approach begins", of<&Snapshot::step, &StepNow::clearance_mm>},
    {address::step_run_out, "step: run-out", f32, 1, "mm", read,
     "distance beyond the clearance over which the retract must keep its speed",
     of<&Snapshot::step, &StepNow::run_out_mm>},
    {address::step_speed, "step: speed", f32, 1, "mm/s", read, "of approach and retract, for register 148",
     of<&Snapshot::step, &StepNow::nominal_speed_mm_s>},
    {address::step_travel, "step: travel", f32, 1, "mm", read,
     "length of a jog or sweep; of a hold the distance from the ball's centre, of a turn from the line",
     of<&Snapshot::step, &StepNow::travel_mm>},
    {address::step_shank, "step: shank height", f32, 1, "mm", read,
     "above the centre of the stylus' ball, where the shank touches; 0: the ball does",
     of<&Snapshot::step, &StepNow::shank_height_mm>},
    {address::step_angle, "step: ABC angle", f32, 1, "deg", read,
     "to be taken before, where bit 1 of register 858 is set; for register 150",
     degreesOf<&StepNow::rotary_angles_rad>},
    {address::step_target, "step: XYZ target", f32, 1, "mm", read,
     "centre of the stylus' ball at contact, from the centre of the feature; where its size is not known (bit 4 of "
     "register 858 "
     "clear) 0, and the control looks for contact",
     target_mm},
    {902, "step: XYZ place", f32, 1, "mm", read,
     "machine position of the feature's centre, where the box knows it: setter and checked ball", place_mm},
    {address::step_scan_arcs, "step: scan arcs", u16, 1, "", read,
     "of a scan, in the plane of X and Y through the centre of the feature: how many of registers 918 to 933 count; 0: "
     "no scan",
     of<&Snapshot::step, &StepNow::scan, &ScanPath::count>},
    {address::step_scan_bits, "step: scan bits", u16, 1, "", read,
     "bit 0 clockwise seen from +Z, 1 straight chords between points at the first radius in place of arcs", scanBits},
    {address::step_scan_start, "step: scan start", f32, 1, "deg", read,
     "direction from the centre to where the scan begins, from X to Y",
     degreesOf<&StepNow::scan, &ScanPath::start_rad>},
    {address::step_scan_ramp, "step: scan ramp", f32, 1, "deg", read,
     "angle over which a straight line leads from the end of an arc to the next one, at the other radius",
     degreesOf<&StepNow::scan, &ScanPath::ramp_rad>},
    {address::step_scan_radius, "step: scan radius 1..2", f32, 1, "mm", read,
     "of the path of the stylus ball's centre about that of the feature: for arcs 1, 3, 5, 7, and for the ends of "
     "chords|the same for arcs 2, 4, 6, 8",
     scanRadius_mm},
    {address::step_scan_arc, "step: scan arc 1..8", f32, 1, "deg", read, "length of the first arc or chord|as arc 1",
     degreesOf<&StepNow::scan, &ScanPath::arcs_rad>},
    {address::step_turn_line, "step: C on the line", f32, 1, "deg", read,
     "of a turn: angle of C at which the ball is near the line above the axis; 0 for other kinds",
     degreesOf<&StepNow::turn_line_rad>},
    {address::step_turn_to, "step: C at most", f32, 1, "deg", read,
     "of a turn: C turns from the angle of register 892 towards this one, and no further; if nothing has touched by "
     "then, it turns back",
     degreesOf<&StepNow::turn_to_rad>},
    {address::step_turn_speed, "step: speed of C", f32, 1, "deg/s", read,
     "of a turn: there and back; after the contact C goes on by the overtravel of register 876, along the ball's path",
     degreesOf<&StepNow::turn_speed_rad_s>},
});

}  // namespace

std::span<const Register> procedureRegisters() {
  return kProcedureRegisters;
}

}  // namespace probebox::modbus
