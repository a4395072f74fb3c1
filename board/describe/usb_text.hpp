#pragma once
#include <optional>
#include <string>
#include <string_view>

#include "board/describe/section.hpp"

namespace probebox::board {

// Reads a text that goes into a USB string descriptor, and through the script that sets the gadget up: plain ASCII.
std::string usbText(Section& section, std::string_view key, std::optional<std::string> usual = {});

}  // namespace probebox::board
