#pragma once
#include "board/describe/parse.hpp"
#include "firmware/procedure/facts/facts.hpp"

namespace probebox::procedure {

// Facts of machine.toml; those of the probe stay as they are by default.
Facts factsOf(const board::Machine& machine);
// Facts of machine.toml and probe.toml.
Facts factsOf(const board::Descriptions& descriptions);

}  // namespace probebox::procedure
