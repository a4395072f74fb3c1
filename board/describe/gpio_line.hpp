#pragma once
#include <cstdint>
#include <string>
#include <variant>

namespace probebox::board {

// A line by its offset on the chip, or by its name in the kernel.
using LineAddress = std::variant<unsigned, std::string>;

enum class ActiveLevel : std::uint8_t { high, low };

// One digital line of the box: an input, except for the output of the loop-back.
struct GpioLine {
  std::string name;  // for messages to a person: "sync", "trigger 1"
  std::string chip;  // "gpiochip0", a label, or a path such as "/dev/gpiochip0"
  LineAddress line{0U};
  ActiveLevel active{ActiveLevel::high};
};

}  // namespace probebox::board
