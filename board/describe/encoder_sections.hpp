#pragma once
#include "board/describe/box.hpp"
#include "board/describe/line_sections.hpp"
#include "board/describe/section.hpp"

namespace probebox::board {

// Reads [encoder.AXIS] of box.toml. box: with everything that was read before, including devices and index lines.
Encoders readEncoders(Section& root, const Box& box, TakenLines& taken);

}  // namespace probebox::board
