#include "firmware/app/results/proposal_request_handler.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include "firmware/app/log/log.hpp"
#include "protocol/messages/cases.hpp"
#include "protocol/units/wording.hpp"

namespace probebox::app {
namespace {

using messages::CaseProgress;
using messages::ErrorCode;
using messages::FollowCase;
using messages::Operation;
using messages::ProposeCase;

// A host that follows asks twice a second; one that does not follow waits 5 s for an answer.
constexpr std::chrono::seconds kFollowed{5};
constexpr std::chrono::milliseconds kUnfollowed{4000};
constexpr std::size_t kMostFinished = 8;

}  // namespace

void ProposalRequestHandler::propose(std::span<const std::byte> body, Then then) {
  const auto piece = messages::decode<ProposeCase::Request>(body);
  if (!piece) return then(malformed(Operation::propose_case));
  if (piece->as_this_machine) {
    if (const auto why = whyNoName(piece->by)) return then(refused(ErrorCode::malformed, why->what));
  }
  if (current_) return then(refused(ErrorCode::busy, "The box is solving another case: propose this one again later."));
  auto whole = incoming_.add(*piece);
  if (!whole) return then(refused(ErrorCode::refused, whole.error().what));
  if (!*whole) return then(ok(ProposeCase::Answer{}));
  const auto now = Clock::now();
  if (piece->follow) {
    then(ok(ProposeCase::Answer{.result_id = 0, .refusal = {}, .working = true, .also = {}}));
    then = nullptr;
  }
  std::erase_if(finished_, [&](const Finished& each) { return each.number == piece->number; });
  current_ =
      Current{.number = piece->number, .followed = piece->follow, .since = now, .asked = now, .then = std::move(then)};
  calibrations_.propose(std::move(**whole), piece->as_this_machine ? piece->by : "",
                        [this](Outcome<Calibrations::Proposed> outcome) { finish(std::move(outcome)); });
}

void ProposalRequestHandler::finish(Outcome<Calibrations::Proposed> outcome) {
  auto done = std::exchange(current_, std::nullopt);
  if (!done) return;
  if (done->followed) {
    if (finished_.size() >= kMostFinished) finished_.pop_front();
    finished_.push_back({done->number, std::move(outcome)});
    return;
  }
  done->then(outcome
                 ? ok(ProposeCase::Answer{
                       .result_id = outcome->id, .refusal = outcome->refusal, .working = false, .also = outcome->also})
                 : refused(ErrorCode::refused, outcome.error().what));
}

Reply ProposalRequestHandler::follow(std::span<const std::byte> body) {
  const auto request = messages::decode<FollowCase::Request>(body);
  if (!request) return malformed(Operation::follow_case);
  if (current_ && current_->followed && current_->number == request->number) {
    if (request->cancel) {
      calibrations_.cancelProposal();
      current_.reset();
      return ok(FollowCase::Answer{
          .progress = CaseProgress::cancelled, .elapsed_ms = 0, .result_id = 0, .refusal = {}, .also = {}});
    }
    current_->asked = Clock::now();
    const auto elapsed = std::chrono::duration_cast<std::chrono::milliseconds>(current_->asked - current_->since);
    return ok(FollowCase::Answer{.progress = CaseProgress::working,
                                 .elapsed_ms = static_cast<std::uint32_t>(elapsed.count()),
                                 .result_id = 0,
                                 .refusal = {},
                                 .also = {}});
  }
  const auto found = std::ranges::find(finished_, request->number, &Finished::number);
  if (found == finished_.end())
    return refused(ErrorCode::not_found, "The box is not solving that case: propose it again.");
  if (!found->outcome) return refused(ErrorCode::refused, found->outcome.error().what);
  return ok(FollowCase::Answer{.progress = CaseProgress::done,
                               .elapsed_ms = 0,
                               .result_id = found->outcome->id,
                               .refusal = found->outcome->refusal,
                               .also = found->outcome->also});
}

void ProposalRequestHandler::look(Clock::time_point now) {
  if (!current_) return;
  const bool forsaken = current_->followed ? now - current_->asked > kFollowed : now - current_->since > kUnfollowed;
  if (!forsaken) return;
  calibrations_.cancelProposal();
  const auto given_up = std::exchange(current_, std::nullopt);
  logInfo("A proposed case is given up: its host asks after it no more.");
  if (given_up->then)
    given_up->then(refused(ErrorCode::refused,
                           "too-long: the case takes longer than this command waits: update it, or solve the case on "
                           "this computer (probebox solve)."));
}

}  // namespace probebox::app
