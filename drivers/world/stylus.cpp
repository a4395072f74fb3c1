#include "drivers/world/stylus.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace probebox::world {

MonoTime Instant::rounded() const {
  return base + Nanoseconds{std::llround(offset_s * 1e9)};
}

Stylus::Stylus(const SphereConfig& sphere, const ProbeConfig& probe)
    : centre_{sphere.centre_mm},
      effective_radius_mm_{sphere.radius_mm + sphere.stylus_ball_radius_mm},
      bounce_mm_{probe.bounce_mm},
      decay_s_{probe.bounce_decay_s},
      angular_frequency_{2 * std::numbers::pi * probe.stylus_frequency_hz} {}

void Stylus::follow(const Move& move) {
  const double free_from_mm = release(move);
  if (free_from_mm < move.length_mm) meet(move, free_from_mm);
}

double Stylus::release(const Move& move) {
  if (count_ == 0) return 0;
  Contact& contact = contacts_[(count_ - 1) % kRemembered];
  if (contact.end) return 0;
  // The body presses while it is behind the tangent plane of the point where the ball sticks.
  const double outwards = dot(move.direction, contact.normal);
  const double depth_mm = dot(contact.point - move.from, contact.normal);
  if (outwards <= 0 || depth_mm > outwards * move.length_mm) return move.length_mm;
  const double distance_mm = std::max(depth_mm / outwards, 0.0);
  const double time_s = move.profile.timeAt(distance_mm);
  contact.end = Instant{move.start, time_s};
  contact.ring_mm = amplitude(outwards * move.profile.speedAt(time_s));
  return distance_mm;
}

void Stylus::meet(const Move& move, double from_mm) {
  const Vector3 from_centre = move.from - centre_;
  const double half = dot(from_centre, move.direction);
  const double discriminant = half * half - dot(from_centre, from_centre) + effective_radius_mm_ * effective_radius_mm_;
  if (discriminant <= 0) return;
  const double distance_mm = -half - std::sqrt(discriminant);
  if (distance_mm < from_mm || distance_mm >= move.length_mm) return;
  const Vector3 point = move.at(distance_mm);
  const Vector3 normal = unit(point - centre_);
  const double time_s = move.profile.timeAt(distance_mm);
  contacts_[count_ % kRemembered] =
      Contact{.point = point,
              .normal = normal,
              .begin = Instant{move.start, time_s},
              .end = std::nullopt,
              .bounce_mm = amplitude(-dot(move.direction, normal) * move.profile.speedAt(time_s)),
              .ring_mm = 0};
  ++count_;
}

// A stylus that leaves the surface with this speed swings by speed / angular frequency; more would take it through.
double Stylus::amplitude(double normal_speed_mm_s) const {
  return std::clamp(normal_speed_mm_s / angular_frequency_, 0.0, bounce_mm_);
}

double Stylus::decayed(double amplitude_mm, double elapsed_s) const {
  if (amplitude_mm <= 0 || elapsed_s > 40 * decay_s_) return 0;
  return amplitude_mm * std::exp(-elapsed_s / decay_s_) * std::sin(angular_frequency_ * elapsed_s);
}

Vector3 Stylus::displacement(const Vector3& body, MonoTime at, double delay_s) const {
  for (std::uint64_t i = count_; const Contact* contact = i > 0 ? this->contact(i - 1) : nullptr; --i) {
    const double touched_s = contact->begin.elapsed(at, delay_s);
    if (touched_s < 0) continue;
    const double free_s = contact->end ? contact->end->elapsed(at, delay_s) : -1;
    if (free_s >= 0) return -decayed(contact->ring_mm, free_s) * contact->normal;
    // A bounce goes off the surface alone.
    return contact->point - body + std::abs(decayed(contact->bounce_mm, touched_s)) * contact->normal;
  }
  return {};
}

const Contact* Stylus::contact(std::uint64_t number) const {
  return number < count_ && count_ - number <= kRemembered ? &contacts_[number % kRemembered] : nullptr;
}

}  // namespace probebox::world
