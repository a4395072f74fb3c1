#pragma once
#include <cstddef>
#include <cstdint>

#include "drivers/world/config.hpp"
#include "drivers/world/fault_schedule.hpp"
#include "drivers/world/machine.hpp"
#include "drivers/world/random.hpp"
#include "drivers/world/screws.hpp"
#include "drivers/world/truth.hpp"
#include "protocol/events/event.hpp"

namespace probebox::world {

// Latches the counts of three incremental encoders on the motors of the ball screws, and of one on the part spindle
// where it is fitted, at their own rate, late by the machine's delay.
class Encoders {
 public:
  Encoders(const Config& config, std::uint64_t seed);

  MonoTime nextAt() const { return sampling_.at(latch_); }
  // Returns the next count; false when it is dropped.
  bool take(Event& event, const Machine& machine, const Screws& screws, const FaultSchedule& faults, Ledger& ledger);
  // Counts from 0 where the axis was seen last.
  void restart(std::size_t axis) { config_.power_up_mm.at(axis) = -position_mm_.at(axis); }

 private:
  std::size_t axes() const { return c_counts_per_deg_ > 0 ? kLinearAxes + 1 : kLinearAxes; }
  Event countOf(std::size_t axis, MonoTime at);
  AngleCount angleCount(MonoTime at) const;

  board::WorldEncoders config_;
  std::array<int, kLinearAxes> sense_{};
  bool has_y_{true};
  double c_counts_per_deg_, c_power_up_deg_;
  Vector3 tau_s_;
  Random random_;
  Sampling sampling_;
  Vector3 position_mm_{};  // as last seen
  double angle_rad_{};
  std::int64_t latch_{};
  std::size_t axis_{};
};

}  // namespace probebox::world
