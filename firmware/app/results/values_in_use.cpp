#include "firmware/app/results/values_in_use.hpp"

#include <algorithm>
#include <string>

#include "firmware/app/results/result_events.hpp"

namespace probebox::app {
namespace {

using messages::ValueInUse;
using messages::ValueSource;

}  // namespace

void addFacts(const store::Record& record, MeasuredFacts& facts) {
  const auto* result = record.result();
  if (result == nullptr) return;
  if (record.binding.subject == "check") {
    const auto* x = result->find("Xcen_B0_mm");
    const auto* y = result->find("Ycen_B0_mm");
    if (x != nullptr && y != nullptr) facts.ball_xy_mm = {x->value(), y->value()};
    if (const auto* ball = result->find("ball_centre_mm"); ball != nullptr && ball->values.size() == 3)
      facts.ball_z_mm = ball->values[2];
  }
  if (record.binding.subject == kPreTravelSubject) {
    if (const auto found = preTravelOf(record)) facts.pre_travel = *found;
  }
  if (record.binding.subject != "setter") return;
  const auto* setter = result->find("setter_mm");
  if (setter == nullptr || setter->values.size() < 3) return;
  facts.setter_mm = {setter->values[0], setter->values[1], setter->values[2]};
  facts.sd_setter_mm = setter->sd.size() < 3 ? 0.0 : *std::max_element(setter->sd.begin(), setter->sd.begin() + 3);
}

std::vector<ValueInUse> valuesInUse(const procedure::Facts& described, std::span<const InForceAbout> in_force) {
  std::vector<ValueInUse> values;
  for (const auto& [subject, id] : in_force)
    values.push_back({.name = subject, .source = ValueSource::result, .result_id = id});
  const auto unlessMeasured = [&](const std::string& subject, ValueSource source) {
    if (std::ranges::find(in_force, subject, &InForceAbout::subject) == in_force.end())
      values.push_back({.name = subject, .source = source, .result_id = 0});
  };
  for (std::size_t axis = 0; axis < described.screws.size(); ++axis) {
    if (described.screws[axis]) unlessMeasured(std::string{"screw-"} + "xyz"[axis], ValueSource::description);
  }
  if (described.checked_ball) unlessMeasured("check", ValueSource::description);
  if (described.tool_setter)
    unlessMeasured("setter", described.tool_setter->accepted_mm ? ValueSource::description : ValueSource::unknown);
  if (described.trigger_probe) unlessMeasured(std::string{kPreTravelSubject}, ValueSource::unknown);
  if (described.sensor_head)
    unlessMeasured("sensor-head-" + std::to_string(described.sensor_head->tool), ValueSource::unknown);
  return values;
}

}  // namespace probebox::app
