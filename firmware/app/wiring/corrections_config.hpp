#pragma once
#include "board/describe/machine.hpp"
#include "firmware/corrections/corrections.hpp"

namespace probebox::app {

// Reads references, screws, rotary axes, the spindle axis and the limits of corrections from machine.toml.
corrections::CorrectionsConfig correctionsConfig(const board::Machine& machine);

}  // namespace probebox::app
