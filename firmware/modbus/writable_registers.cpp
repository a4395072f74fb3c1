#include "firmware/modbus/writable_registers.hpp"

#include <algorithm>
#include <cmath>

#include "protocol/units/angle.hpp"
#include "protocol/units/tolerances.hpp"

namespace probebox::modbus {
namespace {

double valueAt(std::size_t address, std::span<const std::uint16_t> words) {
  const auto order = static_cast<WordOrder>(words[address::word_order]);
  return decode(*find(static_cast<std::uint16_t>(address)), order, words);
}

bool writable(std::size_t address) {
  const auto* entry = covering(static_cast<std::uint16_t>(address));
  return entry != nullptr && entry->access == Access::write;
}

}  // namespace

Outcome<std::vector<Event>, WriteRefusal> WritableRegisters::write(std::uint16_t first,
                                                                   std::span<const std::uint16_t> values) {
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (first + i < kRegisterCount && writable(first + i)) continue;
    return WriteRefusal{ExceptionCode::illegal_address, "a register that cannot be written"};
  }
  auto words = words_;
  std::copy(values.begin(), values.end(), words.begin() + first);
  const auto changed = [&](std::size_t address) { return words[address] != words_[address]; };
  const auto covers = [&](std::size_t address) { return address >= first && address < first + values.size(); };
  if (const auto refusal = check(words)) return *refusal;
  if (const auto refusal = checkWhole(words, first, values.size())) return *refusal;
  // The marker first: it alone may be one that the box does not want.
  std::vector<Event> asked;
  if (changed(address::marker_commit)) {
    if (const auto refusal = checkMarker(words)) return *refusal;
    asked.push_back(markerOf(words));
  }
  // Also when it changes nothing: what reads 1 or 0 may not be on the disk yet, or not with the core.
  if (covers(address::inhibit)) asked.push_back(CutInhibit{.active = words[address::inhibit] == 1, .at = {}});
  if (changed(address::home_commit)) {
    if (const auto refusal = checkHoming(words)) return *refusal;
    for (std::size_t axis = 0; axis < kLinearAxes; ++axis) {
      if ((unsigned{words[address::home_axes]} >> axis & 1U) == 0) continue;
      asked.push_back(AxisHomed{
          .axis = static_cast<Axis>(axis), .position_mm = valueAt(address::home_position + 2 * axis, words), .at = {}});
    }
  }
  if (changed(address::request_commit)) {
    if (const auto refusal = checkRequest(words)) return *refusal;
  }
  if (changed(address::pose_commit)) {
    if (const auto refusal = checkPose(words)) return *refusal;
    asked.push_back(poseOf(words));
  }
  words_ = words;
  return asked;
}

void WritableRegisters::restore(WordOrder order, bool inhibits) {
  words_[address::word_order] = static_cast<std::uint16_t>(order);
  words_[address::inhibit] = inhibits ? 1 : 0;
}

std::optional<WriteRefusal> WritableRegisters::check(const Words& words) {
  const auto refuse = [](std::string_view reason) { return WriteRefusal{ExceptionCode::illegal_value, reason}; };
  if (words[address::word_order] > 1) return refuse("word order is 0 or 1");
  if (words[address::marker_phase] > 3) return refuse("the phase of a marker is 0, 1, 2 or 3");
  if (words[address::marker_at_rest] > 1) return refuse("at rest is 0 or 1");
  if (words[address::inhibit] > 1) return refuse("inhibit is 0 or 1");
  if (words[address::home_axes] > 7) return refuse("the axes that were homed are bits 0 to 2");
  if (words[address::pose_told] > 15) return refuse("the content of a pose is bits 0 to 3");
  if (words[address::request_speeds] > kMostSpeeds) return refuse("a run has up to 8 speeds");
  if (words[address::request_read_by] > 2) return refuse("read by is 0 the tip, 1 a sensor head, 2 the shank too");
  if (words[address::request_axis] > 6) return refuse("the axis is 0 to 6");
  if (words[address::request_contacts] > 1) return refuse("contacts is 0 or 1");
  if (words[address::request_what] > 4) return refuse("a request is 1 start, 2 abort, 3 or 4 accept");
  if (words[address::request_spindle] > 2) return refuse("there are two chucks at most");
  if (words[address::request_mounts] > 255) return refuse("there are up to 255 mounts");
  return std::nullopt;
}

std::optional<WriteRefusal> WritableRegisters::checkHoming(const Words& words) {
  if (words[address::home_commit] == 0)
    return WriteRefusal{ExceptionCode::illegal_value, "a homing is committed by a number from 1 to 65535"};
  if (words[address::home_axes] == 0)
    return WriteRefusal{ExceptionCode::illegal_value, "register 136 names no axis that was homed"};
  return std::nullopt;
}

// A value in two registers may be half written before the commit, but not now.
std::optional<WriteRefusal> WritableRegisters::checkMarker(const Words& words) {
  if (words[address::marker_commit] == 0) {
    return WriteRefusal{ExceptionCode::illegal_value, "a marker is committed by a number from 1 to 65535"};
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (std::abs(valueAt(address::marker_angle + 2 * axis, words)) <= kMostTurn_deg) continue;
    return WriteRefusal{ExceptionCode::illegal_value, "an angle of a marker is from -3600 to 3600 degrees"};
  }
  return std::nullopt;
}

