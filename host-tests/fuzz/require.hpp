#pragma once
#include <cstdint>
#include <cstdlib>
#include <iostream>
#include <source_location>
#include <span>
#include <string_view>

namespace probebox::fuzz {

// The bytes that are fed now, to be shown when something does not hold; the fuzzer keeps its own.
inline std::span<const std::uint8_t> fed;

inline void require(bool condition, std::string_view what = {},
                    const std::source_location& where = std::source_location::current()) {
  if (condition) return;
  std::cerr << where.file_name() << ":" << where.line() << ": does not hold " << what << "\nbytes:";
  for (const auto byte : fed) std::cerr << " " << unsigned{byte};
  std::cerr << std::endl;
  std::abort();
}

// How often a test feeds something else: PROBEBOX_ROUNDS, for a longer look, or the usual number.
inline int rounds(int usual) {
  const char* text = std::getenv("PROBEBOX_ROUNDS");
  return text != nullptr ? std::atoi(text) : usual;
}

}  // namespace probebox::fuzz
