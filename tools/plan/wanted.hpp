#pragma once
#include "firmware/procedure/plan/live_method.hpp"
#include "protocol/events/procedure.hpp"

namespace probebox::plan {

// A run before it is begun: what calibrate is told.
struct Wanted {
  const procedure::LiveMethod* method{};
  ProcedureOptions options{};  // zeros are the method's own
};

}  // namespace probebox::plan
