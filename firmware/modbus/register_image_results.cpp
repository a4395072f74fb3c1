// The part of the image that is not of one tick: results in force, wishes of the controller, the step to be done.
#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>
#include <string_view>

#include "firmware/modbus/register_image.hpp"
#include "protocol/modbus/refusals.hpp"
#include "protocol/modbus/result_blocks.hpp"
#include "protocol/units/angle.hpp"

namespace probebox::modbus {
namespace {

using published::ServedResult;
using published::ServedValue;

constexpr std::uint8_t kScan = 6;                                       // procedure::Kind
constexpr std::uint8_t kDatumSphere = 0, kPlates = 1, kToolSetter = 3;  // procedure::Feature
constexpr std::size_t kMostBlockValues = 8;

// A value of a block, with its sd; nothing where the result does not have it.
struct Shown {
  double value{}, sd{};
};
std::optional<Shown> shownOf(const ServedResult& result, const BlockValue& wanted) {
  for (const auto& [key, index] : wanted.keys) {
    if (key.empty()) continue;
    const auto found = std::ranges::find(result.values, key, &ServedValue::key);
    if (found == result.values.end() || index >= found->values.size()) continue;
    return Shown{found->values[index], index < found->sd.size() ? found->sd[index] : 0};
  }
  return std::nullopt;
}

double stateOf(const ServedResult& result, std::span<const std::optional<Shown>> shown) {
  unsigned state = kInForce;
  if (result.rests_on_retired) state |= kRestsOnRetired;
  for (std::size_t i = 0; i < shown.size(); ++i) state |= shown[i] ? 1U << (kFirstKnownBit + i) : 0U;
  return state;
}

std::optional<std::uint16_t> toolOf(std::string_view subject, std::string_view prefix) {
  if (!subject.starts_with(prefix)) return std::nullopt;
  const auto digits = subject.substr(prefix.size());
  std::uint16_t tool = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), tool);
  const bool is_row =
      error == std::errc{} && end == digits.data() + digits.size() && tool >= 1 && tool <= kMostToolNumber;
  return is_row ? std::optional{tool} : std::nullopt;
}

// 1 +X, 2 -X, 3 +Y, 4 -Y, 5 +Z, 6 -Z: the axis that the normal is nearest to.
unsigned sideOf(const std::array<double, 3>& normal) {
  const auto most = std::ranges::max_element(normal, {}, [](double part) { return std::abs(part); });
  const auto axis = static_cast<unsigned>(most - normal.begin());
  return 2 * axis + (*most < 0 ? 2U : 1U);
}

// Centre of the stylus' ball at contact, from the centre of the feature; nothing where its size is not known.
std::optional<std::array<double, 3>> targetOf(const published::StepNow& step, const published::KnownFeatures& known) {
  const bool touches = (step.kind <= 1 && step.shank_height_mm == 0) || step.kind == kScan;
  if (!touches) return std::nullopt;
  std::array<double, 3> reach_mm{};
  if (step.feature == kDatumSphere) {
    reach_mm.fill(known.sphere_reach_mm);
  } else if (step.feature == kPlates) {
    // The plates stand about the stylus: their normals point inwards.
    reach_mm.fill(-known.gap_reach_mm);
  } else if (step.feature == kToolSetter && known.has_setter) {
    // A tool ends at its tip, the probe at the centre of its ball.
    for (std::size_t axis = 0; axis < 3; ++axis)
      reach_mm[axis] = known.setter_half_width_mm[axis] + (step.tool == 0 ? known.stylus_radius_mm : 0);
  }
  if (reach_mm == std::array<double, 3>{}) return std::nullopt;
  std::array<double, 3> target_mm{};
  for (std::size_t axis = 0; axis < 3; ++axis) target_mm[axis] = step.outward_normal[axis] * reach_mm[axis];
  return target_mm;
}

}  // namespace

void RegisterImage::fill(const published::Snapshot& snapshot, const published::LineState& line, const Results& results,
                         WordOrder order) {
  fill(snapshot, order);
  putLine(line);
  putStep(snapshot, line.features);
  if (!results) return;
  if (results != shown_ || order != shown_in_) putResults(*results);
  shown_ = results;
  shown_in_ = order;
  putSlide(snapshot, *results);
  const auto run_result = snapshot.calibration_result_id;
  const bool in_force = run_result != 0 && std::ranges::find(results->in_force, run_result, &ServedResult::result_id) !=
                                               results->in_force.end();
  if (in_force && snapshot.calibration == published::CalibrationState::proposed)
    put(address::calibration_state, static_cast<double>(published::CalibrationState::accepted));
}

void RegisterImage::putLine(const published::LineState& line) {
  put(address::boots, line.boots);
  put(address::calibration_refusal, line.calibration_refusal);
  put(address::wish_answered, line.wish.answered);
  put(address::wish_outcome, line.wish.outcome);
  put(address::wish_refusal, line.wish.refusal);
  put(address::wish_number, line.wish.number);
  put(address::wish_waits, line.wish.waits ? 1 : 0);
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis)
    put(address::setter_half_width + 2 * axis, line.features.setter_half_width_mm[axis]);
}

