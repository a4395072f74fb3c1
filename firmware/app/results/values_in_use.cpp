#include "firmware/app/results/values_in_use.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "firmware/app/results/result_events.hpp"
#include "firmware/app/results/result_values.hpp"
#include "firmware/metrology/centreline/axis_alignment.hpp"
#include "firmware/metrology/centreline/centreline_x.hpp"
#include "firmware/metrology/centreline/check_quantities.hpp"
#include "firmware/metrology/dataset/quantity.hpp"
#include "firmware/metrology/dataset/subject.hpp"
#include "firmware/metrology/methods.hpp"
#include "firmware/metrology/screw/screw_calibration.hpp"
#include "firmware/metrology/tool/tool_setter.hpp"
#include "protocol/units/result_keys.hpp"

namespace probebox::app {
namespace {

namespace quantity = metrology::quantity;

using messages::ValueInUse;
using messages::ValueSource;

// Largest uncertainty among the first `count` values; 0 if none is stated.
double largestSd(const metrology::Estimate& estimate, std::size_t count) {
  const auto sd = uncertaintiesOf(estimate);
  return sd.empty() ? 0.0 : std::ranges::max(sd.first(std::min(count, sd.size())));
}

std::optional<procedure::ScrewFace> faceOf(const store::Record& record) {
  const auto* table = record.result()->find(quantity::kSectorTable.key);
  if (table == nullptr) return std::nullopt;
  return procedure::ScrewFace{
      .result_id = record.id, .sector_um = table->values, .sd_um = largestSd(*table, table->values.size())};
}

// Turning axis of a lathe of X and Z, whose Y counts as 0.
std::optional<procedure::TurningAxis> turningAxisInX(const store::Record& record) {
  const auto* centre = record.result()->find(quantity::kCentreX.key);
  if (centre == nullptr) return std::nullopt;
  procedure::TurningAxis axis{.result_id = record.id, .at_mm = {centre->value(), 0}, .sd_mm = largestSd(*centre, 1)};
  const auto* slope = record.result()->find(quantity::kCTiltX.key);
  const auto* height = record.result()->find(quantity::kMeanHeight.key);
  if (slope == nullptr || height == nullptr) return axis;
  axis.z_mm = height->value();
  axis.tilt_rad = {slope->value(), 0};
  axis.sd_tilt_rad = largestSd(*slope, 1);
  return axis;
}

// Turning axis by a centreline result from the spindle axis; a result from two heights states its tilt.
std::optional<procedure::TurningAxis> turningAxisOf(const store::Record& record) {
  const auto* centre = record.result()->find(quantity::kCentre.key);
  if (centre == nullptr) return turningAxisInX(record);
  if (centre->values.size() != 2) return std::nullopt;
  procedure::TurningAxis axis{
      .result_id = record.id, .at_mm = {centre->values[0], centre->values[1]}, .sd_mm = largestSd(*centre, 2)};
  const auto* tilt = record.result()->find(quantity::kCTilt.key);
  const auto* height = record.result()->find(quantity::kMeanHeight.key);
  if (tilt == nullptr || height == nullptr || tilt->values.size() != 2) return axis;
  axis.z_mm = height->value();
  axis.tilt_rad = {tilt->values[0], tilt->values[1]};
  axis.sd_tilt_rad = largestSd(*tilt, 2);
  return axis;
}

// With the type A uncertainty: the next check uses the same ball, so the type B part cancels.
std::optional<procedure::AcceptedValue> acceptedOf(const metrology::Result& result, std::string_view key,
                                                   std::size_t at = 0) {
  const auto* estimate = result.find(key);
  if (estimate == nullptr || at >= estimate->values.size()) return std::nullopt;
  return procedure::AcceptedValue{.mm = estimate->values[at], .sd_mm = at < estimate->sd.size() ? estimate->sd[at] : 0};
}

// x_offset_error_mm counts from the axis that was accepted before this check; the next one counts from its own.
std::optional<procedure::AcceptedValue> acceptedXAt90(const metrology::Result& result) {
  auto accepted = acceptedOf(result, metrology::kXAt90.key);
  const auto* moved = result.find(std::string{quantity::kDeviation.key} + std::string{metrology::kXAtLevel.key});
  if (accepted && moved != nullptr) accepted->mm -= moved->value();
  return accepted;
}

// A result is about one plane, and has the two coordinates in it.
std::array<std::optional<procedure::AcceptedValue>, 3> tablePivotOf(const metrology::Result& result) {
  struct Plane {
    std::string_view key;
    std::array<std::size_t, 2> axes;
  };
  constexpr std::array<Plane, 3> kPlanes{
      {{result_key::kPivotXz, {0, 2}}, {result_key::kPivotYz, {1, 2}}, {result_key::kPivotXy, {0, 1}}}};
  std::array<std::optional<procedure::AcceptedValue>, 3> pivot;
  for (const auto& [key, axes] : kPlanes) {
    const auto* found = result.find(key);
    if (found == nullptr || found->values.size() != axes.size()) continue;
    const auto sd_mm = uncertaintiesOf(*found);
    for (std::size_t i = 0; i < axes.size(); ++i)
      pivot.at(axes.at(i)) = {.mm = found->values[i], .sd_mm = i < sd_mm.size() ? sd_mm[i] : 0};
  }
  return pivot;
}

// Place of the tool setter. A lathe of X and Z measures the two, each under a key of its own.
void addSetter(const store::Record& record, MeasuredFacts& facts) {
  const auto* setter = record.result()->find(quantity::kSetter.key);
  if (setter != nullptr && setter->values.size() >= 3) {
    facts.setter_result = record.id;
    facts.setter_mm = {setter->values[0], setter->values[1], setter->values[2]};
    facts.sd_setter_mm = largestSd(*setter, 3);
    facts.setter_tells_y = true;
    return;
  }
  const auto* x = record.result()->find(quantity::kSetterX.key);
  const auto* z = record.result()->find(quantity::kSetterZ.key);
  if (x == nullptr || z == nullptr) return;
  facts.setter_result = record.id;
  facts.setter_mm = {x->value(), 0, z->value()};
  facts.sd_setter_mm = std::max(largestSd(*x, 1), largestSd(*z, 1));
  facts.setter_tells_y = false;
}

// The largest of the axes, with its uncertainty.
std::vector<procedure::MeasuredError> machineErrorsOf(const metrology::Result& result) {
  std::vector<procedure::MeasuredError> found;
  for (const auto& estimate : result.estimates) {
    const auto* quantity = metrology::quantityOf(estimate.key);
    if (quantity == nullptr || quantity->measures.error == nullptr) continue;
    const auto& [error, factor] = quantity->measures;
    const auto sd = uncertaintiesOf(estimate);
    double largest = 0;
    for (std::size_t k = 0; k < estimate.values.size(); ++k)
      largest = std::max(largest, factor * std::hypot(estimate.values[k], k < sd.size() ? sd[k] : 0));
    found.push_back({error, std::min(largest, error->most)});
  }
  return found;
}

}  // namespace

void addFacts(const store::Record& record, MeasuredFacts& facts) {
  const auto* result = record.result();
  if (result == nullptr) return;
  if (isAbout(record.binding.subject, SubjectKind::check)) {
    facts.check_result = record.id;
    facts.ball_x = acceptedOf(*result, metrology::kXAtLevel.key);
    facts.ball_y = acceptedOf(*result, metrology::kYAtLevel.key);
    facts.ball_y45 = acceptedOf(*result, metrology::kYAt45.key);
    facts.ball_y90 = acceptedOf(*result, metrology::kYAt90.key);
    facts.ball_x90 = acceptedXAt90(*result);
    facts.ball_z90 = acceptedOf(*result, metrology::kZAt90.key);
    facts.ball_z = acceptedOf(*result, metrology::quantity::kBallCentre, 2);
    if (!facts.ball_z) facts.ball_z = acceptedOf(*result, metrology::quantity::kBallCentreZ);
  }
  if (const auto screw = parseSubject(record.binding.subject, SubjectKind::screw))
    facts.screw_faces[screw->axis()] = faceOf(record);
  if (const auto length = measuredLengthOf(record)) facts.tool_lengths.push_back(*length);
  if (const auto tip = measuredTipOf(record)) facts.tool_tips.push_back(*tip);
  if (isAbout(record.binding.subject, SubjectKind::machine)) {
    facts.machine_check_result = record.id;
    facts.machine_errors = machineErrorsOf(*result);
  }
  if (isAbout(record.binding.subject, SubjectKind::spindle_tilt)) {
    const auto* tilt = result->find(quantity::kSpindleTilt.key);
    if (tilt != nullptr && tilt->values.size() == 2) {
      facts.spindle_tilt_rad = {tilt->values[0], tilt->values[1]};
      facts.sd_spindle_tilt_rad = largestSd(*tilt, 2);
    }
  }
  if (isAbout(record.binding.subject, SubjectKind::table_pivot)) {
    facts.table_pivot_result = record.id;
    facts.table_pivot = tablePivotOf(*result);
  }
  if (isAbout(record.binding.subject, SubjectKind::stylus_offset)) {
    if (const auto offset = stylusOffsetOf(*result))
      facts.styli.push_back({.result_id = record.id,
                             .tool = probeToolOf(*result),
                             .at_mm = {offset->values[0], offset->values[1]},
                             .sd_mm = largestSd(*offset, 2)});
  }
  if (record.binding.subject == text(Subject{SubjectKind::centreline})) facts.turning_axis = turningAxisOf(record);
  if (isAbout(record.binding.subject, SubjectKind::pre_travel)) {
    if (const auto found = preTravelOf(record)) facts.pre_travels.push_back(*found);
  }
  if (isAbout(record.binding.subject, SubjectKind::setter)) addSetter(record, facts);
}

std::vector<ValueInUse> valuesInUse(const procedure::Facts& described, std::span<const InForceAbout> in_force) {
  std::vector<ValueInUse> values;
  for (const auto& [subject, id] : in_force)
    values.push_back({.name = subject, .source = ValueSource::result, .result_id = id});
  const auto unlessMeasured = [&](const std::string& subject, ValueSource source) {
    if (std::ranges::find(in_force, subject, &InForceAbout::subject) == in_force.end())
      values.push_back({.name = subject, .source = source, .result_id = 0});
  };
  // A box with a touch-trigger probe can measure neither of the two, and needs neither.
  const bool scans = !described.trigger_probe;
  const auto isDelay = [](const InForceAbout& each) { return isAbout(each.subject, SubjectKind::delay); };
  if (scans && std::ranges::none_of(in_force, isDelay)) unlessMeasured("delay", ValueSource::unknown);
  for (std::size_t axis = 0; axis < described.screws.size(); ++axis) {
    if (!described.screws[axis]) continue;
    unlessMeasured(text(aboutAxis(SubjectKind::screw, axis)), ValueSource::description);
    unlessMeasured(text(aboutAxis(SubjectKind::screw_reference, axis)), ValueSource::description);
  }
  if (described.checked_ball) unlessMeasured(text(Subject{SubjectKind::check}), ValueSource::description);
  if (described.tool_setter)
    unlessMeasured(text(Subject{SubjectKind::setter}),
                   described.tool_setter->accepted_mm ? ValueSource::description : ValueSource::unknown);
  const auto& carriers = described.probe_tools;
  for (std::size_t i = 0; i < carriers.count; ++i)
    unlessMeasured(text(Subject{SubjectKind::assembly, carriers.numbers.at(i)}), ValueSource::description);
  if (described.trigger_probe) {
    unlessMeasured(text(Subject{SubjectKind::pre_travel}), ValueSource::unknown);
    // swivel-error reads with several tools.
    const auto tools = described.swivel_head ? described.carriers() : std::vector<std::uint32_t>{};
    for (std::size_t i = 0; tools.size() > 1 && i < tools.size(); ++i)
      unlessMeasured(text(Subject{SubjectKind::pre_travel, tools[i]}), ValueSource::unknown);
  }
  if (described.sensor_head && scans)
    unlessMeasured(text(Subject{SubjectKind::sensor_head, described.sensor_head->tool}), ValueSource::unknown);
  return values;
}

}  // namespace probebox::app
