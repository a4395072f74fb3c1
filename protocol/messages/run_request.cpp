#include "protocol/messages/run_request.hpp"

#include <algorithm>

namespace probebox::messages {
namespace {

// Copies the options that both have under the same name.
void copyOptions(const auto& from, auto& to) {
  to.overtravel_mm = from.overtravel_mm;
  to.clearance_mm = from.clearance_mm;
  to.approach_rad = from.approach_rad;
  to.arc_rad = from.arc_rad;
  to.angles = from.angles;
  to.balls = from.balls;
  to.axis = from.axis;
  to.turns = from.turns;
  to.tool = from.tool;
  to.head = from.head;
  to.shank = from.shank;
  to.stations = from.stations;
  to.mounts = from.mounts;
  to.contacts = from.contacts;
  to.has_temperature = from.has_temperature;
  to.temperature_c = from.temperature_c;
}

}  // namespace

StartProcedure::Request requestOf(std::string_view method, const ProcedureOptions& options) {
  StartProcedure::Request request;
  request.method = method;
  request.speeds_mm_s = {options.speeds_mm_s.begin(), options.speeds_mm_s.begin() + options.speed_count};
  copyOptions(options, request);
  return request;
}

std::optional<ProcedureOptions> optionsOf(const StartProcedure::Request& request) {
  if (request.speeds_mm_s.size() > kMostSpeeds) return std::nullopt;
  ProcedureOptions options;
  options.speed_count = static_cast<std::uint8_t>(request.speeds_mm_s.size());
  std::ranges::copy(request.speeds_mm_s, options.speeds_mm_s.begin());
  copyOptions(request, options);
  return options;
}

}  // namespace probebox::messages
