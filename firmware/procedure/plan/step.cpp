#include "firmware/procedure/plan/step.hpp"

namespace probebox::procedure {

void add(Plan& plan, const Step& step) {
  if (plan.step_count == kMostSteps) return;
  plan.steps[plan.step_count] = step;
  plan.steps[plan.step_count].touch.step = static_cast<std::uint32_t>(plan.step_count);
  ++plan.step_count;
}

}  // namespace probebox::procedure
