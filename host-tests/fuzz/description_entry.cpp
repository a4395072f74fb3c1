#include "description_entry.hpp"

#include <algorithm>
#include <array>
#include <cctype>

#include "board/describe/parse.hpp"
#include "require.hpp"

namespace {

using namespace probebox;
using fuzz::require;

template <class T>
std::string problems(const Outcome<T>& outcome) {
  if (outcome.ok()) return "";
  require(!outcome.error().what.empty());
  return outcome.error().what;
}

std::string read(std::string_view name, std::string_view text) {
  if (name == "box.toml") return problems(board::parseBox(text, name));
  if (name == "machine.toml") return problems(board::parseMachine(text, name));
  if (name == "probe.toml") return problems(board::parseProbe(text, name));
  if (name == "service.toml") return problems(board::parseService(text, name));
  if (name == "unit.toml") return problems(board::parseUnit(text, name));
  return problems(board::parseWorld(text, name));
}

// "machine.toml:12: ...", short and without control characters.
bool isASentence(std::string_view line, std::string_view name) {
  constexpr std::size_t kLongest = 3000;  // bytes
  if (!line.starts_with(name) || line.size() > kLongest) return false;
  line.remove_prefix(name.size());
  if (line.starts_with(": and ")) return true;  // how many more there are
  if (!line.starts_with(":")) return false;
  const auto digits = std::ranges::find_if_not(line.substr(1), [](unsigned char c) { return std::isdigit(c) != 0; });
  const auto number = std::string_view{line.begin() + 1, digits};
  const bool numbered = !number.empty() && number != "0" && line.substr(1 + number.size()).starts_with(": ");
  return numbered && std::ranges::none_of(line, [](unsigned char c) { return std::iscntrl(c) != 0; });
}

}  // namespace

std::string problemsOf(std::string_view file_name, std::string_view text) {
  const auto all = read(file_name, text);
  for (std::string_view rest = all; !rest.empty();) {
    const auto line = rest.substr(0, rest.find('\n'));
    require(isASentence(line, file_name));
    rest.remove_prefix(std::min(rest.size(), line.size() + 1));
  }
  return all;
}

int feedDescription(const std::uint8_t* data, std::size_t size) {
  fuzz::feeding({data, size});
  constexpr std::array kNames{"box.toml", "machine.toml", "probe.toml", "service.toml", "world.toml", "unit.toml"};
  if (size < 1) return 0;
  std::string text;
  for (std::size_t k = 1; k < size; ++k) text += static_cast<char>(data[k]);
  problemsOf(kNames.at(data[0] % kNames.size()), text);
  return 0;
}