void RegisterImage::putStep(const published::Snapshot& snapshot, const published::KnownFeatures& features) {
  const auto& step = snapshot.step;
  const auto target_mm = step.present ? targetOf(step, features) : std::nullopt;
  const bool has_place = step.present && step.feature == kToolSetter && features.has_setter_place;
  unsigned bits = step.present ? 1U : 0U;
  if (step.turns) bits |= 2U;
  if (step.b_moves != 0) bits |= step.b_moves == 1 ? 4U : 8U;
  if (target_mm) bits |= 16U;
  if (has_place) bits |= 32U;
  put(address::step_state, step.state);
  put(address::step_number, snapshot.calibration_step);
  put(address::step_run, snapshot.calibration_run);
  put(address::step_kind, step.kind);
  put(address::step_feature, step.feature);
  put(address::step_side, step.present ? sideOf(step.outward_normal) : 0);
  put(address::step_ball, step.ball);
  put(address::step_tool, step.tool);
  put(address::step_mount, step.mount);
  put(address::step_bits, bits);
  put(address::step_repeats, step.repeats);
  const unsigned fault = step.timed_out    ? unsigned{refusal::step_never_ended}
                         : step.fault != 0 ? refusal::of_step + unsigned{step.fault}
                                           : 0U;
  put(address::step_fault, fault);
  put(address::step_rest, step.rest_s);
  putScan(step.scan, target_mm ? features.sphere_reach_mm : 0);
  put(address::step_turn_line, degrees(step.turn_line_rad));
  put(address::step_turn_to, degrees(step.turn_to_rad));
  put(address::step_turn_speed, degrees(step.turn_speed_rad_s));
  putTriple(address::step_normal, step.outward_normal, 1);
  putTriple(address::step_retract, step.retract_direction, 1);
  put(address::step_overtravel, step.overtravel_mm);
  put(address::step_clearance, step.clearance_mm);
  put(address::step_run_out, step.run_out_mm);
  put(address::step_speed, step.speed_mm_s);
  put(address::step_travel, step.travel_mm);
  put(address::step_shank, step.shank_height_mm);
  putTriple(address::step_angle, step.angles_rad, 1 / kDegree);
  putTriple(address::step_target, target_mm.value_or(std::array<double, 3>{}), 1);
  const auto& [x, y, z] = features.setter_mm;
  putTriple(address::step_place, has_place ? std::array{x, y, z} : std::array<double, 3>{}, 1);
}

void RegisterImage::putScan(const ScanPath& scan, double reach_mm) {
  put(address::step_scan_arcs, static_cast<double>(scan.count));
  put(address::step_scan_bits, (scan.sense < 0 ? 1 : 0) + (scan.chords ? 2 : 0));
  put(address::step_scan_start, degrees(scan.start_rad));
  put(address::step_scan_ramp, degrees(scan.ramp_rad));
  for (std::size_t i = 0; i < scan.depths_mm.size(); ++i)
    put(address::step_scan_radius + 2 * i, reach_mm > 0 ? reach_mm - scan.depths_mm[i] : 0);
  for (std::size_t i = 0; i < ScanPath::kMostArcs; ++i) put(address::step_scan_arc + 2 * i, degrees(scan.arcs_rad[i]));
}

void RegisterImage::putResults(const published::ServedResults& results) {
  constexpr std::size_t kFirstTable = 1000;
  std::fill(image_.begin() + kFirstTable, image_.end(), std::uint16_t{0});
  static const ServedResult kNone{};
  for (const auto& block : resultBlocks()) {
    const auto found = std::ranges::find(results.in_force, block.subject, &ServedResult::subject);
    const bool exists = found != results.in_force.end();
    const auto& result = exists ? *found : kNone;
    const auto at = addressesOf(block);
    std::array<std::optional<Shown>, kMostBlockValues> shown{};
    std::size_t nm = at.nm;
    for (std::size_t i = 0; i < block.values.size(); ++i) {
      shown[i] = shownOf(result, block.values[i]);
      const Shown value = shown[i].value_or(Shown{});
      put(at.values + 2 * i, value.value);
      put(at.sd + 2 * i, value.sd);
      if (!block.in_nm || block.values[i].unit != ValueUnit::mm) continue;
      put(nm, value.value * 1e6);
      nm += 2;
    }
    put(at.result, static_cast<double>(result.result_id & 0xFFFFFFFFU));
    put(at.tool, result.probe_tool);
    put(at.state, exists ? stateOf(result, std::span{shown}.first(block.values.size())) : 0);
  }
  for (const auto& table : toolTables()) {
    for (const auto& result : results.in_force) {
      const auto tool = toolOf(result.subject, table.prefix);
      if (!tool) continue;
      const auto at = addressesOf(table);
      const std::size_t row = std::size_t{kRegistersOfTool} * (*tool - 1U);
      std::array<std::optional<Shown>, kMostBlockValues> shown{};
      for (std::size_t i = 0; i < table.values.size(); ++i) {
        shown[i] = shownOf(result, table.values[i]);
        const Shown value = shown[i].value_or(Shown{});
        put(row + at.values + 2 * i, value.value);
        put(row + at.nm + 2 * i, value.value * 1e6);
        put(row + at.sd + i, value.sd * 1e3);
      }
      put(row + at.state, stateOf(result, std::span{shown}.first(table.values.size())));
    }
  }
}

void RegisterImage::putSlide(const published::Snapshot& snapshot, const published::ServedResults& results) {
  const auto id = snapshot.centreline.result.result_id;
  const auto found = std::ranges::find(results.in_force, id, &ServedResult::result_id);
  const bool known = id != 0 && found != results.in_force.end();
  const unsigned slide = known && found->subject == "centreline-slide" ? 1U : 0U;
  const unsigned rests = known && found->rests_on_retired ? kRestsOnRetired : 0U;
  put(address::centreline_of, slide | rests);
}

}  // namespace probebox::modbus
