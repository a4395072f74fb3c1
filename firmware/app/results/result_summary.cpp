#include "firmware/app/results/result_summary.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <string_view>
#include <utility>

#include "firmware/app/results/result_values.hpp"
#include "firmware/metrology/dataset/verdict.hpp"
#include "firmware/metrology/subject_values.hpp"

namespace probebox::app {
namespace {

messages::AxisStatus axisStatus(const published::AxisState& axis) {
  return {.referenced = axis.referenced,
          .position_mm = axis.position_mm,
          .last_fault = static_cast<std::uint8_t>(axis.last_fault),
          .reference_losses = axis.reference_losses,
          .has_screw = axis.has_screw,
          .sensor_fault = static_cast<std::uint8_t>(axis.sensor_fault),
          .extension_um = axis.extension_um,
          .screw_offset_mm = axis.screw_offset_mm,
          .screw_slope = axis.screw_slope,
          .unused_indexes = axis.unused_indexes};
}

messages::RotaryAxisStatus rotaryStatus(const published::RotaryAxisState& axis) {
  return {.described = axis.described,
          .known = axis.known,
          .doubtful = axis.doubtful,
          .angle_rad = axis.angle_rad,
          .last_fault = static_cast<std::uint8_t>(axis.last_fault),
          .reference_losses = axis.reference_losses,
          .result_id = axis.result_id,
          .has_errors = axis.has_errors,
          .errors = axis.errors,
          .sd_errors = axis.sd_errors};
}

messages::StampedTrigger stampedTrigger(const published::TriggerStamp& trigger) {
  messages::StampedTrigger stamped{.number = trigger.number,
                                   .has_position = {},
                                   .position_mm = trigger.position_mm,
                                   .correction_mm = {},
                                   .correction_valid = trigger.served.valid,
                                   .sequence = trigger.served.sequence};
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis) {
    if (trigger.has_position[axis]) stamped.has_position = static_cast<std::uint8_t>(stamped.has_position | 1U << axis);
    stamped.correction_mm[axis] = trigger.served.correction_nm[axis] * 1e-6;
  }
  return stamped;
}

messages::ValueSource sourceOf(published::LengthFrom from) {
  using enum messages::ValueSource;
  switch (from) {
    case published::LengthFrom::description:
      return description;
    case published::LengthFrom::result:
      return result;
    case published::LengthFrom::controller:
      return controller;
    case published::LengthFrom::nobody:
      break;
  }
  return unknown;
}

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
  const auto stamped = stampedTrigger(placed.stamp);
  unsigned has_angle = 0;
  for (std::size_t axis = 0; axis < kRotaryAxes; ++axis) has_angle |= placed.stamp.has_angle[axis] ? 1U << axis : 0U;
  return {.number = stamped.number,
          .line = placed.stamp.line,
          .line_sequence = placed.stamp.line_sequence,
          .at = placed.stamp.at,
          .tick = placed.tick,
          .phase_q32 = placed.phase_q32,
          .sigma_ns = placed.sigma_ns,
          .clock_state = placed.clock_state,
          .has_position = stamped.has_position,
          .position_mm = stamped.position_mm,
          .correction_mm = stamped.correction_mm,
          .correction_valid = stamped.correction_valid,
          .correction_degraded = placed.stamp.served.degraded,
          .sequence = stamped.sequence,
          .has_angle = static_cast<std::uint8_t>(has_angle),
          .angle_rad = placed.stamp.angle_rad};
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
  const auto& snapshot = state.snapshot;
  messages::Corrections::Answer answer;
  answer.valid = snapshot.valid;
  answer.degraded = snapshot.degraded;
  answer.correction_mm = snapshot.correction_mm;
  answer.mask = snapshot.mask;
  answer.sequence = snapshot.sequence;
  answer.heartbeat = snapshot.heartbeat;
  answer.age_ms = static_cast<std::uint32_t>(std::min<std::uint64_t>(snapshot.age_ms, 0xFFFFFFFF));
  answer.delay_calibrated = snapshot.delay.calibrated;
  answer.tau_s = snapshot.delay.tau_s;
  answer.tau_sd_s = snapshot.delay.sd_s;
  answer.settled = snapshot.settled;
  answer.referenced = snapshot.referenced;
  answer.inhibited = snapshot.inhibited;
  for (std::size_t kind = 0; kind < published::kSourceKinds; ++kind) {
    answer.sources.push_back({.bit = static_cast<std::uint8_t>(kind),
                              .health = static_cast<std::uint8_t>(snapshot.health[kind]),
                              .summed = (unsigned{snapshot.mask} >> kind & 1U) != 0});
  }
  for (const auto& axis : snapshot.axes) answer.axes.push_back(axisStatus(axis));
  answer.centreline_calibrated = snapshot.centreline_calibrated;
  answer.centreline_mm = snapshot.centreline.here_mm;
  answer.centreline_slope = snapshot.centreline.result.slope;
  answer.last_trigger = stampedTrigger(snapshot.last_trigger);
  answer.unplaced_triggers = snapshot.unplaced_triggers;
  answer.refused_homings = snapshot.refused_homings;
  answer.delay_applied = snapshot.delay.result_id != 0 && state.delay_applied;
  for (const auto& axis : snapshot.rotary) answer.rotary_axes.push_back(rotaryStatus(axis));
  const auto& swivel = snapshot.swivel;
  answer.swivel = {.result_id = swivel.result_id,
                   .error_mm = swivel.error_mm,
                   .tool = swivel.tool,
                   .has_tool_length = swivel.has_tool_length,
                   .tool_length_mm = swivel.tool_length_mm};
  answer.centreline_of_slide =
      answer.centreline_calibrated &&
      std::ranges::find(in_use, "centreline-slide", &messages::ValueInUse::name) != in_use.end();
  answer.in_use = std::move(in_use);
  if (swivel.tool != 0)
    answer.in_use.push_back({.name = "length of tool " + std::to_string(swivel.tool),
                             .source = sourceOf(swivel.tool_length_from),
                             .result_id = swivel.tool_length_result});
  return answer;
}

