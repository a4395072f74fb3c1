#include "board/describe/usb_text.hpp"

#include <algorithm>
#include <utility>

namespace probebox::board {

std::string usbText(Section& section, std::string_view key, std::optional<std::string> usual) {
  auto text = section.text(key, std::move(usual));
  if (!std::ranges::all_of(text, [](char c) { return c >= ' ' && c <= '~'; }))
    section.problem(key, "= " + inQuotes(text) + " goes out over USB: write plain ASCII characters");
  return text;
}

}  // namespace probebox::board
