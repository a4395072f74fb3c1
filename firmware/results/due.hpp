#pragma once
#include <chrono>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "firmware/store/record.hpp"
#include "protocol/state/due.hpp"

// When a result is to be measured again: pure functions of when it was measured and of what is so now.
namespace probebox::results {

// How much may pass before a subject is due, as machine.toml has it; what is missing does not count.
struct Schedule {
  std::string subject;
  std::optional<double> days, cutting_h, temperature_k;
};

// How long a machine has cut since a counter began, s. A counter that was lost begins anew under another name.
struct CuttingCount {
  double s{};
  std::string counter{};

  // "3600 of 1a2b3c4d", whole seconds; nothing for other texts.
  std::string text() const;
  static std::optional<CuttingCount> parse(std::string_view text);
};

// What a box knew when it measured a result, or knows now.
struct Circumstances {
  std::optional<std::chrono::sys_seconds> utc{};
  std::optional<CuttingCount> cutting{};
  std::optional<double> temperature_c{};  // as stated for a run
};

// Of a record, by its conditions.
Circumstances circumstancesOf(const store::Record& record);

// in_force: null where nothing about the subject is in force.
published::Due dueOf(const Schedule& schedule, const store::Record* in_force, const Circumstances& now);

}  // namespace probebox::results
