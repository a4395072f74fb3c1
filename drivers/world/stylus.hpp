#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "drivers/world/config.hpp"
#include "drivers/world/motion.hpp"
#include "drivers/world/vector.hpp"
#include "protocol/units/time.hpp"

namespace probebox::world {

// An instant finer than a nanosecond.
struct Instant {
  MonoTime base{};
  double offset_s{};

  // From this instant to the one `delay_s` before `at`.
  double elapsed(MonoTime at, double delay_s) const { return toSeconds(at - base) - delay_s - offset_s; }
  MonoTime rounded() const;
};

// The stylus ball on the surface of the sphere. Its centre stays at `point` until the body no longer presses.
struct Contact {
  Vector3 point{};   // mm
  Vector3 normal{};  // outward
  Instant begin;
  std::optional<Instant> end;
  double bounce_mm{};  // first amplitudes
  double ring_mm{};
};

// A ball on a spring that meets the datum sphere. Touching, it sticks where it met the surface, which holds while the
// touch is nearly normal; the centre of the ball never enters the effective sphere. At contact it bounces off and at
// release it rings, both with the free stylus' frequency.
class Stylus {
 public:
  static constexpr std::size_t kRemembered = 64;

  Stylus(const SphereConfig& sphere, const ProbeConfig& probe);

  // Contacts that the move makes and ends.
  void follow(const Move& move);

  // Centre of the stylus ball minus body, mm, in machine axes, `delay_s` before `at`. `body` is of that instant.
  Vector3 displacement(const Vector3& body, MonoTime at, double delay_s) const;

  std::uint64_t contactCount() const { return count_; }
  // The contact of that number, from 0; nothing when it is still to come or has been forgotten.
  const Contact* contact(std::uint64_t number) const;

 private:
  double release(const Move& move);  // distance from which on the ball is free; the length when it stays in contact
  void meet(const Move& move, double from_mm);
  double amplitude(double normal_speed_mm_s) const;
  double decayed(double amplitude_mm, double elapsed_s) const;

  Vector3 centre_;
  double effective_radius_mm_;
  double bounce_mm_;
  double decay_s_;
  double angular_frequency_;
  std::array<Contact, kRemembered> contacts_{};
  std::uint64_t count_{};
};

}  // namespace probebox::world