messages::EdgeCounters edgeCounters(const clock::ClockCounters& counters) {
  return {.accepted = counters.accepted + counters.clipped,
          .missing = counters.missing,
          .doubled = counters.doubled,
          .spurious = counters.spurious + counters.unfitting,
          .lost = counters.lost_by_kernel,
          .unlocked = counters.unlocked};
}

messages::ClockStatus clockStatus(const box::State& state) {
  return {.state = state.map.state,
          .sigma_ns = state.map.sigma_ns,
          // A longer period is a slower clock.
          .frequency_ppb = -state.clock_offset_ppm * 1e3,
          .tick = state.map.tick,
          .edges = edgeCounters(state.clock)};
}

messages::ReceiverStatus receiverStatus(const box::State& state) {
  const auto& [clock_state, offset_ppm, sigma_ns, counters] = state.probe_clock;
  messages::ReceiverStatus status{.state = clock_state,
                                  .sigma_ns = 0,
                                  .frequency_ppb = 0,
                                  .samples = counters.samples,
                                  .missing = counters.missing,
                                  .unstamped = counters.unstamped,
                                  .restarts = counters.restarts,
                                  .relocks = counters.relocks,
                                  .refused_frequency = counters.refused_frequency,
                                  .bad_packets = 0};
  const bool is_good = clock_state == ClockState::locked || clock_state == ClockState::holdover;
  if (!is_good) return status;
  status.sigma_ns = static_cast<std::uint32_t>(std::lround(sigma_ns));
  status.frequency_ppb = -offset_ppm * 1e3;  // a longer period is a slower clock
  return status;
}

messages::UnusedEvents unusedEvents(const box::State& state) {
  return {.late = state.latch.late,
          .disordered = state.latch.disordered,
          .overwritten = state.latch.overwritten,
          .incomplete_rows = state.incomplete_rows,
          .stray_markers = state.stray_markers};
}

messages::EventCounts eventCounts(const box::State& state) {
  const auto& lost = state.lost;
  return {.received = state.events,
          .lost = lost.sync_edges + lost.line_edges + lost.counts + lost.deflections,
          .lost_in_queue = lost.queue_events,
          .sources_gone = lost.sources_gone};
}

}  // namespace probebox::app
