#pragma once
#include <map>
#include <set>
#include <string>
#include <utility>

#include "board/describe/gpio_line.hpp"
#include "board/describe/section.hpp"

// Lines of gpio chips in box.toml.
namespace probebox::board {

// Lines and names already in use: a line can have only one role, and a name must be unique.
struct TakenLines {
  std::map<std::pair<std::string, LineAddress>, std::string> lines;
  std::set<std::string> names;
};

// Reads the keys of a line and leaves the others of its section alone.
GpioLine gpioLine(Section& section, const std::string& default_name, TakenLines& taken);

// Reads one of several lines that belong together: `key` = { chip = ..., line = ... }; its name is "WHOLE KEY".
GpioLine lineOf(Section& whole, const std::string& key, const std::string& whole_name, TakenLines& taken);

}  // namespace probebox::board
