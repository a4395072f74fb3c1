#include "firmware/app/host/loop_back_request_handler.hpp"

#include <string>
#include <utility>

#include "drivers/gpio/lines.hpp"
#include "drivers/gpio/stamp_lateness.hpp"
#include "protocol/messages/self_test.hpp"

namespace probebox::app {
namespace {

using messages::ErrorCode;
using Question = messages::LoopBack;

constexpr std::uint32_t kUsualPulses = 500;
constexpr std::uint32_t kFewestPulses = 10;  // fewer say little of a median

}  // namespace

Reply LoopBackRequestHandler::answer(std::span<const std::byte> body, const board::Access& may) {
  Reply reply = measured(body, may);
  end();
  return reply;
}

Reply LoopBackRequestHandler::measured(std::span<const std::byte> body, const board::Access& may) {
  const auto request = messages::decode<Question::Request>(body);
  if (!request) return malformed(Question::kOperation);
  if (!may.allow_calibrate) return notPermitted("allow_calibrate");
  if (!lines_) {
    return refused(ErrorCode::not_found,
                   "This box has no loop-back: connect one of its outputs to one of its inputs with a wire, and name "
                   "both in [loop_back] of box.toml.");
  }
  const std::uint32_t pulses = request->pulses == 0 ? kUsualPulses : request->pulses;
  if (pulses < kFewestPulses || pulses > Question::kMostPulses) {
    return refused(ErrorCode::refused, std::to_string(pulses) + " pulses are out of range: ask for " +
                                           std::to_string(kFewestPulses) + " to " +
                                           std::to_string(Question::kMostPulses) + ".");
  }
  const auto measured = wire_->measure(pulses);
  if (!measured) return refused(ErrorCode::wrong_state, measured.error().what);
  const auto late = gpio::stampLateness(*measured, *lines_);
  if (!late) return refused(ErrorCode::refused, late.error().what);
  return ok(Question::Answer{.output = gpio::describe(lines_->output),
                             .input = gpio::describe(lines_->input),
                             .pulses = static_cast<std::uint32_t>(late->pulses),
                             .lost = static_cast<std::uint32_t>(late->lost),
                             .median_ns = late->median.count(),
                             .p99_ns = late->p99.count(),
                             .largest_ns = late->largest.count(),
                             .bracket_ns = late->bracket.count(),
                             .sigma_ns = late->sigma.count()});
}

}  // namespace probebox::app
