#include "firmware/app/host/control_request_handler.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <memory>
#include <string>
#include <utility>

#include "board/describe/machine.hpp"
#include "firmware/app/host/run_options.hpp"
#include "firmware/app/host/signature.hpp"
#include "firmware/app/log/log.hpp"
#include "firmware/app/results/result_summary.hpp"
#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/plan/capacity.hpp"
#include "firmware/procedure/plan/rates.hpp"
#include "protocol/messages/control.hpp"
#include "protocol/units/nearest.hpp"
#include "protocol/units/wording.hpp"

namespace probebox::app {
namespace {

using messages::ErrorCode;
using messages::Operation;

// A source that machine.toml does not describe can never be good.
std::optional<Error> whyNotSummed(std::uint16_t mask, const box::State& state) {
  if (mask >> kSourceKinds != 0) return Error{"Only these are " + std::string{kSourceBits} + "."};
  for (std::size_t kind = 0; kind < kSourceKinds; ++kind) {
    const std::string lacking{kSources[kind].lacking};
    if (hasSource(mask, kind) && !lacking.empty() && state.snapshot.health[kind] == published::Health::off)
      return Error{"machine.toml describes " + lacking + "."};
  }
  return std::nullopt;
}

struct Right {
  bool board::Access::*flag;
  const char* key;
};
// Right that a host needs for sending this event.
Right rightFor(const Event& said) {
  if (std::holds_alternative<AxisHomed>(said)) return {&board::Access::allow_homing, "allow_homing"};
  if (std::holds_alternative<CutInhibit>(said)) return {&board::Access::allow_inhibit, "allow_inhibit"};
  return {&board::Access::allow_marker, "allow_marker"};
}

// The core would refuse it: the caller hears so at once.
std::optional<Error> whyNotHomed(const AxisHomed& homed, const box::State& state) {
  using published::Homing;
  const auto axis = static_cast<std::size_t>(homed.axis);
  const auto homing = state.snapshot.axes.at(axis).homing;
  if (homing == Homing::possible) return std::nullopt;
  const std::string the_axis = std::string{"The axis "} + "XYZ"[axis];
  if (homing == Homing::silent)
    return Error{the_axis +
                 " is not counted: its encoder is silent, and the axis may be anywhere; read probebox status, and home "
                 "it when its counts have come back."};
  if (homing == Homing::absolute)
    return Error{the_axis + " has an encoder that tells its position itself: leave it out of the homing."};
  return Error{the_axis + " has not been seen to stand still for 0.1 s: home it at standstill."};
}

// A reference that was there already moves without anything else to show it.
void logMovedReference(const AxisHomed& homed, const std::string& connection, const published::AxisState& before) {
  constexpr double kLeast_mm = 1e-3;
  const double moved_mm = before.position_mm - homed.position_mm;
  if (!before.referenced || std::abs(moved_mm) <= kLeast_mm) return;
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.4f", moved_mm);
  logInfo(std::string{"The reference of axis "} + "XYZ"[static_cast<std::size_t>(homed.axis)] + " moved by " +
          text.data() + " mm (old - new position): homed again by " + (connection.empty() ? "a host" : connection) +
          ".");
}

// Otherwise the touches would show it, one by one, or the last of many.
std::optional<Error> whyTooSlow(const procedure::LiveMethod& method, const ProcedureOptions& options,
                                const procedure::Facts& facts, const procedure::Rates& measured) {
  const auto plan = std::make_unique<procedure::Plan>();
  procedure::fill(*plan, method, options);
  procedure::takeReadings(*plan, procedure::probeKindOf(facts));
  if (auto error = procedure::whyTooSlow(*plan, facts, measured)) return error;
  return procedure::whyTooLongToRecord(*plan, measured);
}

// Why a marker does not belong to what is being done.
std::optional<Error> whyStray(const Marker& marker, const box::State& state) {
  if (marker.phase > MarkerPhase::pass) return Error{"A marker's phase is 0 begin, 1 end, 2 abandon or 3 pass."};
  const auto& progress = state.procedure;
  if (!inProgress(progress.state)) return Error{"No procedure is running: start one with probebox calibrate."};
  if (marker.procedure == progress.run && marker.step == progress.step)
    return procedure::whyNotNow(progress, marker.phase);
  return Error{"The box is at step " + std::to_string(progress.step) + " of run " + std::to_string(progress.run) +
               ", not at step " + std::to_string(marker.step) + " of run " + std::to_string(marker.procedure) +
               ": read its status and send the marker for that step."};
}

}  // namespace

ControlRequestHandler::ControlRequestHandler(Identity identity, const Dependencies& dependencies,
                                             std::function<void(Reply)> reply_later)
    : identity_{std::move(identity)}, deps_{dependencies}, reply_later_{std::move(reply_later)} {}

std::optional<Reply> ControlRequestHandler::handle(const Caller& caller, const stream::PendingRequest& request,
                                                   const box::State& state, const LinkVitals& vitals) {
  followLoops(state.procedure);
  if (!caller.person) return handleSigned(caller, request, state, vitals);
  const auto body = signedBy(*caller.person, request.operation, request.body);
  if (body) return handleSigned(caller, {request.ticket, request.operation, *body}, state, vitals);
  Reply reply = refused(ErrorCode::not_permitted, body.error().what);
  reply.link = caller.link;
  reply.ticket = request.ticket;
  return reply;
}

std::optional<Reply> ControlRequestHandler::handleSigned(const Caller& caller, const stream::PendingRequest& request,
                                                         const box::State& state, const LinkVitals& vitals) {
  const auto operation = request.operation;
  const auto why_not = operation == Operation::provision ? whyNotProvision(caller, state) : std::nullopt;
  const bool for_worker = ResultRequestHandler::answers(operation) || UnitRequestHandler::answers(operation) ||
                          UpdateRequestHandler::answers(operation) || operation == Operation::loop_back;
  if (for_worker && !why_not) return askWorker(caller, request);
  Reply reply = why_not ? refused(ErrorCode::wrong_state, why_not->what) : answer(caller.may, request, state, vitals);
  reply.link = caller.link;
  reply.ticket = request.ticket;
  return reply;
}

Reply ControlRequestHandler::answer(const board::Access& may, const stream::PendingRequest& request,
                                    const box::State& state, const LinkVitals& vitals) {
  switch (request.operation) {
    case Operation::status:
      return describeStatus(state, vitals);
    case Operation::procedure_status:
      return describeProcedure(state);
    case Operation::describe_machine:
      return ok(machineDescription(identity_.machine, deps_.calibrations.factsNow(), state));
    case Operation::post_marker:
      return takeMarker(may, request.body, state);
    case Operation::start_procedure:
      return startProcedure(may, request.body, state);
    case Operation::abort_procedure:
      return abortProcedure(may, request.body, state);
    case Operation::corrections:
      return ok(correctionsAnswer(state, deps_.calibrations.valuesInUse()));
    case Operation::home_axes:
      return homeAxes(may, request.body, state);
    case Operation::tell_pose:
      return tellPose(may, request.body, state);
    case Operation::tell_positions:
      return tellPositions(may, request.body, state);
    case Operation::enable_sources:
      return enableSources(may, request.body, state);
    default:
      return refused(ErrorCode::unknown_operation, "This box does not know the operation: update its firmware.");
  }
}

Reply ControlRequestHandler::takeMarker(const board::Access& may, std::span<const std::byte> body,
                                        const box::State& state) {
  const auto request = messages::decode<messages::PostMarker::Request>(body);
  if (!request) return malformed(Operation::post_marker);
  const Marker marker{.procedure = request->procedure,
                      .step = request->step,
                      .phase = static_cast<MarkerPhase>(request->phase),
                      .rotary_angles_rad = request->rotary_angles_rad,
                      .tool = request->tool,
                      .nominal_speed_mm_s = request->nominal_speed_mm_s,
                      .at_rest = request->at_rest,
                      .at = {}};
  if (!may.allow_marker) return notPermitted("allow_marker");
  if (const auto error = post(marker, state, may)) return refused(ErrorCode::wrong_state, error->what);
  return ok(messages::Nothing{});
}

std::optional<Error> ControlRequestHandler::whyNot(const Event& said, const box::State& state,
                                                   const board::Access& may) const {
  if (const auto right = rightFor(said); !(may.*right.flag)) return Error{notPermitted(right.key).text};
  if (const auto* marker = std::get_if<Marker>(&said)) return whyStray(*marker, state);
  const auto* homed = std::get_if<AxisHomed>(&said);
  if (homed == nullptr) return std::nullopt;
  if (auto error = validateRange(*homed, deps_.travel)) return error;
  return whyNotHomed(*homed, state);
}

std::optional<Error> ControlRequestHandler::post(Event said, const box::State& state, const board::Access& may) {
  if (auto error = whyNot(said, state, may)) return error;
  std::visit([now = deps_.time.now()](auto& event) { event.at = now; }, said);
  if (!deps_.commands.push(said)) return Error{"The box is busy: send it again."};
  return std::nullopt;
}

std::optional<Error> ControlRequestHandler::take(std::span<const Event> said, const std::string& connection,
                                                 const box::State& state, const board::Access& may) {
  for (const auto& event : said) {
    if (const auto* cut = std::get_if<CutInhibit>(&event);
        cut != nullptr && deps_.connections.inhibits(connection) == cut->active)
      continue;  // it holds already
    if (auto error = whyNot(event, state, may)) return error;
  }
  // A cut first: the disk may still refuse it.
  for (const auto& event : said) {
    const auto* cut = std::get_if<CutInhibit>(&event);
    if (cut == nullptr) continue;
    if (auto error = deps_.connections.setInhibit(connection, cut->active, "")) return error;
  }
  for (const auto& event : said) {
    if (std::holds_alternative<CutInhibit>(event)) continue;
    if (auto error = post(event, state, may)) return error;
    if (const auto* homed = std::get_if<AxisHomed>(&event))
      logMovedReference(*homed, connection, state.snapshot.axes.at(static_cast<std::size_t>(homed->axis)));
  }
  return std::nullopt;
}

Reply ControlRequestHandler::homeAxes(const board::Access& may, std::span<const std::byte> body,
                                      const box::State& state) {
  const auto request = messages::decode<messages::HomeAxes::Request>(body);
  if (!request) return malformed(Operation::home_axes);
  if (!may.allow_homing) return notPermitted("allow_homing");
  if (const auto why = request->by.empty() ? std::nullopt : whyNoName(request->by))
    return refused(ErrorCode::malformed, why->what);
  constexpr unsigned kAxes = (1U << kLinearAxes) - 1;
  if (request->axes == 0 || (request->axes & ~kAxes) != 0)
    return refused(ErrorCode::malformed, "The axes are bits 0 to 2 (X Y Z), and at least one of them.");
  if (!std::ranges::all_of(request->position_mm, [](double mm) { return std::isfinite(mm); }))
    return refused(ErrorCode::malformed, "The position of a homed axis is not a number: give it in mm.");
  std::vector<Event> homed;
  std::string names;
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis) {
    if ((unsigned{request->axes} >> axis & 1U) == 0) continue;
    const AxisHomed one{.axis = static_cast<Axis>(axis), .position_mm = request->position_mm[axis], .at = {}};
    if (const auto error = validateRange(one, deps_.travel)) return refused(ErrorCode::refused, error->what);
    homed.emplace_back(one);
    names.append(" ").append(1, "XYZ"[axis]);
  }
  if (const auto error = take(homed, {}, state, may)) return refused(ErrorCode::wrong_state, error->what);
  if (!request->by.empty()) logInfo("axes" + names + " homed by " + request->by);
  return ok(messages::Nothing{});
}

