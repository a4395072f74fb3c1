#include <algorithm>
#include <cmath>

#include "firmware/app/host/control_request_handler.hpp"
#include "protocol/messages/control.hpp"
#include "protocol/units/angle.hpp"
#include "protocol/units/tolerances.hpp"

// Requests by which a controller reports its axes and its tool over a link.
namespace probebox::app {

using messages::ErrorCode;
using messages::Operation;

Reply ControlRequestHandler::tellPose(const board::Access& may, std::span<const std::byte> body,
                                      const box::State& state) {
  const auto request = messages::decode<messages::TellPose::Request>(body);
  if (!request) return malformed(Operation::tell_pose);
  if (!may.allow_marker) return notPermitted("allow_marker");
  constexpr unsigned kAxes = (1U << kRotaryAxes) - 1;
  if ((request->axes & ~kAxes) != 0 || (request->axes == 0 && !request->has_tool))
    return refused(ErrorCode::malformed,
                   "A pose has angles of axes, bits 0 to 2 (A B C), or a tool, and at least one of them.");
  constexpr double kMost_rad = kMostTurn_deg * kDegree;
  if (!std::ranges::all_of(request->angles_rad, [](double rad) { return std::abs(rad) <= kMost_rad; }))
    return refused(ErrorCode::malformed, "An angle is out of range: tell -3600 to 3600 degrees.");
  if (!(request->tool_length_mm >= 0 && request->tool_length_mm <= kMostToolLength_mm))
    return refused(ErrorCode::malformed, "The length of the tool is out of range: tell 0 to 2000 mm.");
  const PoseTold told{.axes = request->axes,
                      .angles_rad = request->angles_rad,
                      .has_tool = request->has_tool,
                      .tool = request->tool,
                      .tool_length_mm = request->tool_length_mm,
                      .at = {}};
  if (const auto error = post(told, state, may)) return refused(ErrorCode::wrong_state, error->what);
  return ok(messages::Nothing{});
}

Reply ControlRequestHandler::tellPositions(const board::Access& may, std::span<const std::byte> body,
                                           const box::State& state) {
  const auto request = messages::decode<messages::TellPositions::Request>(body);
  if (!request) return malformed(Operation::tell_positions);
  if (!may.allow_marker) return notPermitted("allow_marker");
  constexpr unsigned kAxes = (1U << (kLinearAxes + kRotaryAxes)) - 1;
  if (request->axes == 0 || (request->axes & ~kAxes) != 0)
    return refused(ErrorCode::malformed, "The axes are bits 0 to 5 (X Y Z A B C), and at least one of them.");
  if ((request->axes & ~deps_.control_axes) != 0)
    return refused(
        ErrorCode::refused,
        "An axis is told whose encoder is not the controller: write kind = \"control\" in its [encoder.AXIS] "
        "of box.toml, or leave its bit away.");
  const ControlPositions told{.run = request->run,
                              .counter = request->counter,
                              .axes = request->axes,
                              .counts = request->counts,
                              .newest = true,
                              .at = {}};
  if (const auto error = post(told, state, may)) return refused(ErrorCode::wrong_state, error->what);
  return ok(messages::Nothing{});
}

}  // namespace probebox::app
