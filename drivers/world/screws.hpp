#pragma once
#include <array>
#include <cstdint>
#include <optional>

#include "drivers/world/config.hpp"
#include "drivers/world/fault_schedule.hpp"
#include "drivers/world/machine.hpp"
#include "drivers/world/random.hpp"
#include "drivers/world/truth.hpp"
#include "protocol/events/event.hpp"

namespace probebox::world {

// Emulates ball screws that warm up, each held axially at one end, and the sensors at their free ends, which measure
// faces that are not plane (CN101394969).
class Screws {
 public:
  Screws(const Config& config, std::uint64_t seed);

  MonoTime nextAt() const;
  // Returns the next reading; false when it is dropped.
  bool take(Event& event, const Machine& machine, const FaultSchedule& faults, Ledger& ledger);

  // Returns the true expansion since the cold screw, um.
  double extension_um(std::size_t axis, MonoTime at) const;
  // Returns the part of that by which a nut at this position is displaced if the screw is equally warm along itself.
  double lever(std::size_t axis, double position_mm) const;
  // Returns the position of the nut minus that on the motor encoder, mm.
  double nutError_mm(std::size_t axis, double position_mm, MonoTime at) const;
  // Returns the position on the motor encoder for an axis at this position.
  double motorPosition_mm(std::size_t axis, double position_mm, MonoTime at) const {
    return position_mm - nutError_mm(axis, position_mm, at);
  }
  // Its inverse: the position of the nut for a motor that stands there.
  double nutPosition_mm(std::size_t axis, double motor_mm, MonoTime at) const;
  // Returns the contribution of the sensor's face to a reading, um, at this position of the motor encoder.
  double face_um(std::size_t axis, double motor_mm) const;

 private:
  // A screw that both descriptions know.
  struct Screw {
    board::WorldScrew warming;
    board::ScrewDescription described;
  };

  double unevenLever(std::size_t axis, double position_mm) const;

  std::array<std::optional<Screw>, 3> screws_;
  MonoTime start_;
  Nanoseconds interval_;
  Random random_;
  std::int64_t reading_{};
  std::size_t axis_{};
  bool any_{};
};

}  // namespace probebox::world