std::optional<WriteRefusal> WritableRegisters::checkPose(const Words& words) {
  if (words[address::pose_commit] == 0)
    return WriteRefusal{ExceptionCode::illegal_value, "a pose is committed by a number from 1 to 65535"};
  if (words[address::pose_told] == 0)
    return WriteRefusal{ExceptionCode::illegal_value, "register 246 is 0: the pose contains no values"};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const bool is_told = (unsigned{words[address::pose_told]} >> axis & 1U) != 0;
    if (is_told && std::abs(valueAt(address::pose_angle + 2 * axis, words)) > kMostTurn_deg)
      return WriteRefusal{ExceptionCode::illegal_value, "an angle of a pose is from -3600 to 3600 degrees"};
  }
  const double length_mm = valueAt(address::pose_tool_length, words);
  if (length_mm < 0 || length_mm > kMostToolLength_mm)
    return WriteRefusal{ExceptionCode::illegal_value, "the length of a tool is from 0 to 2000 mm"};
  return std::nullopt;
}

// 32-bit values that this write has both words of: half of one may stand there until its other half comes, and its
// commit register is checked then.
std::optional<WriteRefusal> WritableRegisters::checkWhole(const Words& words, std::uint16_t first, std::size_t count) {
  const auto wrote = [&](std::size_t address) { return address >= first && address + 1 < first + count; };
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t marker = address::marker_angle + 2 * axis, pose = address::pose_angle + 2 * axis;
    if (wrote(marker) && std::abs(valueAt(marker, words)) > kMostTurn_deg)
      return WriteRefusal{ExceptionCode::illegal_value, "an angle of a marker is from -3600 to 3600 degrees"};
    if (wrote(pose) && std::abs(valueAt(pose, words)) > kMostTurn_deg)
      return WriteRefusal{ExceptionCode::illegal_value, "an angle of a pose is from -3600 to 3600 degrees"};
  }
  if (!wrote(address::pose_tool_length)) return std::nullopt;
  const double length_mm = valueAt(address::pose_tool_length, words);
  if (length_mm >= 0 && length_mm <= kMostToolLength_mm) return std::nullopt;
  return WriteRefusal{ExceptionCode::illegal_value, "the length of a tool is from 0 to 2000 mm"};
}

std::optional<WriteRefusal> WritableRegisters::checkRequest(const Words& words) {
  if (words[address::request_commit] == 0)
    return WriteRefusal{ExceptionCode::illegal_value, "a request is committed by a number from 1 to 65535"};
  if (words[address::request_what] < 1 || words[address::request_what] > 4)
    return WriteRefusal{ExceptionCode::illegal_value, "a request is 1 start, 2 abort, 3 or 4 accept"};
  return std::nullopt;
}

ControllerRequest WritableRegisters::controllerRequest() const {
  const auto scaled = [&](std::size_t address) { return valueAt(address, words_); };
  ControllerRequest controller_request{.commit = words_[address::request_commit],
                                       .what = static_cast<ControllerRequest::What>(words_[address::request_what]),
                                       .of = static_cast<std::uint32_t>(scaled(address::request_of)),
                                       .method = words_[address::request_method],
                                       .options = {}};
  auto& options = controller_request.options;
  options.speed_count = static_cast<std::uint8_t>(words_[address::request_speeds]);
  for (std::size_t i = 0; i < options.speed_count; ++i) options.speeds_mm_s[i] = scaled(address::request_speed + i);
  options.overtravel_mm = scaled(address::request_overtravel);
  options.clearance_mm = scaled(address::request_clearance);
  options.approach_rad = radians(scaled(address::request_approach));
  options.arc_rad = radians(scaled(address::request_arc));
  options.angles = words_[address::request_angles];
  options.balls = words_[address::request_balls];
  options.axis = static_cast<std::uint8_t>(words_[address::request_axis]);
  options.turns = words_[address::request_turns];
  options.tool = words_[address::request_tool];
  options.head = words_[address::request_read_by] == 1;
  options.shank = words_[address::request_read_by] == 2;
  options.stations = words_[address::request_stations];
  options.mounts = static_cast<std::uint8_t>(words_[address::request_mounts]);
  options.spindle = static_cast<std::uint8_t>(words_[address::request_spindle]);
  options.contacts = words_[address::request_contacts] != 0;
  return controller_request;
}

PoseTold WritableRegisters::poseOf(const Words& words) {
  const unsigned told = words[address::pose_told];
  PoseTold pose{.axes = static_cast<std::uint8_t>(told & 7U),
                .angles_rad = {},
                .has_tool = (told & 8U) != 0,
                .tool = words[address::pose_tool],
                .tool_length_mm = valueAt(address::pose_tool_length, words),
                .at = {}};
  for (std::size_t axis = 0; axis < kRotaryAxes; ++axis)
    pose.angles_rad[axis] = radians(valueAt(address::pose_angle + 2 * axis, words));
  return pose;
}

Marker WritableRegisters::markerOf(const Words& words) {
  Marker marker;
  marker.procedure = static_cast<std::uint32_t>(valueAt(address::marker_run, words));
  marker.step = words[address::marker_step];
  marker.phase = static_cast<MarkerPhase>(words[address::marker_phase]);
  marker.nominal_speed_mm_s = valueAt(address::marker_speed, words);
  marker.tool = words[address::marker_tool];
  for (std::size_t axis = 0; axis < marker.rotary_angles_rad.size(); ++axis) {
    marker.rotary_angles_rad[axis] = radians(valueAt(address::marker_angle + 2 * axis, words));
  }
  marker.at_rest = words[address::marker_at_rest] == 1;
  return marker;
}

void WritableRegisters::show(std::span<std::uint16_t, kRegisterCount> image) const {
  for (const auto& entry : registers()) {
    if (entry.access != Access::write) continue;
    const auto from = words_.begin() + entry.address;
    std::copy(from, from + static_cast<std::ptrdiff_t>(registersOf(entry.kind)), image.begin() + entry.address);
  }
}

}  // namespace probebox::modbus