Reply ControlRequestHandler::enableSources(const board::Access& may, std::span<const std::byte> body,
                                           const box::State& state) {
  const auto request = messages::decode<messages::EnableSources::Request>(body);
  if (!request) return malformed(Operation::enable_sources);
  if (!may.allow_accept) return notPermitted("allow_accept");
  if (const auto error = whyNotSummed(request->mask, state)) return refused(ErrorCode::refused, error->what);
  if (state.snapshot.inhibited)
    return refused(ErrorCode::wrong_state,
                   "A cut is in progress, and results cannot change: try again when it is over.");
  if (!deps_.commands.push(SourcesEnabled{.mask = request->mask, .at = deps_.time.now()}))
    return refused(ErrorCode::busy, "The box is busy: send the request again.");
  return ok(messages::Nothing{});
}

Reply ControlRequestHandler::startProcedure(const board::Access& may, std::span<const std::byte> body,
                                            const box::State& state) {
  const auto request = messages::decode<messages::StartProcedure::Request>(body);
  if (!request) return malformed(Operation::start_procedure);
  if (!may.allow_calibrate) return notPermitted("allow_calibrate");
  const procedure::LiveMethod* method = procedure::methodNamed(request->method);
  if (method == nullptr) {
    std::string known;
    for (const auto name : procedure::methodNames()) known.append(known.empty() ? "" : ", ").append(name);
    const auto meant = didYouMean(request->method, procedure::methodNames());
    return refused(ErrorCode::not_found,
                   "This box has no procedure '" + request->method + "'" + meant + "; it has: " + known + ".");
  }
  const auto facts = deps_.calibrations.factsNow();
  TRY(const auto options, plannedOptions(*method, *request, facts, state));
  if (const auto error = procedure::validate(*method, options, deps_.deflection_limit_mm))
    return refused(ErrorCode::refused, error->what);
  const bool has_delay = state.snapshot.delay.calibrated;
  if (const auto why =
          procedure::whyUnready(*method, facts, has_delay,
                                procedure::readBy({.head = request->options.head, .shank = request->options.shank})))
    return refusedFor(*why);
  if (method->finds_a_place) {
    for (std::size_t axis = 0; axis < kLinearAxes; ++axis) {
      if (state.snapshot.axes[axis].referenced) continue;
      return refused(ErrorCode::wrong_state, std::string{"This method measures machine positions, and the axis "} +
                                                 "XYZ"[axis] +
                                                 " is not referenced: home it, or move it over its reference mark.");
    }
  }
  const bool starting = last_run_ > state.procedure.run;
  if (starting || inProgress(state.procedure.state)) {
    return refused(ErrorCode::busy, "Run " + std::to_string(std::max(last_run_, state.procedure.run)) +
                                        " is still in progress: wait for its end or abort it.");
  }
  if (state.map.state != ClockState::locked)
    return refused(ErrorCode::wrong_state, "The master clock is not locked: check the sync line, then start again.");
  if (const auto error = state.rates ? whyTooSlow(*method, options, facts, *state.rates) : std::nullopt)
    return refused(ErrorCode::wrong_state, error->what);
  const ProcedureStarted started{.run = std::max(last_run_, state.procedure.run) + 1,
                                 .method = method->number,
                                 .at = deps_.time.now(),
                                 .options = options};
  if (!deps_.commands.push(started)) return refused(ErrorCode::busy, "The box is busy: try again.");
  last_run_ = started.run;
  options_ = options;
  probe_ = procedure::probeKindOf(facts);
  procedure::fill(plan_, *method, options_);
  procedure::takeReadings(plan_, probe_);
  return ok(messages::StartProcedure::Answer{.run = last_run_});
}

