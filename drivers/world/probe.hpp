#pragma once
#include <array>
#include <cstdint>
#include <optional>

#include "drivers/world/config.hpp"
#include "drivers/world/fault_schedule.hpp"
#include "drivers/world/machine.hpp"
#include "drivers/world/random.hpp"
#include "drivers/world/sway.hpp"
#include "drivers/world/truth.hpp"
#include "protocol/events/event.hpp"

namespace probebox::world {

// Samples the scanning probe's channels, the distance of a probe that does not touch, or the sensors of a head instead,
// at their own rate, late by the probe's delay.
class Probe {
 public:
  Probe(const Config& config, std::uint64_t seed);

  // Returns the maximum time for a touch-trigger probe, which has no channels.
  MonoTime nextAt() const { return samples_ ? sampling_.at(sample_) : MonoTime::max(); }
  // The next sample; false when it is dropped.
  bool take(Event& event, const Machine& machine, const FaultSchedule& faults, Ledger& ledger);

 private:
  Vector3 channels(const Vector3& displacement_mm, MonoTime at);

  board::WorldProbe config_;
  std::optional<board::ProbeDistance> distance_;  // of one that does not touch
  Sway zero_;
  Vector3 felt_{};  // displacement as it was shown last: behind the true one by half of the hysteresis
  bool samples_;
  double tau_s_;
  Matrix3 channels_of_displacement_;  // inverse of the gain
  Random random_;
  Sampling sampling_;
  std::array<std::int32_t, 3> last_nm_{};
  std::int64_t sample_{};
};

}  // namespace probebox::world
