#include "host-tests/emulation/register_link.hpp"

#include <algorithm>
#include <cmath>

#include "protocol/units/angle.hpp"

namespace probebox::scenario {
namespace {

namespace address = modbus::address;

}  // namespace

double RegisterLink::value(std::uint16_t at) {
  const auto& entry = *modbus::find(at);
  const auto words = registers_.read(at, modbus::registersOf(entry.kind));
  std::ranges::copy(words, image_.begin() + entry.address);  // of a table's row, that of the first
  return modbus::decode(entry, modbus::WordOrder::high_first, image_);
}

bool RegisterLink::write(std::uint16_t first, const std::vector<double>& values) {
  auto at = first;
  for (const double value : values) {
    const auto& entry = *modbus::find(at);
    modbus::encode(entry, value, modbus::WordOrder::high_first, image_);
    at = static_cast<std::uint16_t>(at + modbus::registersOf(entry.kind));
  }
  return registers_.write(first, std::span{image_}.subspan(first, at - first));
}

void RegisterLink::postMarker(const Marker& marker) {
  // The same marker again, because no answer came: the same number, which the box does once.
  if (marker.at != posted_) ++marker_commit_;
  if (marker_commit_ == 0) ++marker_commit_;
  posted_ = marker.at;
  const auto& [a, b, c] = marker.rotary_angles_rad;
  taken_ = write(address::marker_run, {marker.procedure * 1.0, marker.step * 1.0, static_cast<double>(marker.phase),
                                       marker.nominal_speed_mm_s, marker.tool * 1.0, a / kDegree, b / kDegree,
                                       c / kDegree, marker.at_rest ? 1.0 : 0.0, marker_commit_ * 1.0});
}

void RegisterLink::home(const world::Vector3& position_mm) {
  write(address::home_position, {position_mm[0], position_mm[1], position_mm[2], 7, ++home_commit_ * 1.0});
}

world::Vector3 RegisterLink::vector(std::uint16_t at) {
  const auto next = [&](unsigned offset) { return value(static_cast<std::uint16_t>(at + offset)); };
  return {next(0), next(2), next(4)};
}

ScanPath RegisterLink::scan(double reach_mm) {
  const auto row = [](std::uint16_t first, std::size_t i) { return static_cast<std::uint16_t>(first + 2 * i); };
  const auto bits = static_cast<unsigned>(value(address::step_scan_bits));
  ScanPath path{.start_rad = value(address::step_scan_start) * kDegree,
                .ramp_rad = value(address::step_scan_ramp) * kDegree,
                .sense = (bits & 1U) != 0 ? -1.0 : 1.0,
                .chords = (bits & 2U) != 0,
                .count = static_cast<std::uint8_t>(value(address::step_scan_arcs))};
  for (std::size_t i = 0; i < path.depths_mm.size(); ++i)
    path.depths_mm[i] = reach_mm - value(row(address::step_scan_radius, i));
  for (std::size_t i = 0; i < path.count; ++i) path.arcs_rad.at(i) = value(row(address::step_scan_arc, i)) * kDegree;
  return path;
}

std::optional<world::Prompt> RegisterLink::procedureStatus() {
  const auto number = [this](std::uint16_t at) { return static_cast<std::uint32_t>(value(at)); };
  world::Prompt prompt{
      {}, number(address::step_run), static_cast<RunState>(number(address::step_state)), number(address::step_number)};
  prompt.referenced = (number(address::status) & published::kReferenced) != 0;
  const auto bits = number(address::step_bits);
  if ((bits & 1U) == 0) return prompt;
  prompt.outward_normal = vector(address::step_normal);
  prompt.retract_direction = vector(address::step_retract);
  for (std::size_t i = 0; i < 3; ++i) prompt.approach_direction[i] = -prompt.retract_direction[i];
  prompt.nominal_speed_mm_s = value(address::step_speed);
  prompt.overtravel_mm = value(address::step_overtravel);
  prompt.clearance_mm = value(address::step_clearance);
  prompt.run_out_mm = value(address::step_run_out);
  prompt.kind = static_cast<world::StepKind>(number(address::step_kind));
  prompt.feature = static_cast<world::StepFeature>(number(address::step_feature));
  prompt.ball = static_cast<std::uint16_t>(number(address::step_ball));
  prompt.turns = (bits & 2U) != 0;
  for (std::size_t i = 0; i < 3; ++i) prompt.rotary_angles_rad[i] = vector(address::step_angle)[i] * kDegree;
  prompt.b_moves = (bits & 4U) != 0   ? world::BMoves::table
                   : (bits & 8U) != 0 ? world::BMoves::head
                                      : world::BMoves::nothing;
  prompt.travel_mm = value(address::step_travel);
  prompt.tool = number(address::step_tool);
  prompt.shank_height_mm = value(address::step_shank);
  prompt.rest_s = value(address::step_rest);
  prompt.scan = scan(std::hypot(vector(address::step_target)[0], vector(address::step_target)[1]));
  prompt.turn_line_rad = value(address::step_turn_line) * kDegree;
  prompt.turn_to_rad = value(address::step_turn_to) * kDegree;
  prompt.turn_speed_rad_s = value(address::step_turn_speed) * kDegree;
  prompt.mount = static_cast<std::uint16_t>(number(address::step_mount));
  return prompt;
}

}  // namespace probebox::scenario
