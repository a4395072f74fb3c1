#include "firmware/app/cnc/controller_requests.hpp"

#include <optional>
#include <string>
#include <utility>

#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/plan/live_method.hpp"
#include "protocol/messages/control.hpp"
#include "protocol/messages/results.hpp"

namespace probebox::app {
namespace {

using messages::ErrorCode;
using messages::Operation;
using What = modbus::ControllerRequest::What;

enum : std::uint16_t { kInHand = 1, kDone = 2, kRefused = 3 };

struct Asked {
  Operation operation{};
  std::vector<std::byte> body;
};

// Nothing for a method that the box does not have.
std::optional<Asked> askedOf(const modbus::ControllerRequest& controller_request, const std::string& by) {
  switch (controller_request.what) {
    case What::start: {
      const auto* method = procedure::methodNumbered(procedure::liveMethods(), controller_request.method);
      if (method == nullptr) return std::nullopt;
      return Asked{Operation::start_procedure, messages::encoded(messages::StartProcedure::Request{
                                                   std::string{method->name()}, controller_request.options})};
    }
    case What::abort:
      return Asked{Operation::abort_procedure,
                   messages::encoded(messages::AbortProcedure::Request{.run = controller_request.of})};
    case What::accept:
    case What::accept_although_it_differs:
      break;
  }
  messages::AcceptResult::Request request;
  request.id = controller_request.of;
  request.by = by;
  request.although_it_differs = controller_request.what == What::accept_although_it_differs;
  return Asked{Operation::accept_result, messages::encoded(request)};
}

// Translates a reply into the registers about a request.
void read(const Reply& reply, const modbus::ControllerRequest& controller_request,
          published::ControllerRequestState& state) {
  state.outcome = reply.code == ErrorCode::ok ? kDone : kRefused;
  state.refusal = static_cast<std::uint16_t>(reply.code);
  state.number = controller_request.of;
  if (reply.code != ErrorCode::ok) return;
  if (controller_request.what == What::start) {
    const auto answer = messages::decode<messages::StartProcedure::Answer>(reply.body);
    if (answer) state.number = answer->run;
  } else if (controller_request.what != What::abort) {
    const auto answer = messages::decode<messages::AcceptResult::Answer>(reply.body);
    state.waits = answer && answer->waiting_for_cut;
  }
}

}  // namespace

void ControllerRequests::make(const modbus::ControllerRequest& controller_request) {
  const auto asked = askedOf(controller_request, by_);
  {
    const std::lock_guard lock{present_->mutex};
    present_->commit = controller_request.commit;
    present_->what = controller_request.what;
    present_->state = {.answered = present_->state.answered, .outcome = kInHand};
    if (!asked) {
      present_->state = {.answered = controller_request.commit,
                         .outcome = kRefused,
                         .refusal = static_cast<std::uint16_t>(ErrorCode::not_found)};
      present_->refusals.push_back("This box has no method with the number " +
                                   std::to_string(controller_request.method) + ".");
      return;
    }
  }
  ask_(asked->operation, asked->body, [present = present_, controller_request](const Reply& reply) {
    const std::lock_guard lock{present->mutex};
    if (reply.code != ErrorCode::ok) present->refusals.push_back(reply.text);
    if (present->commit != controller_request.commit) return;  // another request has taken its place
    published::ControllerRequestState state{.answered = controller_request.commit};
    read(reply, controller_request, state);
    present->state = state;
  });
}

std::vector<std::string> ControllerRequests::newRefusals() {
  const std::lock_guard lock{present_->mutex};
  return std::exchange(present_->refusals, {});
}

published::ControllerRequestState ControllerRequests::state(const published::Snapshot& shown) const {
  auto [state, what] = [&] {
    const std::lock_guard lock{present_->mutex};
    return std::pair{present_->state, present_->what};
  }();
  state.waits = state.waits && waits_(state.number);
  if (state.outcome != kDone) return state;
  const bool is_shown = state.number <= shown.calibration_run;
  const bool still_runs = shown.calibration == published::CalibrationState::running &&
                          (state.number == 0 || state.number == shown.calibration_run);
  const bool is_unseen = (what == What::start && !is_shown) || (what == What::abort && (!is_shown || still_runs));
  if (is_unseen) state.outcome = kInHand;
  return state;
}

}  // namespace probebox::app
