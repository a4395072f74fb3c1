#include "firmware/procedure/plan/live_method.hpp"

#include <algorithm>

#include "firmware/metrology/dataset/method_parts.hpp"

namespace probebox::procedure {

bool LiveMethod::takesSpindle() const {
  return std::ranges::find(solver->keys, metrology::key::kSpindle.name, &metrology::MethodKey::name) !=
         solver->keys.end();
}

const LiveMethod* methodNumbered(LiveMethods methods, std::uint16_t number) {
  const auto found = std::ranges::find(methods, number, [](const LiveMethod* method) { return method->number; });
  return found == methods.end() ? nullptr : *found;
}

std::size_t readingsOf(const LiveMethod& method, const ProcedureOptions& with, const LoopState& loops) {
  const std::size_t poses = method.poses.count(with, loops);
  return poses > 1 ? poses + method.closes : poses;
}

Pose poseOf(const LiveMethod& method, const ProcedureOptions& with, const LoopState& loops, std::size_t reading) {
  return method.poses.at(with, loops, reading % method.poses.count(with, loops));
}

ProcedureOptions withDefaults(const LiveMethod& method, ProcedureOptions options) {
  const ProcedureOptions& usual = method.usual;
  const auto take = [](auto& value, const auto& fallback) {
    if (value == std::decay_t<decltype(fallback)>{}) value = fallback;
  };
  if (options.speed_count == 0) options.speeds_mm_s = usual.speeds_mm_s;
  if (options.b_count == 0) options.b_angles_rad = usual.b_angles_rad;
  if (options.tool_count == 0) options.tools = usual.tools;
  take(options.speed_count, usual.speed_count);
  take(options.b_count, usual.b_count);
  take(options.tool_count, usual.tool_count);
  take(options.overtravel_mm, usual.overtravel_mm);
  take(options.clearance_mm, usual.clearance_mm);
  take(options.approach_rad, usual.approach_rad);
  take(options.arc_rad, usual.arc_rad);
  take(options.angles, usual.angles);
  take(options.balls, usual.balls);
  take(options.b_axis, usual.b_axis);
  take(options.mounts, usual.mounts);
  take(options.faces, usual.faces);
  return options;
}

}  // namespace probebox::procedure
