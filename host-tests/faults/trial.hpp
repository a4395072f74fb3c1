#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "host-tests/faults/announcements.hpp"

namespace probebox::faults {

enum class Fault : std::uint8_t {
  kill,           // the process dies before the call
  cut_lost,       // the power fails; nothing that was not synced is on the disk
  cut_torn,       // the power fails; blocks that were not synced are on the disk or not, by chance
  fail_once,      // the call fails (EIO)
  fail_for_good,  // it and all later ones fail
  full,           // from it on the disk is full: files neither grow nor are made
  shorten,        // half of the bytes are written
};
inline constexpr std::size_t kFaults = 7;
std::string_view name(Fault fault);

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
