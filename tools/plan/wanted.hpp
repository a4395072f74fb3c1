#pragma once
#include "firmware/procedure/plan/live_method.hpp"
#include "firmware/procedure/plan/readiness.hpp"
#include "protocol/events/event.hpp"

namespace probebox::plan {

// A run before it is begun: what calibrate is told.
struct Wanted {
  const procedure::LiveMethod* method{};
  ProcedureOptions options{};  // zeros are the method's own
  unsigned turns{};            // of a screw; 0: the method's own
  procedure::ReadBy by{};
};

}  // namespace probebox::plan
