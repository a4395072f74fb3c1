#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "host-tests/faults/faulty_disk.hpp"

namespace probebox::faults {

// Before the faulty boot: an empty folder, or what two boots of the same have left.
enum class Before : std::uint8_t { nothing, two_boots };
std::string_view name(Before before);

struct Trial {
  Fault fault{};
  Before before{};
  std::size_t call{};  // from 1
};
std::string describe(const Trial& trial);

struct Outcome {
  bool reached{};    // the process made so many calls
  bool applies{};    // a fault of this kind can be put on this call
  std::string at{};  // the call
  std::uint64_t changes{};
  std::uint64_t refused{};
  std::optional<std::string> broken{};
};

// Runs a store room in a process of its own with the fault at this call. Then starts it again, compares what it finds
// with what was acknowledged, and lets it work once more, without a fault.
Outcome perform(const Trial& trial);

}  // namespace probebox::faults
