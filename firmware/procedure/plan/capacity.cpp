#include "firmware/procedure/plan/capacity.hpp"

#include <algorithm>
#include <chrono>

#include "firmware/capture/near_contact.hpp"
#include "firmware/metrology/touch/retract.hpp"
#include "firmware/metrology/touch/switched_touch.hpp"

namespace probebox::procedure {
namespace {

// Of what capture::keepNearContact keeps, s; 0 for a step that is no touch.
double recordedFor(const Step& step, double deflections_hz) {
  if (step.kind != Kind::touch && step.kind != Kind::in_out) return 0;
  const double at_least_s = std::chrono::duration<double>{capture::kFree}.count();
  const double rows_s = step.touch.by_edges ? 0 : static_cast<double>(capture::kFreeRows) / deflections_hz;
  const double free_s = std::max(at_least_s, rows_s), speed = step.touch.retract_speed_mm_s;
  const double depth_mm = step.overtravel_mm, clear_s = step.clearance_mm / speed;
  if (step.touch.by_edges)
    return 2 * (depth_mm / speed + std::min(clear_s, free_s + metrology::kWayAtAnEdge_mm / speed));
  // In by the overtravel, and out by so many of it.
  const double read_mm = metrology::RetractNeeds::kUntil * depth_mm;
  const double out_mm = std::min(read_mm + free_s * speed, depth_mm + step.clearance_mm + step.run_out_mm);
  return std::min(clear_s, free_s) + (depth_mm + out_mm) / speed;
}

}  // namespace

std::optional<Error> whyTooLongToRecord(const Plan& plan, const Rates& rates, const capture::Capacity& capacity) {
  double positions_s = 0, deflections_s = 0;
  for (std::size_t i = 0; i < plan.step_count; ++i) {
    const double step_s = recordedFor(plan.steps[i], rates.deflections_hz);
    positions_s += step_s;
    if (!plan.steps[i].touch.by_edges) deflections_s += step_s;
  }
  const bool fits = positions_s * std::ranges::min(rates.positions_hz) <= static_cast<double>(capacity.machine_rows) &&
                    deflections_s * rates.deflections_hz <= static_cast<double>(capacity.probe_rows);
  return fits ? std::nullopt : std::optional{Error{kExceedsCapacity}};
}

}  // namespace probebox::procedure