Reply ControlRequestHandler::abortProcedure(const board::Access& may, std::span<const std::byte> body,
                                            const box::State& state) {
  const auto request = messages::decode<messages::AbortProcedure::Request>(body);
  if (!request) return malformed(Operation::abort_procedure);
  if (!may.allow_calibrate) return notPermitted("allow_calibrate");
  // One that the core has not published yet can be given up as well.
  const std::uint32_t run = std::max(last_run_, state.procedure.run);
  const bool starting = run > state.procedure.run;
  if (!starting && !inProgress(state.procedure.state))
    return refused(ErrorCode::wrong_state, "No procedure is running.");
  if (request->run != 0 && request->run != run) {
    return refused(ErrorCode::wrong_state, "Run " + std::to_string(request->run) + " is over: the box is at run " +
                                               std::to_string(run) + ", which goes on.");
  }
  if (!starting && state.procedure.state == procedure::State::solving)
    return refused(ErrorCode::wrong_state,
                   "All touches are done and are being solved: wait for the result, and do not accept it.");
  const ProcedureAborted aborted{.run = run, .at = deps_.time.now()};
  if (!deps_.commands.push(aborted)) return refused(ErrorCode::busy, "The box is busy: try again.");
  return ok(messages::Nothing{});
}

// Whoever may not do it at all hears that first, from the handler itself.
std::optional<Error> ControlRequestHandler::whyNotProvision(const Caller& caller, const box::State& state) const {
  if (!caller.may.allow_provision.value_or(false)) return std::nullopt;
  return whyNotAtRest({.cut_is_on = state.snapshot.inhibited || deps_.connections.anyInhibits(),
                       .run_is_on = last_run_ > state.procedure.run || inProgress(state.procedure.state)});
}

