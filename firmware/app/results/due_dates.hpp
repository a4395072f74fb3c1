#pragma once
#include <chrono>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "firmware/app/results/cutting_time.hpp"
#include "firmware/app/results/results_in_force.hpp"
#include "firmware/results/due.hpp"

namespace probebox::app {

// What is due, by the requirements of machine.toml. Any thread.
class DueDates {
 public:
  // The others outlive this.
  DueDates(std::vector<results::Schedule> schedules, const CuttingTime& cutting, const ResultsInForce& results)
      : schedules_{std::move(schedules)}, cutting_{cutting}, results_{results} {}

  // In the order of the schedules. At most a second old: controllers ask often.
  std::vector<published::Due> all() const;
  // How many are overdue or were never measured.
  std::uint16_t count() const;
  // Why the hours of cutting are not kept; empty when they are.
  std::string problem() const { return cutting_.problem(); }

 private:
  // Under the lock: looks again when what is kept is older than a second.
  const std::vector<published::Due>& recent() const;
  std::vector<published::Due> look() const;

  std::vector<results::Schedule> schedules_;
  const CuttingTime& cutting_;
  const ResultsInForce& results_;
  mutable std::mutex mutex_;
  mutable std::optional<std::chrono::steady_clock::time_point> looked_;
  mutable std::vector<published::Due> all_;
};

}  // namespace probebox::app
