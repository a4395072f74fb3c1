#pragma once
#include <string>
#include <vector>

#include "board/describe/box.hpp"
#include "drivers/gpio/decode.hpp"

namespace probebox::gpio {

// A line as box.toml names it, before its chip is asked for the offset.
struct RequestedLine {
  std::string name;
  board::LineAddress address;
  WatchedLine watched;  // its offset is filled in when the chip is open
};

// "line 4 (sync)", for messages to a person.
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

// Every line of the box for itself: sync, then triggers, index lines, skips and inhibits, in the order of box.toml.
// Asked for like that, a line that cannot be had takes no other along, and none fills up another's buffer in the
// kernel.
std::vector<ChipLines> linesApart(const board::Box& box);

// "sync", "trigger", ...: the source that falls silent when this line does.
constexpr Source sourceOf(LineRole role) {
  return role == LineRole::sync ? Source::sync : Source::trigger;
}

}  // namespace probebox::gpio
