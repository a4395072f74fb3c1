#pragma once
#include <array>
#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

#include "host-tests/campaign/act.hpp"

namespace probebox::campaign {

// A rule that did not hold.
struct Violation {
  Nanoseconds at{};  // since the start of the play
  std::string what;
};

// Counts of events in plays, which show what a campaign has covered.
struct Tally {
  std::uint64_t plays{};
  std::uint64_t restarts{};
  std::uint64_t reads{};        // of the registers
  std::uint64_t valid_reads{};  // with `valid` set
  std::uint64_t samples{};      // that hosts received
  std::uint64_t lost_samples{};
  std::uint64_t solved{};    // runs
  std::uint64_t proposed{};  // beside runs
  std::uint64_t accepted{};
  std::uint64_t rolled_back{};
  std::uint64_t checks_of_values{};  // corrections compared with the truth
  std::array<std::uint64_t, kKinds> acts{};
  double hours{};

  Tally& operator+=(const Tally& other);
};

struct Verdict {
  std::optional<Violation> violation;
  Tally tally;
};

std::string toJson(const Verdict& verdict);
Outcome<Verdict> verdictFrom(std::string_view json);

}  // namespace probebox::campaign
