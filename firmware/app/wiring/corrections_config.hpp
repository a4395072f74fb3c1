#pragma once
#include "board/describe/machine.hpp"
#include "firmware/corrections/corrections.hpp"

namespace probebox::app {

// What machine.toml says about references, screws, rotary axes, the turning axis and the limits of corrections.
corrections::CorrectionsConfig correctionsConfig(const board::Machine& machine);

}  // namespace probebox::app