std::optional<Reply> ControlRequestHandler::askWorker(const Caller& caller, const stream::PendingRequest& request) {
  auto body = std::make_shared<std::vector<std::byte>>(request.body.begin(), request.body.end());
  const auto job = [this, caller, body, ticket = request.ticket, operation = request.operation] {
    const auto then = [this, link = caller.link, ticket](Reply reply) {
      reply.link = link;
      reply.ticket = ticket;
      reply_later_(std::move(reply));
    };
    if (operation == Operation::loop_back) return then(deps_.loop_back.answer(*body, caller.may));
    if (UnitRequestHandler::answers(operation)) return then(deps_.unit.answer(operation, *body, caller.may));
    if (UpdateRequestHandler::answers(operation)) return then(deps_.updates.answer(operation, *body, caller));
    deps_.results.answer(operation, *body, caller, then);
  };
  const auto busy = [&](const char* why) {
    Reply reply = refused(ErrorCode::busy, why);
    reply.link = caller.link;
    reply.ticket = request.ticket;
    return reply;
  };
  const auto rank = board::givesARight(caller.may) ? Worker::Rank::usual : Worker::Rank::without_rights;
  if (request.operation != Operation::loop_back)
    return deps_.worker.post(job, rank) ? std::nullopt
                                        : std::optional{busy("Too many requests are waiting: try again.")};
  // It takes seconds: one after the other, hosts would lose patience.
  if (deps_.loop_back.begin()) {
    if (deps_.worker.post(job, Worker::Rank::patient)) return std::nullopt;
    deps_.loop_back.end();
  }
  return busy("The loop-back is already being measured, or too many requests are waiting: try again in a few seconds.");
}

}  // namespace probebox::app
