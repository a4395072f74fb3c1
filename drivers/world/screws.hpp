#pragma once
#include <array>
#include <cstdint>

#include "drivers/world/config.hpp"
#include "drivers/world/fault_schedule.hpp"
#include "drivers/world/machine.hpp"
#include "drivers/world/random.hpp"
#include "drivers/world/truth.hpp"
#include "protocol/events/event.hpp"

namespace probebox::world {

// Ball screws that warm up, each held axially at one end, and the sensors at their free ends, which look at faces that
// are not plane (CN101394969). Each screw is as warm everywhere as anywhere.
class Screws {
 public:
  Screws(const Config& config, std::uint64_t seed);

  MonoTime nextAt() const;
  // The next reading; false when it is dropped.
  bool take(Event& event, const Machine& machine, const FaultSchedule& faults, Ledger& ledger);

  // The truth: how much longer the screw is than when it was cold, um.
  double extension_um(std::size_t axis, MonoTime at) const;
  // How far the nut then stands from where the encoder on the motor says, mm.
  double nutError_mm(std::size_t axis, double position_mm, MonoTime at) const;
  // What the encoder on the motor sees of an axis that stands there.
  double motorPosition_mm(std::size_t axis, double position_mm, MonoTime at) const {
    return position_mm - nutError_mm(axis, position_mm, at);
  }
  // What the sensor's face adds to a reading, um, where the encoder on the motor shows this position.
  double face_um(std::size_t axis, double motor_mm) const;

 private:
  std::array<ScrewConfig, 3> screws_;
  MonoTime start_;
  Nanoseconds interval_;
  Random random_;
  std::int64_t reading_{};
  std::size_t axis_{};
  bool any_{};
};

}  // namespace probebox::world
