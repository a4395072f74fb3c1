#pragma once
#include "board/describe/box.hpp"
#include "board/describe/line_sections.hpp"
#include "board/describe/section.hpp"

namespace probebox::board {

// Reads [encoder.AXIS] of box.toml. box: with everything that was read before, including devices and index lines.
void readEncoders(Section& root, TakenLines& taken, Box& box);

}  // namespace probebox::board
