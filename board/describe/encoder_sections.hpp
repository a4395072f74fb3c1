#pragma once
#include "board/describe/box.hpp"
#include "board/describe/line_sections.hpp"
#include "board/describe/section.hpp"

namespace probebox::board {

// Reads [encoder.AXIS] of box.toml. `box`: all that was read before it, the devices and index lines among it.
Encoders readEncoders(Section& root, const Box& box, TakenLines& taken);

}  // namespace probebox::board
