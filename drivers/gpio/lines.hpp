#pragma once
#include <string>
#include <vector>

#include "board/describe/box.hpp"
#include "drivers/gpio/decode.hpp"

namespace probebox::gpio {

// A line as named in box.toml, before its offset is known.
struct RequestedLine {
  std::string name;
  board::LineAddress address;
  WatchedLine watched;  // its offset is filled in when the chip is open
};

// "line 4 (sync)", for messages.
std::string lineText(const board::LineAddress& address, const std::string& name);
inline std::string lineText(const RequestedLine& line) {
  return lineText(line.address, line.name);
}
// "gpiochip0 line 4 (sync)"
std::string describe(const board::GpioLine& line);

struct ChipLines {
  std::string chip;
  std::vector<RequestedLine> lines;
};

// A line of the box with what it is for; `described` is part of the Box.
struct BoxLine {
  const board::GpioLine* described;
  LineRole role;
  std::uint8_t number;  // within the role; the axis of an index line
};
// Lists all lines of the box in the order sync, triggers, index lines, skips, inhibits.
std::vector<BoxLine> allLines(const board::Box& box);

// Lists those of them that are on a gpio chip, each for a request of its own:
// a missing line then does not affect others, and no line fills the kernel buffer of another.
std::vector<ChipLines> linesApart(const board::Box& box);

// "sync", "trigger", ...: the source of this line.
constexpr Source sourceOf(LineRole role) {
  return role == LineRole::sync ? Source::sync : Source::trigger;
}

}  // namespace probebox::gpio
