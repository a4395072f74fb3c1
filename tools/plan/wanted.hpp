#pragma once
#include "firmware/procedure/plan/live_method.hpp"
#include "protocol/events/procedure.hpp"

namespace probebox::plan {

// The request for a run, as the options of `calibrate` state it.
struct Wanted {
  const procedure::LiveMethod* method{};
  ProcedureOptions options{};  // 0: the default of the method
};

}  // namespace probebox::plan
