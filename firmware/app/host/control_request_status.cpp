// Answers of the control handler about the box and its procedure.
#include <algorithm>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include "firmware/app/host/control_request_handler.hpp"
#include "firmware/app/host/process_status.hpp"
#include "firmware/app/results/result_summary.hpp"
#include "firmware/app/results/wall_clock.hpp"
#include "firmware/procedure/plan/prompts.hpp"
#include "protocol/messages/control.hpp"

namespace probebox::app {
namespace {

std::string failedStep(const procedure::Progress& progress) {
  const std::string step = "step " + std::to_string(progress.step + 1);
  using capture::TouchFault;
  if (progress.last_fault == TouchFault::zero_lost || progress.last_fault == TouchFault::screw_changed)
    return "at " + step + ": " + explain(progress.last_fault);
  return step + " failed " + std::to_string(progress.repeats) +
         " times: " + (progress.timed_out ? "its end never came" : explain(progress.last_fault));
}

// An inhibit line that has given no level yet has its source named for it: "gpiochip0 line 4 (inhibit 1)".
bool isUnknownInhibit(const std::string& source, const std::vector<messages::LineStatus>& lines,
                      const published::Snapshot& snapshot) {
  return std::ranges::any_of(lines, [&](const messages::LineStatus& line) {
    return line.role == static_cast<std::uint8_t>(LineRole::inhibit) &&
           (snapshot.unknown_inhibit_lines >> line.line & 1U) != 0 && source.ends_with("(" + line.name + ")");
  });
}

std::vector<messages::SourceStatus> sourcesOf(std::vector<SourceTable::Row> rows,
                                              const std::vector<messages::LineStatus>& lines,
                                              const published::Snapshot& snapshot) {
  std::vector<messages::SourceStatus> all;
  for (auto& [name, problem, faults, unusable] : rows) {
    if (isUnknownInhibit(name, lines, snapshot)) {
      problem += (problem.empty() ? "" : "; ") +
                 std::string{
                     "its level is not known since the start, which counts as a cut: no result comes into "
                     "force before it is, or until box.toml has the line no more"};
    }
    all.push_back(
        {.name = std::move(name), .problem = std::move(problem), .unusable = unusable, .faults = std::move(faults)});
  }
  return all;
}

}  // namespace

Reply ControlRequestHandler::describeStatus(const box::State& state, const LinkVitals& vitals) const {
  messages::Status::Answer answer;
  answer.board = identity_.board;
  answer.firmware_version = identity_.firmware_version;
  answer.uptime_ms = vitals.uptime_ms;
  auto date = dateNow();
  answer.utc = std::move(date.text);
  answer.date_source = std::move(date.source);
  answer.from_hosts = vitals.from_hosts;
  answer.usb_ports = vitals.usb_ports;
  answer.not_let_in = vitals.not_let_in;
  answer.tls_problem = vitals.tls_problem;
  static_cast<messages::CoreStatus&>(answer) = state.snapshot;
  auto& [first, second] = deps_.counters.receivers;
  answer.front_end = first.front_end.newest();
  answer.front_end.inputs = first.inputs.newest();
  answer.receiver.bad_packets = first.bad_packets;
  answer.second_front_end = second.front_end.newest();
  answer.second_front_end.inputs = second.inputs.newest();
  answer.second_receiver.bad_packets = second.bad_packets;
  answer.events.lost_in_journal = deps_.counters.journal_lost_events;
  answer.queue_high_water = deps_.counters.queue_high_water;
  answer.deadline_misses = deps_.counters.deadline_misses;
  answer.procedure = procedureInWords(state);
  answer.active_results = deps_.calibrations.inForce().active();
  answer.links = static_cast<std::uint16_t>(deps_.counters.links.load());
  answer.cnc_lines = deps_.cnc_lines();
  for (const auto& line : answer.cnc_lines) {
    answer.modbus.requests += line.answered + line.refused;
    answer.modbus.bad_frames += line.bad_frames;
  }
  answer.sources = sourcesOf(deps_.sources.rows(), identity_.lines, state.snapshot);
  for (auto& holder : deps_.connections.holders())
    answer.inhibits.push_back({.connection = std::move(holder.connection),
                               .by = std::move(holder.by),
                               .since_utc = std::move(holder.since_utc)});
  answer.storage_problems = deps_.calibrations.inForce().storageProblems();
  answer.rests_on_retired = deps_.calibrations.inForce().toRepeat();
  std::ranges::move(deps_.calibrations.placesThatDisagree(), std::back_inserter(answer.rests_on_retired));
  if (deps_.due != nullptr) answer.due = deps_.due->all();
  answer.update = deps_.updates.inWords();
  for (auto problem : {deps_.connections.problem(), deps_.applied.notice(), deps_.applied.problem(),
                       deps_.boots_problem, deps_.unit.problem(), deps_.due == nullptr ? "" : deps_.due->problem()}) {
    if (!problem.empty()) answer.storage_problems.push_back(std::move(problem));
  }
  answer.process = processStatus();
  answer.lines = identity_.lines;
  for (auto& line : answer.lines) {
    const auto& counters = state.lines.at(line.role).at(line.line);
    line.edges = counters.edges;
    line.lost = counters.lost;
  }
  return ok(answer);
}

// The core has learnt what comes after the steps that were planned.
void ControlRequestHandler::followLoops(const procedure::Progress& progress) {
  if (progress.run != last_run_ || progress.loops == plan_.loops) return;
  procedure::fill(plan_, *plan_.method, options_, progress.loops);
  procedure::takeReadings(plan_, probe_);
}

std::string ControlRequestHandler::procedureInWords(const box::State& state) const {
  const auto& progress = state.procedure;
  switch (progress.state) {
    case procedure::State::idle:
      return "idle";
    case procedure::State::waiting:
    case procedure::State::running: {
      std::string text = procedure::promptFor(plan_, progress.step);
      if (progress.timed_out) text += " (again: the end marker of the step never came)";
      if (progress.last_fault != capture::TouchFault::none)
        text += std::string{" (again: "} + capture::explain(progress.last_fault) + ")";
      return text;
    }
    case procedure::State::solving:
      return "solving";
    case procedure::State::proposed:
      if (progress.result_id == 0) return "done";
      return "result " + std::to_string(progress.result_id) + whereItStands(progress.result_id);
    case procedure::State::refused:
      return "refused";
    case procedure::State::aborted:
      return "aborted";
  }
  return {};
}

std::string ControlRequestHandler::whereItStands(std::uint64_t result) const {
  const auto& in_force = deps_.calibrations.inForce();
  if (in_force.isWaiting(result)) return " is accepted and waits for the end of the cut";
  const auto active = in_force.active();
  if (std::ranges::find(active, result) != active.end()) return " is in force";
  return in_force.wasAccepted(result) ? " is no longer in force" : " waits to be accepted";
}

Reply ControlRequestHandler::describeProcedure(const box::State& state) const {
  const auto& progress = state.procedure;
  messages::ProcedureStatus::Answer answer;
  answer.referenced = state.snapshot.referenced;
  answer.has_temperature = plan_.temperature_c.has_value();
  answer.temperature_c = plan_.temperature_c.value_or(0);
  if (last_run_ > progress.run) {
    // Started, and the core has not published it yet: nobody may take the run before for this one.
    answer.run = last_run_;
    answer.state = RunState::waiting;
    answer.prompt = "starting";
    return ok(answer);
  }
  answer.run = progress.run;
  if (progress.method != nullptr) answer.method = progress.method->name();
  answer.state = progress.state;
  answer.step = progress.step;
  answer.steps = progress.steps;
  answer.result_id = progress.result_id;
  answer.prompt = procedureInWords(state);
  if (progress.step < progress.steps) static_cast<Step&>(answer) = procedure::asked(plan_.steps[progress.step]);
  if (progress.state == procedure::State::refused)
    answer.refusal = progress.step < progress.steps ? failedStep(progress) : deps_.calibrations.lastRefusal();
  return ok(answer);
}

}  // namespace probebox::app
