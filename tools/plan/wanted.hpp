#pragma once
#include "firmware/procedure/plan/live_method.hpp"
#include "firmware/procedure/plan/readiness.hpp"
#include "protocol/events/event.hpp"

namespace probebox::plan {

// The request for a run, as the options of `calibrate` state it.
struct Wanted {
  const procedure::LiveMethod* method{};
  ProcedureOptions options{};  // 0: the default of the method
  unsigned turns{};            // of a screw; 0: the default of the method
  procedure::ReadBy by{};
};

}  // namespace probebox::plan
