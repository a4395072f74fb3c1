#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "drivers/world/config.hpp"
#include "drivers/world/solids.hpp"
#include "drivers/world/vector.hpp"
#include "protocol/units/time.hpp"

namespace probebox::world {

// Holds the unlimited readings of the sensors of a head, and its configuration.
struct HeadReading {
  Vector3 sensors_mm{};
  double range_mm{};
  double noise_um{};
};

// Records the state of the machine from an instant on, as far as a sensor head depends on it.
struct HeadStand {
  MonoTime since{};
  std::optional<board::WorldSensorHead> head;  // nothing while something else is in the spindle
  Vector3 centre{};                            // of the head, against the body
  Matrix3 turned{};                            // from the head's own axes into the machine's
  BallCentres balls;
};

// Reads the ball nearest to the head. Samples are taken later than the machine is commanded, so earlier states are
// remembered.
class SensorHead {
 public:
  static constexpr std::size_t kRemembered = 64;

  void stand(const HeadStand& stand);
  // `body` is of the instant `delay_s` before `at`. Nothing while no head is in the spindle.
  std::optional<HeadReading> reading(const Vector3& body, MonoTime at, double delay_s) const;

 private:
  const HeadStand* standAt(MonoTime at) const;

  std::array<HeadStand, kRemembered> stands_;
  std::uint64_t count_{};
};

}  // namespace probebox::world
