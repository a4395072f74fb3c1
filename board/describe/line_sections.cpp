#include "board/describe/line_sections.hpp"

#include <cstdint>
#include <optional>

namespace probebox::board {
namespace {

LineAddress lineAddress(Section& section) {
  const auto* node = section.node("line");
  if (node == nullptr) return {};
  if (node->is_string()) return section.text("line");
  const auto offset = node->value_exact<std::int64_t>();
  if (!offset || *offset < 0 || *offset > 65535) {
    section.problem("line", "is neither an offset nor a name: write line = 4, or line = \"GPIO17\"");
    return {};
  }
  return static_cast<unsigned>(*offset);
}

}  // namespace

GpioLine gpioLine(Section& section, const std::string& default_name, TakenLines& taken) {
  GpioLine line;
  line.name = section.text("name", default_name);
  line.chip = section.text("chip", {}, kLongestAddress);
  line.line = lineAddress(section);
  line.active = section.choice("active", {"high", "low"}, 0) == 0 ? ActiveLevel::high : ActiveLevel::low;
  if (section.good("line") && section.good("chip")) {
    const auto [place, is_new] = taken.lines.try_emplace({line.chip, line.line}, line.name);
    if (!is_new)
      section.problem("line", "of " + inQuotes(line.name) + " is used by " + inQuotes(place->second) +
                                  " already: connect and describe another line");
  }
  if (!line.name.empty() && !taken.names.insert(line.name).second)
    section.problem("name", "= " + inQuotes(line.name) + " is used twice: give each line a name of its own");
  return line;
}

GpioLine lineOf(Section& whole, const std::string& key, const std::string& whole_name, TakenLines& taken) {
  auto section = whole.section(key);
  auto line = gpioLine(section, whole_name + " " + key, taken);
  section.finish();
  return line;
}

}  // namespace probebox::board
