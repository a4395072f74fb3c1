#pragma once
#include <chrono>
#include <cstddef>
#include <optional>
#include <string>

#include "firmware/store/record.hpp"
#include "protocol/state/due.hpp"

// When a result is to be measured again: pure functions of when it was measured and of what is so now.
namespace probebox::results {

// How much may pass before a subject is due, as machine.toml has it; what is missing does not count.
struct Schedule {
  std::string subject;
  std::optional<double> days, cutting_h, temperature_k;
};

// What a box knew when it measured a result, or knows now.
struct Circumstances {
  std::optional<std::chrono::sys_seconds> utc{};
  std::optional<double> cutting_s{};      // since the counter began
  std::optional<double> temperature_c{};  // as stated for a run
};

// Of a record, by its conditions.
Circumstances circumstancesOf(const store::Record& record);

// in_force: null where nothing about the subject is in force.
published::Due dueOf(const Schedule& schedule, const store::Record* in_force, const Circumstances& now);

}  // namespace probebox::results
