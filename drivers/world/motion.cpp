#include "drivers/world/motion.hpp"

#include <algorithm>
#include <cmath>

#include "protocol/units/angle.hpp"

namespace probebox::world {

Profile::Profile(double length_mm, const MotionLimits& limits)
    : length_mm_{length_mm},
      // A short move never reaches the speed limit.
      speed_mm_s_{std::min(limits.speed_mm_s, std::sqrt(length_mm * limits.acceleration_mm_s2))},
      acceleration_mm_s2_{limits.acceleration_mm_s2},
      ramp_s_{speed_mm_s_ / acceleration_mm_s2_},
      trapezoid_s_{length_mm > 0 ? length_mm / speed_mm_s_ + ramp_s_ : 0},
      jerk_time_s_{limits.jerk_time_s} {}

double Profile::trapezoid(double time_s) const {
  if (time_s <= 0) return 0;
  if (time_s >= trapezoid_s_) return length_mm_;
  if (time_s < ramp_s_) return acceleration_mm_s2_ * time_s * time_s / 2;
  const double left_s = trapezoid_s_ - time_s;
  if (left_s < ramp_s_) return length_mm_ - acceleration_mm_s2_ * left_s * left_s / 2;
  return speed_mm_s_ * (time_s - ramp_s_ / 2);
}

double Profile::trapezoidIntegral(double time_s) const {
  if (time_s <= 0) return 0;
  const double ramp_up = acceleration_mm_s2_ * ramp_s_ * ramp_s_ * ramp_s_ / 6;
  if (time_s < ramp_s_) return acceleration_mm_s2_ * time_s * time_s * time_s / 6;
  const double cruise_end_s = trapezoid_s_ - ramp_s_;
  const double cruised_s = std::min(time_s, cruise_end_s) - ramp_s_;
  const double until_cruise_end = ramp_up + speed_mm_s_ * cruised_s * (cruised_s + ramp_s_) / 2;
  if (time_s <= cruise_end_s) return until_cruise_end;
  const double left_s = std::max(trapezoid_s_ - time_s, 0.0);
  return until_cruise_end + length_mm_ * (time_s - cruise_end_s) -
         (ramp_up - acceleration_mm_s2_ * left_s * left_s * left_s / 6);
}

double Profile::distanceAt(double time_s) const {
  if (time_s <= 0) return 0;
  if (time_s >= duration()) return length_mm_;
  if (jerk_time_s_ <= 0) return trapezoid(time_s);
  return (trapezoidIntegral(time_s) - trapezoidIntegral(time_s - jerk_time_s_)) / jerk_time_s_;
}

double Profile::speedAt(double time_s) const {
  if (time_s <= 0 || time_s >= duration()) return 0;
  if (jerk_time_s_ > 0) return (trapezoid(time_s) - trapezoid(time_s - jerk_time_s_)) / jerk_time_s_;
  return std::min({speed_mm_s_, acceleration_mm_s2_ * time_s, acceleration_mm_s2_ * (trapezoid_s_ - time_s)});
}

double Profile::timeAt(double distance_mm) const {
  double early = 0, late = duration();
  // Sixty halvings of any duration end below what a double can tell.
  for (int i = 0; i < 60; ++i) {
    const double middle = (early + late) / 2;
    (distanceAt(middle) < distance_mm ? early : late) = middle;
  }
  return (early + late) / 2;
}

double Arc::length_mm() const {
  return radius_mm * std::abs(turn_rad);
}

Vector3 Arc::at(double distance_mm) const {
  const double angle_rad = from_rad + std::copysign(distance_mm / radius_mm, turn_rad);
  return centre + radius_mm * Vector3{std::cos(angle_rad), std::sin(angle_rad), 0};
}

Arc arcFrom(const Vector3& point, const Vector3& centre, double turn_rad) {
  const Vector3 off = point - centre;
  return {.centre = {centre[0], centre[1], point[2]},
          .radius_mm = std::hypot(off[0], off[1]),
          .from_rad = std::atan2(off[1], off[0]),
          .turn_rad = turn_rad};
}

Move MotionHistory::moveTo(const Vector3& target, const MotionLimits& limits, MonoTime start) const {
  const Vector3 path = target - rest_;
  return {.start = start,
          .from = rest_,
          .direction = unit(path),
          .length_mm = norm(path),
          .profile = Profile{norm(path), limits},
          .slide_from = slide_};
}

const Move& MotionHistory::append(const Vector3& target, const MotionLimits& limits, MonoTime start) {
  return keep(moveTo(target, limits, start), target);
}

const Move& MotionHistory::keep(const Move& move, const Vector3& target) {
  slide_ = dragged(slideOn(move, move.length_mm), target);
  rest_ = target;
  return moves_[count_++ % kRemembered] = move;
}

const Move& MotionHistory::appendArc(const Arc& arc, const MotionLimits& limits, MonoTime start) {
  return keep({.start = start,
               .from = rest_,
               .direction = {},
               .length_mm = arc.length_mm(),
               .profile = Profile{arc.length_mm(), limits},
               .arc = arc,
               .slide_from = slide_},
              arc.at(arc.length_mm()));
}

Vector3 MotionHistory::dragged(const Vector3& slide, const Vector3& to) const {
  Vector3 at = to;
  for (std::size_t i = 0; i < at.size(); ++i)
    at[i] = std::clamp(slide[i], to[i] - half_play_mm_[i], to[i] + half_play_mm_[i]);
  return at;
}

Vector3 MotionHistory::slideOn(const Move& move, double distance_mm) const {
  Vector3 slide = move.slide_from;
  // On its way round a centre X or Y turns back at each quarter.
  if (move.arc && !isRigid()) {
    const double sense = std::copysign(1, move.arc->turn_rad), quarters = sense * move.arc->from_rad / (kTurn / 4);
    for (double next = std::floor(quarters) + 1;; ++next) {
      const double at_mm = (next - quarters) * (kTurn / 4) * move.arc->radius_mm;
      if (at_mm >= distance_mm) break;
      slide = dragged(slide, move.at(at_mm));
    }
  }
  return dragged(slide, move.at(distance_mm));
}

bool MotionHistory::atRest(MonoTime at) const {
  if (count_ == 0) return true;
  const Move& last = moves_[(count_ - 1) % kRemembered];
  return last.elapsed(at, 0) >= last.profile.duration();
}

Vector3 MotionHistory::positionAt(MonoTime at, double delay_s) const {
  if (count_ == 0) return rest_;
  if (const Move* move = moveAt(at, delay_s)) return move->at(move->profile.distanceAt(move->elapsed(at, delay_s)));
  return moves_[count_ <= kRemembered ? 0 : count_ % kRemembered].from;
}

Vector3 MotionHistory::slideAt(MonoTime at, double delay_s) const {
  if (isRigid()) return positionAt(at, delay_s);
  if (const Move* move = moveAt(at, delay_s))
    return slideOn(*move, move->profile.distanceAt(move->elapsed(at, delay_s)));
  return count_ == 0 ? slide_ : moves_[count_ <= kRemembered ? 0 : count_ % kRemembered].slide_from;
}

double MotionHistory::speedAt(MonoTime at) const {
  const Move* move = moveAt(at, 0);
  return move ? move->profile.speedAt(move->elapsed(at, 0)) : 0;
}

const Move* MotionHistory::moveAt(MonoTime at, double delay_s) const {
  const std::uint64_t oldest = count_ > kRemembered ? count_ - kRemembered : 0;
  for (std::uint64_t i = count_; i > oldest; --i) {
    const Move& move = moves_[(i - 1) % kRemembered];
    if (move.elapsed(at, delay_s) >= 0) return &move;
  }
  return nullptr;
}

void TurnHistory::append(double to_rad, MonoTime from, MonoTime until) {
  turns_[count_++ % kRemembered] = {from, until, to_rad_, to_rad};
  to_rad_ = to_rad;
}

double TurnHistory::angleAt(MonoTime at, double delay_s) const {
  const std::uint64_t oldest = count_ > kRemembered ? count_ - kRemembered : 0;
  for (std::uint64_t i = count_; i > oldest; --i) {
    const Turn& turn = turns_[(i - 1) % kRemembered];
    const double since_s = toSeconds(at - turn.from) - delay_s, lasts_s = toSeconds(turn.until - turn.from);
    if (since_s < 0) continue;
    if (since_s >= lasts_s) return turn.to_rad;
    return turn.from_rad + since_s / lasts_s * (turn.to_rad - turn.from_rad);
  }
  return count_ > 0 ? turns_[oldest % kRemembered].from_rad : to_rad_;
}

}  // namespace probebox::world
