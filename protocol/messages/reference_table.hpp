#pragma once
#include <cstddef>
#include <fstream>
#include <iostream>
#include <sstream>
#include <string>
#include <string_view>
#include <type_traits>

// What the programs that write reference pages from field lists share.
namespace probebox::messages {

// "u16", "3 x i32".
template <class T>
std::string packedTypeName() {
  if constexpr (std::is_integral_v<T>)
    return (std::is_signed_v<T> ? "i" : "u") + std::to_string(8 * sizeof(T));
  else
    return std::to_string(std::tuple_size_v<T>) + " x " + packedTypeName<typename T::value_type>();
}

// Table in Markdown of a structure of numbers without padding, by its field list.
template <class T>
std::string packedTable() {
  std::string rows = "| offset | field | type | meaning |\n|---|---|---|---|\n";
  std::size_t offset = 0;
  const T value{};
  T::fields(value, [&](std::string_view name, const auto& member, std::string_view meaning) {
    rows += "| " + std::to_string(offset) + " | `" + std::string{name} + "` | " +
            packedTypeName<std::decay_t<decltype(member)>>() + " | " + std::string{meaning} + " |\n";
    offset += sizeof(member);
  });
  return rows;
}

// Prints the page. With --check FILE: fails when the file says something else. target: that which writes the file.
inline int printOrCheck(int argc, char** argv, const std::string& page, std::string_view target) {
  if (argc == 3 && std::string_view{argv[1]} == "--check") {
    std::ostringstream text;
    text << std::ifstream{argv[2]}.rdbuf();
    if (text.str() == page) return 0;
    std::cerr << argv[2] << " is stale; run: cmake --build build --target " << target << "\n";
    return 1;
  }
  std::cout << page;
  return std::cout.flush() ? 0 : 1;
}

}  // namespace probebox::messages
