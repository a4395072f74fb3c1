#pragma once
#include <string>
#include <string_view>

namespace probebox::messages {

// Returns the name of a structure for pages and readers: that of its type without namespaces, such as "AxisState".
template <class T>
std::string structureName() {
  std::string_view all = __PRETTY_FUNCTION__;
  all = all.substr(all.find("T = ") + 4);
  all = all.substr(0, all.find_first_of(";]"));
  const auto space = all.rfind("::");
  return std::string{space == std::string_view::npos ? all : all.substr(space + 2)};
}

}  // namespace probebox::messages
