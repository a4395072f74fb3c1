#include "tools/plan/unsuited.hpp"

#include <array>
#include <cstdio>
#include <memory>
#include <string>

#include "firmware/metrology/touch/retract.hpp"
#include "firmware/procedure/plan/capacity.hpp"
#include "firmware/procedure/plan/plan.hpp"
#include "firmware/procedure/plan/rates.hpp"

namespace probebox::plan {
namespace {

using metrology::Refusal;

std::unique_ptr<procedure::Plan> planOf(const procedure::LiveMethod& method, const ProcedureOptions& options,
                                        const SetUp& set_up) {
  auto plan = std::make_unique<procedure::Plan>();  // large
  procedure::fill(*plan, method, options);
  procedure::takeReadings(
      *plan, set_up.switch_repeatability_um ? procedure::ProbeKind::trigger : procedure::ProbeKind::scanning);
  return plan;
}

}  // namespace

std::optional<Refusal> whyUnsuited(const procedure::LiveMethod& method, const ProcedureOptions& options,
                                   const procedure::Facts& facts, const SetUp& set_up) {
  const auto plan = planOf(method, options, set_up);
  procedure::Rates rates{.positions_hz = set_up.axis_rates_hz, .deflections_hz = set_up.probe_rate_hz};
  for (double& hz : rates.positions_hz) hz = hz > 0 ? hz : set_up.machine_rate_hz;
  if (const auto why = procedure::whyTooSlow(*plan, facts, rates)) return Refusal{"too-few-samples", why->what};
  if (const auto why = procedure::whyTooLongToRecord(*plan, rates)) return Refusal{"recording-full", why->what};
  return std::nullopt;
}

std::optional<Refusal> whyTooSluggish(const procedure::LiveMethod& method, const ProcedureOptions& options,
                                      const SetUp& set_up, const Refusal& refused) {
  const auto plan = planOf(method, options, set_up);
  for (std::size_t i = 0; i < plan->step_count; ++i) {
    const procedure::Step& step = plan->steps[i];
    if (step.kind != procedure::Kind::touch && step.kind != procedure::Kind::in_out) continue;
    const double speed = step.touch.retract_speed_mm_s, needed_mm = speed * speed / (2 * set_up.acceleration_mm_s2);
    const double given_mm = (1 - metrology::RetractNeeds::kHighest) * step.overtravel_mm;
    if (needed_mm <= given_mm) continue;
    std::array<char, 320> text{};
    std::snprintf(
        text.data(), text.size(),
        "at %g mm/s2 the machine needs %.3g mm to reach %g mm/s, and a touch has %.3g mm of its overtravel for "
        "it: state the acceleration of the machine (--acceleration), or choose a lower speed (--speed) or more "
        "overtravel (--overtravel)",
        set_up.acceleration_mm_s2, needed_mm, speed, given_mm);
    return Refusal{refused.name, text.data()};
  }
  return std::nullopt;
}

}  // namespace probebox::plan
