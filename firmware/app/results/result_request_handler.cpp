#include "firmware/app/results/result_request_handler.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "firmware/app/log/log.hpp"
#include "firmware/app/results/result_events.hpp"
#include "firmware/app/results/result_summary.hpp"
#include "firmware/json/result_json.hpp"
#include "firmware/results/notes.hpp"
#include "protocol/messages/control.hpp"
#include "protocol/units/wording.hpp"

namespace probebox::app {
namespace {

using messages::ErrorCode;
using messages::Operation;

// Leaves room for the envelope in one answer of a link.
constexpr std::size_t kMostAnswerBytes = 12'000;

Reply whyNot(const store::Failure& failure) {
  switch (failure.reason) {
    case store::Reason::unknown_result:
      return refused(ErrorCode::not_found, failure.what);
    case store::Reason::not_possible_now:
    case store::Reason::other_binding:
    case store::Reason::cut_is_on:
      return refused(ErrorCode::wrong_state, failure.what);
    case store::Reason::differs:
      return refused(ErrorCode::differs, failure.what);
    default:
      return refused(ErrorCode::refused, failure.what);
  }
}

messages::ValueChange wireChange(const ComparedValue& each) {
  const auto in_sd = each.inSd();
  return {.key = each.key,
          .value = each.value,
          .sd = each.sd.value_or(0),
          .has_sd = each.sd.has_value(),
          .before = each.before,
          .sd_before = each.sd_before.value_or(0),
          .has_sd_before = each.sd_before.has_value(),
          .in_sd = in_sd.value_or(0),
          .has_in_sd = in_sd.has_value()};
}

std::string documentOf(const store::Record& record) {
  return record.result() != nullptr ? json::toJson(*record.result()) : json::toJson(*record.refusal());
}

}  // namespace

bool ResultRequestHandler::answers(Operation operation) {
  switch (operation) {
    case Operation::list_results:
    case Operation::accept_result:
    case Operation::rollback_result:
    case Operation::result_history:
    case Operation::get_dataset:
    case Operation::set_inhibit:
    case Operation::propose_case:
    case Operation::follow_case:
    case Operation::get_result:
      return true;
    default:
      return false;
  }
}

void ResultRequestHandler::answer(Operation operation, std::span<const std::byte> body, const Caller& caller,
                                  const ProposalRequestHandler::Then& then) {
  if (operation != Operation::propose_case) return then(answerAtOnce(operation, body, caller));
  if (!caller.may.allow_calibrate) return then(notPermitted("allow_calibrate"));
  proposals_.propose(body, then);
}

Reply ResultRequestHandler::answerAtOnce(Operation operation, std::span<const std::byte> body, const Caller& caller) {
  const board::Access& may = caller.may;
  switch (operation) {
    case Operation::list_results:
      return listResults(body);
    case Operation::accept_result:
      return acceptResult(body, may);
    case Operation::rollback_result:
      return rollBack(body, may);
    case Operation::result_history:
      return history(body);
    case Operation::get_dataset:
      return getDataset(body);
    case Operation::get_result:
      return getResult(body);
    case Operation::set_inhibit:
      return setInhibit(body, caller);
    case Operation::follow_case:
      return may.allow_calibrate ? proposals_.follow(body) : notPermitted("allow_calibrate");
    default:
      return refused(ErrorCode::unknown_operation, "This box does not know the operation: update its firmware.");
  }
}

Reply ResultRequestHandler::listResults(std::span<const std::byte> body) {
  constexpr std::size_t kMostResults = 64;
  const auto request = messages::decode<messages::ListResults::Request>(body);
  if (!request) return malformed(Operation::list_results);
  auto records = calibrations_.results(request->after_id, kMostResults, request->newest);
  if (!records) return whyNot(records.error());
  messages::ListResults::Answer answer;
  answer.more = records->size() == kMostResults;
  std::size_t bytes = 0;
  std::uint32_t first_value = request->first_value;
  for (const auto& record : *records) {
    auto summary = summaryOf(record);
    summary.waiting_for_cut = calibrations_.inForce().isWaiting(record.id);
    summary.as_this_machine_by = calibrations_.adoptedBy(record.id);
    summary.why_not_in_force = calibrations_.inForce().whyNotInForce(record).value_or("");
    const auto rests_on = calibrations_.restsOn(record.id);
    if (!rests_on) return whyNot(rests_on.error());
    for (const auto& other : *rests_on)
      summary.rests_on.push_back({other.id, other.subject, calibrations_.isToRepeat(other)});
    // One that no answer holds comes in parts; others wait for the next answer.
    const bool is_whole = keepValues(summary, std::exchange(first_value, 0), kMostAnswerBytes);
    bytes += messages::encodedSize(summary);
    if (bytes > kMostAnswerBytes && !answer.results.empty()) {
      answer.more = true;
      break;
    }
    answer.results.push_back(std::move(summary));
    if (is_whole) continue;
    answer.more = true;
    break;
  }
  return ok(answer);
}

Reply ResultRequestHandler::acceptResult(std::span<const std::byte> body, const board::Access& may) {
  const auto request = messages::decode<messages::AcceptResult::Request>(body);
  if (!request) return malformed(Operation::accept_result);
  if (!request->compare_only) {
    if (!may.allow_accept) return notPermitted("allow_accept");
    if (const auto why = whyNoName(request->by)) return refused(ErrorCode::malformed, why->what);
  }
  auto& in_force = calibrations_.inForce();
  const auto accepted = request->compare_only ? in_force.compareOnly(request->id)
                                              : in_force.accept(request->id, request->by, request->although_it_differs);
  if (!accepted) return whyNot(accepted.error());
  if (!request->compare_only && accepted->state == store::State::active) sayWhenItIsTrue();
  const Comparison& comparison = accepted->comparison;
  messages::AcceptResult::Answer answer{
      .state = wireState(accepted->state),
      .waiting_for_cut = accepted->state == store::State::accepted,
      .subject = accepted->binding.subject,
      .first_of_subject = comparison.first(),
      .compared_with = comparison.with,
      .changes = {},
      .differs = comparison.differs() || results::whyNotConforming(*accepted).has_value(),
      .notes = accepted->notes,
      .accepted_by = accepted->accepted_by};
  // Of what is in force now: before an acceptance, of what was.
  if (!request->compare_only) std::ranges::move(calibrations_.placesThatDisagree(), std::back_inserter(answer.notes));
  for (const auto& value : comparison.values) answer.changes.push_back(wireChange(value));
  if (comparison.omitted > 0)
    answer.notes.push_back(std::to_string(comparison.omitted) + " values that differ less are not listed.");
  return ok(answer);
}

// Whoever reads that a result is in force may start a run that needs it at once: the answer waits until the published
// state has it. The store has the change already, so a core that stands still changes nothing about the answer.
void ResultRequestHandler::sayWhenItIsTrue() {
  if (!core_.seesWhatWasTold()) logWarning("the core has not confirmed what came into force within 2 s");
}

Reply ResultRequestHandler::rollBack(std::span<const std::byte> body, const board::Access& may) {
  const auto request = messages::decode<messages::RollbackResult::Request>(body);
  if (!request) return malformed(Operation::rollback_result);
  if (!may.allow_accept) return notPermitted("allow_accept");
  if (const auto why = whyNoName(request->by)) return refused(ErrorCode::malformed, why->what);
  auto& in_force = calibrations_.inForce();
  const bool only_waited = request->id != 0 && in_force.isWaiting(request->id);
  const auto changed =
      request->id != 0 ? in_force.rollBack(request->id, request->by) : in_force.rollBack(request->subject, request->by);
  if (!changed) return whyNot(changed.error());
  sayWhenItIsTrue();
  const auto& retired = changed->retired;
  const auto& active = changed->active;
  return ok(messages::RollbackResult::Answer{.subject = (retired ? *retired : *active).binding.subject,
                                             .retired_id = retired ? retired->id : 0,
                                             .active_id = active ? active->id : 0,
                                             .withdrawn = only_waited,
                                             .notes = changed->notes});
}

Reply ResultRequestHandler::history(std::span<const std::byte> body) {
  constexpr std::size_t kMostTransitions = 100;
  const auto request = messages::decode<messages::ResultHistory::Request>(body);
  if (!request) return malformed(Operation::result_history);
  const auto transitions = calibrations_.history({.result = request->id,
                                                  .subject = subjectNamed(request->subject),
                                                  .after = request->after_number,
                                                  .count = kMostTransitions});
  if (!transitions) return whyNot(transitions.error());
  messages::ResultHistory::Answer answer;
  answer.more = transitions->size() == kMostTransitions;
  std::size_t bytes = 0;
  for (const auto& transition : *transitions) {
    auto on_the_wire = wireTransition(transition);
    bytes += messages::encodedSize(on_the_wire);
    if (bytes > kMostAnswerBytes) {
      answer.more = true;
      break;
    }
    answer.transitions.push_back(std::move(on_the_wire));
  }
  return ok(answer);
}

Reply ResultRequestHandler::getDataset(std::span<const std::byte> body) {
  const auto request = messages::decode<messages::GetDataset::Request>(body);
  if (!request) return malformed(Operation::get_dataset);
  const std::string& all = calibrations_.dataset(request->run);
  if (all.empty()) {
    return refused(ErrorCode::not_found, "The data of run " + std::to_string(request->run) +
                                             " are not available: only those of the latest solved run are kept.");
  }
  if (request->offset > all.size()) return refused(ErrorCode::not_found, "The data end before that offset.");
  return ok(messages::GetDataset::Answer{
      .total_bytes = all.size(), .offset = request->offset, .bytes = all.substr(request->offset, kMostAnswerBytes)});
}

Reply ResultRequestHandler::getResult(std::span<const std::byte> body) {
  const auto request = messages::decode<messages::GetResult::Request>(body);
  if (!request) return malformed(Operation::get_result);
  if (request->document > messages::ResultDocument::dataset)
    return refused(ErrorCode::malformed, "A document is 0, the result, or 1, the dataset.");
  messages::GetResult::Answer answer{
      .summary = {}, .dataset_kept = {}, .total_bytes = 0, .offset = request->offset, .bytes = {}};
  if (request->offset == 0 || document_.id != request->id || document_.kind != request->document) {
    auto record = calibrations_.find(request->id);
    if (!record) return whyNot(record.error());
    auto dataset = calibrations_.datasetOf(request->id);
    const bool wants_dataset = request->document == messages::ResultDocument::dataset;
    // A result can be looked at though its dataset is damaged.
    if (!dataset && wants_dataset) return whyNot(dataset.error());
    document_ = {request->id, request->document, dataset && !dataset->empty(), {}};
    document_.text = wants_dataset ? std::move(dataset).value() : documentOf(*record);
    answer.summary = summaryOf(*record);
    answer.summary.waiting_for_cut = calibrations_.inForce().isWaiting(record->id);
    answer.summary.as_this_machine_by = calibrations_.adoptedBy(record->id);
    answer.summary.why_not_in_force = calibrations_.inForce().whyNotInForce(*record).value_or("");
    answer.summary.values.clear();
    answer.summary.warnings.clear();
  }
  const std::string& all = document_.text;
  if (request->offset > all.size()) return refused(ErrorCode::not_found, "The document ends before that offset.");
  answer.dataset_kept = document_.dataset_kept;
  answer.total_bytes = all.size();
  answer.bytes = all.substr(request->offset, kMostAnswerBytes - messages::encodedSize(answer));
  if (request->offset + answer.bytes.size() == all.size()) document_ = {};
  return ok(answer);
}

// Answered when it is stored and the core holds it: what is asked for next finds it so.
Reply ResultRequestHandler::setInhibit(std::span<const std::byte> body, const Caller& caller) {
  const auto request = messages::decode<messages::SetInhibit::Request>(body);
  if (!request) return malformed(Operation::set_inhibit);
  if (!caller.may.allow_inhibit) return notPermitted("allow_inhibit");
  if (const auto why = request->by.empty() ? std::nullopt : whyNoName(request->by))
    return refused(ErrorCode::malformed, why->what);
  const std::string own = request->by.empty() ? caller.connection : "person:" + request->by;
  const bool of_another = !request->connection.empty() && request->connection != own;
  if (of_another) {
    if (auto refusal = clearForAnother(*request, caller.may)) return *refusal;
  } else if (const auto error = connections_.setInhibit(own, request->active, request->by)) {
    return refused(ErrorCode::refused, error->what);
  }
  if (!core_.seesWhatWasTold()) return refused(ErrorCode::busy, "The box is busy: send it again.");
  calibrations_.look(core_.newest());
  return ok(messages::Nothing{});
}

// A controller that is gone never ends its cut: a person who may change what is in force does.
std::optional<Reply> ResultRequestHandler::clearForAnother(const messages::SetInhibit::Request& request,
                                                           const board::Access& may) {
  if (!may.allow_accept) return notPermitted("allow_accept");
  if (request.active)
    return refused(ErrorCode::refused, "An inhibit is set in one's own name: leave the connection out.");
  if (request.by.empty())
    return refused(ErrorCode::refused,
                   "To clear the inhibit of another connection needs the name of who does it (by).");
  if (const auto error = connections_.clearInhibit(request.connection, request.by))
    return refused(ErrorCode::not_found, error->what);
  logWarning("the inhibit of " + request.connection + " was cleared by " + request.by);
  return std::nullopt;
}

}  // namespace probebox::app
