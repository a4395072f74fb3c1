#include "firmware/app/results/result_summary.hpp"

#include <algorithm>
#include <string>
#include <string_view>
#include <utility>

#include "firmware/app/results/result_values.hpp"
#include "firmware/metrology/dataset/verdict.hpp"
#include "firmware/metrology/subject_values.hpp"

namespace probebox::app {
namespace {

// Of a check: what it was held against limits with, behind all values.
void appendVerdict(const metrology::Result& result, std::string_view subject,
                   std::vector<messages::NamedValue>& values) {
  if (!metrology::proofAbout(result, subject)) return;
  for (const std::string_view key : {metrology::kVerdict, metrology::kWorstRatio}) {
    const auto* found = result.find(key);
    if (found != nullptr && !found->values.empty())
      values.push_back(
          {.key = std::string{key}, .value = found->value(), .sd = 0, .has_sd = false, .u = 0, .has_u = false});
  }
}

}  // namespace

messages::Trigger wireTrigger(const box::PlacedTrigger& placed) {
  const auto& [number, line, line_sequence, at, has_position, position_mm, served, has_angle, angle_rad] = placed.stamp;
  const auto bitsOf = [](const auto& flags) {
    unsigned bits = 0;
    for (std::size_t axis = 0; axis < flags.size(); ++axis) bits |= flags[axis] ? 1U << axis : 0U;
    return static_cast<std::uint8_t>(bits);
  };
  messages::Trigger trigger{.number = number,
                            .line = line,
                            .line_sequence = line_sequence,
                            .at = at,
                            .tick = placed.tick,
                            .phase_q32 = placed.phase_q32,
                            .sigma_ns = placed.sigma_ns,
                            .clock_state = placed.clock_state,
                            .has_position = bitsOf(has_position),
                            .position_mm = position_mm,
                            .correction_mm = {},
                            .correction_valid = served.valid,
                            .correction_degraded = served.degraded,
                            .sequence = served.sequence,
                            .has_angle = bitsOf(has_angle),
                            .angle_rad = angle_rad};
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis)
    trigger.correction_mm[axis] = served.correction_nm[axis] * 1e-6;
  return trigger;
}

messages::ResultState wireState(store::State state) {
  return static_cast<messages::ResultState>(state);  // the store keeps the numbers of the wire
}

messages::ResultSummary summaryOf(const store::Record& record) {
  messages::ResultSummary summary;
  summary.id = record.id;
  summary.state = wireState(record.state);
  summary.method = record.method;
  summary.subject = record.binding.subject;
  summary.proposed_utc = record.proposed_utc;
  summary.accepted_utc = record.accepted_utc;
  summary.accepted_by = record.accepted_by;
  summary.retired_utc = record.retired_utc;
  summary.probe = record.binding.probe_serial_number;
  summary.machine = record.binding.machine;
  summary.mounting = record.binding.mounting;
  if (const metrology::Result* result = record.result()) {
    auto about = *result;
    about.estimates = metrology::valuesAbout(*result, record.binding.subject);
    appendAll(about, record.binding.subject, summary.values);
    summary.about_count = static_cast<std::uint32_t>(summary.values.size());
    const auto isListed = [&](const metrology::Estimate& each) {
      return std::ranges::find(about.estimates, each.key, &metrology::Estimate::key) != about.estimates.end();
    };
    auto others = *result;
    std::erase_if(others.estimates, isListed);
    appendAll(others, record.binding.subject, summary.values);
    appendVerdict(*result, record.binding.subject, summary.values);
    summary.rms = result->rms;
    summary.rms_unit = metrology::unitOfRms(*result);
    summary.dof = static_cast<std::uint32_t>(result->dof);
    summary.condition = result->condition;
    summary.chi2_reduced = result->chi2_reduced.value_or(0.0);
    summary.warnings = result->warnings;
  }
  return summary;
}

bool keepValues(messages::ResultSummary& summary, std::uint32_t first, std::size_t most_bytes) {
  auto values = std::move(summary.values);
  summary.values.clear();
  summary.value_count = static_cast<std::uint32_t>(values.size());
  summary.first_value = std::min(first, summary.value_count);
  std::size_t cut_off = 0;
  for (; messages::encodedSize(summary) > most_bytes / 2 && !summary.warnings.empty(); ++cut_off)
    summary.warnings.pop_back();
  if (cut_off > 0) summary.warnings.push_back("and " + std::to_string(cut_off) + " more warnings");
  std::size_t bytes = messages::encodedSize(summary);
  std::size_t next = summary.first_value;
  for (; next < values.size(); ++next) {
    bytes += messages::encodedSize(values[next]) + sizeof(std::uint16_t);
    if (bytes > most_bytes) break;
    summary.values.push_back(std::move(values[next]));
  }
  return next == values.size();
}

messages::ResultTransition wireTransition(const store::Transition& transition) {
  const auto& binding = transition.binding;
  return {.number = transition.number,
          .result_id = transition.result,
          .method = transition.method,
          .subject = binding.subject,
          .probe = binding.probe_serial_number,
          .machine = binding.machine,
          .mounting = binding.mounting,
          .state = wireState(transition.to),
          .utc = transition.utc,
          .by = transition.by,
          .remark = transition.remark};
}

messages::Corrections::Answer correctionsAnswer(const box::State& state, std::vector<messages::ValueInUse> in_use) {
  const auto& swivel = state.snapshot.swivel;
  messages::Corrections::Answer answer{state.snapshot};
  answer.delay_applied = answer.delay.result_id != 0 && state.delay_applied;
  answer.centreline_of_slide =
      answer.centreline_calibrated &&
      std::ranges::find(in_use, "centreline-slide", &messages::ValueInUse::name) != in_use.end();
  answer.in_use = std::move(in_use);
  if (swivel.tool != 0)
    answer.in_use.push_back({.name = "length of tool " + std::to_string(swivel.tool),
                             .source = swivel.tool_length_from,
                             .result_id = swivel.tool_length_result});
  return answer;
}

}  // namespace probebox::app
