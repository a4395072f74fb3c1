#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>

#include "drivers/world/vector.hpp"
#include "protocol/units/time.hpp"

namespace probebox::world {

// Remembers the latest turns of an axis for late readers, each at constant speed. Before the oldest the axis stands
// where that one starts.
class TurnHistory {
 public:
  static constexpr std::size_t kRemembered = 512;

  void append(double to_rad, MonoTime from, MonoTime until);
  // Angle at the instant `delay_s` before `at`.
  double angleAt(MonoTime at, double delay_s = 0) const;

 private:
  struct Turn {
    MonoTime from{}, until{};
    double from_rad{}, to_rad{};
  };
  std::array<Turn, kRemembered> turns_{};
  std::uint64_t count_{};
  double to_rad_{};  // where the last turn ends
};

struct MotionLimits {
  double speed_mm_s{};
  double acceleration_mm_s2{};
  double jerk_time_s{};
};

// Limits of a move at constant speed, as a control commands it within one of its cycles.
inline MotionLimits steady(double speed_mm_s) {
  return {speed_mm_s, std::numeric_limits<double>::infinity(), 0};
}

// Computes the distance along a straight line over time, from rest to rest: a trapezoid of speed averaged over the jerk
// time. Speed and acceleration stay within their limits, |jerk| within 2 acceleration / jerk time.
class Profile {
 public:
  Profile() = default;
  Profile(double length_mm, const MotionLimits& limits);

  double distanceAt(double time_s) const;
  double speedAt(double time_s) const;
  double duration() const { return trapezoid_s_ + jerk_time_s_; }
  // Returns the time at which a distance within the length is reached.
  double timeAt(double distance_mm) const;

 private:
  double trapezoid(double time_s) const;          // distance before averaging
  double trapezoidIntegral(double time_s) const;  // of that distance, from 0

  double length_mm_{};
  double speed_mm_s_{};
  double acceleration_mm_s2_{};
  double ramp_s_{};       // to speed, and from it
  double trapezoid_s_{};  // the whole trapezoid
  double jerk_time_s_{};
};

// A way around a centre in the plane of X and Y.
struct Arc {
  Vector3 centre{};
  double radius_mm{};
  double from_rad{};
  double turn_rad{};  // positive from X to Y

  double length_mm() const;
  Vector3 at(double distance_mm) const;
};
// Returns the way by that turn from a point on.
Arc arcFrom(const Vector3& point, const Vector3& centre, double turn_rad);

// Describes one move of the body, which is straight unless it has an arc.
struct Move {
  MonoTime start{};
  Vector3 from{};
  Vector3 direction{};  // unit vector
  double length_mm{};
  Profile profile;
  double profile_per_mm{1};  // of the profile's own distance, over this length
  std::optional<Arc> arc{};

  // Time since the start at a distance within the length, and the speed then.
  double timeAt(double distance_mm) const { return profile.timeAt(distance_mm * profile_per_mm); }
  double speedAt(double time_s) const { return profile.speedAt(time_s) / profile_per_mm; }
  Vector3 at(double distance_mm) const { return arc ? arc->at(distance_mm) : from + distance_mm * direction; }
  // Seconds from the start to the instant `delay_s` before `stamp`.
  double elapsed(MonoTime stamp, double delay_s) const { return toSeconds(stamp - start) - delay_s; }
};

// Remembers the latest moves for late readers. Before the oldest move the body rests at its start.
class MotionHistory {
 public:
  static constexpr std::size_t kRemembered = 512;

  explicit MotionHistory(const Vector3& home) : rest_{home} {}

  const Move& append(const Vector3& target, const MotionLimits& limits, MonoTime start);
  // Its arc begins where the last move ends.
  const Move& appendArc(const Arc& arc, const MotionLimits& limits, MonoTime start);
  bool atRest(MonoTime at) const;
  Vector3 target() const { return rest_; }  // where the last move ends

  // Position at the instant `delay_s` before `at`.
  Vector3 positionAt(MonoTime at, double delay_s = 0) const;
  double speedAt(MonoTime at) const;

 private:
  const Move* moveAt(MonoTime at, double delay_s) const;  // the last one that had started by then

  std::array<Move, kRemembered> moves_{};
  std::uint64_t count_{};
  Vector3 rest_;
};

}  // namespace probebox::world
