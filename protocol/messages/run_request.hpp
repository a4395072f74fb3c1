#pragma once
#include <optional>
#include <string_view>

#include "protocol/events/procedure.hpp"
#include "protocol/messages/procedures.hpp"

namespace probebox::messages {

// The options of a run as a request carries them, and back. The options that a box finds by itself (travel, tools,
// angles and axis of B, heights) are not sent.
StartProcedure::Request requestOf(std::string_view method, const ProcedureOptions& options);
// Nothing when the request has more speeds than a run can have.
std::optional<ProcedureOptions> optionsOf(const StartProcedure::Request& request);

}  // namespace probebox::messages
