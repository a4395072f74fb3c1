#pragma once
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <source_location>
#include <span>
#include <string>
#include <string_view>

namespace probebox::fuzz {

// The bytes that are fed now, shown when something does not hold; the fuzzer keeps its own.
inline std::span<const std::uint8_t> fed;

// Writes what a test feeds into this folder, for the fuzzer to start from (tools/fuzz).
inline void keepFed(const char* folder) {
  static std::size_t count = 0;
  constexpr std::size_t kMost = 2000;
  if (++count > kMost) return;
  std::ofstream file{std::filesystem::path{folder} / std::to_string(count), std::ios::binary};
  for (const auto byte : fed) file.put(static_cast<char>(byte));
}

// Every entry calls this first.
inline void feeding(std::span<const std::uint8_t> bytes) {
  static const char* const folder = std::getenv("PROBEBOX_KEEP_FED");
  fed = bytes;
  if (folder != nullptr) keepFed(folder);
}

inline void require(bool condition, std::string_view what = {},
                    const std::source_location& where = std::source_location::current()) {
  if (condition) return;
  std::cerr << where.file_name() << ":" << where.line() << ": does not hold " << what << "\nbytes:";
  for (const auto byte : fed) std::cerr << " " << unsigned{byte};
  std::cerr << std::endl;
  std::abort();
}

// How often a test feeds something else: PROBEBOX_ROUNDS, or all where PROBEBOX_RUNS is set (tools/test --all), or a
// quarter.
inline int rounds(int all) {
  if (const char* text = std::getenv("PROBEBOX_ROUNDS")) return std::atoi(text);
  return std::getenv("PROBEBOX_RUNS") != nullptr ? all : all / 4;
}

}  // namespace probebox::fuzz
