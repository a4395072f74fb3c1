#pragma once
#include <limits>
#include <string>

#include "firmware/procedure/plan/plan.hpp"

namespace probebox::procedure {

// What is said against a run; nothing where it may begin.
inline std::string refusal(const LiveMethod& method, const ProcedureOptions& options,
                           double deflection_limit_mm = std::numeric_limits<double>::infinity()) {
  const auto why = validate(method, options, deflection_limit_mm);
  return why ? why->what : "";
}

}  // namespace probebox::procedure
