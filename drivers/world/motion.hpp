#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <tuple>

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
  double profile_from_mm{};  // where this length begins in the profile's own distance
  Vector3 slide_from{};      // where the slides stand at its start

  // Time since the start at a distance within the length, and the speed then.
  double timeAt(double distance_mm) const { return profile.timeAt(profile_from_mm + distance_mm * profile_per_mm); }
  double speedAt(double time_s) const { return profile.speedAt(time_s) / profile_per_mm; }
  Vector3 at(double distance_mm) const { return arc ? arc->at(distance_mm) : from + distance_mm * direction; }
  // Seconds from the start to the instant `delay_s` before `stamp`.
  double elapsed(MonoTime stamp, double delay_s) const { return toSeconds(stamp - start) - delay_s; }
};

// Remembers the latest moves of the axes, as ideal encoders of their drives show them, for late readers. Before the
// oldest move they rest at its start. Slides follow with play: each stands still until its axis has taken that up, and
// in the middle of it at the start.
class MotionHistory {
 public:
  static constexpr std::size_t kRemembered = 512;

  explicit MotionHistory(const Vector3& home, const Vector3& play_mm = {})
      : half_play_mm_{0.5 * play_mm}, rest_{home}, slide_{home} {}

  // The straight move from where the last one ends.
  Move moveTo(const Vector3& target, const MotionLimits& limits, MonoTime start) const;
  const Move& append(const Vector3& target, const MotionLimits& limits, MonoTime start);
  // Its arc begins where the last move ends.
  const Move& appendArc(const Arc& arc, const MotionLimits& limits, MonoTime start);
  bool atRest(MonoTime at) const;
  Vector3 target() const { return rest_; }  // where the last move ends
  Vector3 slide() const { return slide_; }  // where the slides stand then
  bool isRigid() const { return half_play_mm_ == Vector3{}; }

  // Position at the instant `delay_s` before `at`.
  Vector3 positionAt(MonoTime at, double delay_s = 0) const;
  Vector3 slideAt(MonoTime at, double delay_s = 0) const;
  // Of the slides after that distance of a move.
  Vector3 slideOn(const Move& move, double distance_mm) const;
  // Calls take(from_mm, to_mm) for each part of a straight move in which the same slides move, in order.
  template <class Take>
  void forEachPart(const Move& move, Take take) const;
  double speedAt(MonoTime at) const;

 private:
  const Move& keep(const Move& move, const Vector3& target);
  Vector3 dragged(const Vector3& slide, const Vector3& to) const;
  const Move* moveAt(MonoTime at, double delay_s) const;  // the last one that had started by then

  std::array<Move, kRemembered> moves_{};
  std::uint64_t count_{};
  Vector3 half_play_mm_;
  Vector3 rest_, slide_;
};

template <class Take>
void MotionHistory::forEachPart(const Move& move, Take take) const {
  std::array<double, std::tuple_size_v<Vector3> + 1> ends{};
  for (std::size_t i = 0; i < move.direction.size(); ++i) {
    const double speed = move.direction[i], ahead_mm = move.slide_from[i] - move.from[i];
    // Where it has taken up its play.
    ends[i] = speed == 0 ? 0 : std::clamp(ahead_mm / speed + half_play_mm_[i] / std::abs(speed), 0.0, move.length_mm);
  }
  ends.back() = move.length_mm;
  std::ranges::sort(ends);
  double from_mm = 0;
  for (const double to_mm : ends) {
    if (to_mm > from_mm) take(from_mm, to_mm);
    from_mm = to_mm;
  }
}

}  // namespace probebox::world
