#include "drivers/world/stylus.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "protocol/units/angle.hpp"

namespace probebox::world {
namespace {
constexpr double kStylusFrequency_hz = 120;  // of the free stylus
}  // namespace

MonoTime Instant::rounded() const {
  return base + Nanoseconds{std::llround(offset_s * 1e9)};
}

double Lobes::at(const Vector3& normal) const {
  const double across = std::hypot(normal[0], normal[1]), around_rad = std::atan2(normal[1], normal[0]);
  return across * (mean_mm + twice_mm * std::cos(2 * around_rad) + thrice_mm * std::cos(3 * around_rad)) +
         std::abs(normal[2]) * along_mm;
}

Stylus::Stylus(const Config& config, Sway sway)
    : sway_{std::move(sway)},
      bounce_mm_{config.probe.bounce_mm},
      decay_s_{config.probe.bounce_decay_s},
      angular_frequency_{kTurn * kStylusFrequency_hz},
      friction_rad_{std::atan(config.probe.friction)} {
  const auto& probe = config.probe;
  if (!config.touch_trigger)
    lobes_ = {.twice_mm = probe.lobe_twice_mm, .thrice_mm = probe.lobe_mm, .along_mm = probe.lobe_along_mm};
}

void Stylus::follow(const Move& move, const Solids& solids, const Hold& hold) {
  const Move way = wayOf(move, hold);
  const double free_from_mm = release(way);
  if (free_from_mm >= way.length_mm || hold.touches_nothing) return;
  const auto found = meeting(move, free_from_mm, solids, hold);
  if (!found) return;
  const double time_s = way.timeAt(found->distance_mm);
  const double normal_mm_s = -dot(way.direction, found->normal) * way.speedAt(time_s);
  const Vector3 point = way.at(found->distance_mm) + sway_.at(way.start, -time_s) - sway_.at(way.start);
  contacts_[count_ % kRemembered] = Contact{.point = point,
                                            .normal = found->normal,
                                            .tip = hold.tip,
                                            .turned = hold.turned,
                                            .begin = Instant{way.start, time_s},
                                            .end = std::nullopt,
                                            .bounce_mm = amplitude(normal_mm_s),
                                            .ring_mm = 0,
                                            .speed_mm_s = normal_mm_s,
                                            .setter = found->setter,
                                            .tool = hold.tool_radius_mm.has_value(),
                                            .lever = found->lever,
                                            .pre_travel = hold.pre_travel / found->lever};
  ++count_;
}

// Of the ball while it is free, with the sway that the body has at the start.
Move Stylus::wayOf(const Move& move, const Hold& hold) const {
  Move way = move;
  way.from = move.from + sway_.at(move.start) + hold.tip;
  return way;
}

std::optional<Meeting> Stylus::meeting(const Move& move, double from_mm, const Solids& solids, const Hold& hold) const {
  const Move way = wayOf(move, hold);
  auto found = hold.tool_radius_mm ? solids.meetTool(way, from_mm, *hold.tool_radius_mm, hold.nose)
                                   : solids.meet(way, from_mm, hold.shank);
  if (!found) return std::nullopt;
  const double deeper_mm = hold.tool_radius_mm ? 0 : lobes_.at(transposed(hold.turned) * found->normal);
  if (deeper_mm != 0) found->distance_mm -= deeper_mm / dot(way.direction, found->normal);
  found->distance_mm = swayed(way, found->distance_mm, found->normal);
  if (deeper_mm != 0 || !sway_.none()) found->distance_mm = std::clamp(found->distance_mm, from_mm, way.length_mm);
  return found;
}

// The distance at which the ball comes through a plane that it would pass at `distance_mm` without sway since the
// start.
double Stylus::swayed(const Move& way, double distance_mm, const Vector3& normal) const {
  if (sway_.none()) return distance_mm;
  double swayed_mm = distance_mm;
  // Sway is slower than a touch, so each round leaves a part of what the last one left.
  for (int round = 0; round < 8; ++round) {
    const double time_s = way.timeAt(std::clamp(swayed_mm, 0.0, way.length_mm));
    const Vector3 since = sway_.at(way.start, -time_s) - sway_.at(way.start);
    swayed_mm = distance_mm - dot(since, normal) / dot(way.direction, normal);
  }
  return swayed_mm;
}

bool Stylus::slide(const Instant& begin, const Vector3& body, const SolidBall& ball, double sense) {
  constexpr double kOnIt_mm = 1e-3;
  if (count_ == 0) return false;
  Contact& contact = contacts_[(count_ - 1) % kRemembered];
  if (contact.slide) return !contact.end && !contact.slides_until;
  const Slide slide{.ball = ball,
                    .sense = sense,
                    .friction_rad = friction_rad_,
                    .from = body + contact.tip,
                    .lobes = lobes_,
                    .turned = contact.turned};
  const double off_mm = norm(contact.point - ball.centre) - slide.reach(contact.normal);
  if (contact.end || std::abs(off_mm) >= kOnIt_mm) return false;
  contact.slide = slide;
  contact.slides_from = begin;
  return true;
}

bool Stylus::slides() const {
  const Contact* last = count_ > 0 ? contact(count_ - 1) : nullptr;
  return last != nullptr && last->slide && !last->end && !last->slides_until;
}

// The ball sticks again where it is. Beyond the surface it is free.
void Stylus::endSlide(Contact& contact, const Move& move) {
  const Slide& slide = *contact.slide;
  const auto held = slide.heldAt(move.from, contact.slides_from.elapsed(move.start, 0));
  contact.slides_until = Instant{move.start, 0};
  contact.point = held.value_or(move.from);
  contact.normal = unit(contact.point - slide.ball.centre);
}

double Stylus::release(const Move& way) {
  if (count_ == 0) return 0;
  Contact& contact = contacts_[(count_ - 1) % kRemembered];
  if (contact.end) return 0;
  constexpr double kDrift_mm = 1e-4;  // of a warm screw, between two cycles of a control
  if (contact.turned_into && way.length_mm < kDrift_mm) return way.length_mm;
  if (contact.slide && !contact.slides_until) endSlide(contact, way);
  // The body presses while it is behind the tangent plane of the point where the ball sticks.
  const double outwards = dot(way.direction, contact.normal);
  const double depth_mm = dot(contact.point - way.from, contact.normal);
  if (outwards <= 0 || depth_mm > outwards * way.length_mm) return way.length_mm;
  const double distance_mm = std::max(swayed(way, depth_mm / outwards, contact.normal), 0.0);
  const double time_s = way.timeAt(distance_mm);
  contact.end = Instant{way.start, time_s};
  contact.release_mm_s = outwards * way.speedAt(time_s);
  contact.ring_mm = amplitude(contact.release_mm_s);
  return distance_mm;
}

// Speed of the touched point as its part turns, mm/s.
double Stylus::alongNormal(const Contact& contact, double speed_rad_s) {
  const auto& turn = *contact.turned_into;
  return std::abs(speed_rad_s * dot(cross(turn.axis, contact.point - turn.through), contact.normal));
}

void Stylus::struckAt(const Vector3& point, const Vector3& normal, const Instant& begin, const Hold& hold,
                      const TurnOfPart& turn, double speed_rad_s) {
  Contact& contact = contacts_[count_ % kRemembered];
  contact = Contact{};
  contact.point = point;
  contact.normal = normal;
  contact.turned_into = turn;
  contact.speed_mm_s = alongNormal(contact, speed_rad_s);
  contact.bounce_mm = amplitude(contact.speed_mm_s);
  contact.tip = hold.tip;
  contact.turned = hold.turned;
  contact.pre_travel = hold.pre_travel;
  contact.begin = begin;
  if (const double deeper_mm = lobes_.at(transposed(hold.turned) * normal); deeper_mm != 0) {
    const double late_rad = deeper_mm / alongNormal(contact, 1);
    contact.turned_into->contact_rad += turn.sense * late_rad;
    contact.begin.offset_s += late_rad / speed_rad_s;
  }
  ++count_;
}

void Stylus::partedAt(const Instant& end, double speed_rad_s) {
  if (count_ == 0) return;
  Contact& contact = contacts_[(count_ - 1) % kRemembered];
  contact.end = end;
  contact.release_mm_s = alongNormal(contact, speed_rad_s);
  contact.ring_mm = amplitude(contact.release_mm_s);
}

// A stylus that leaves the surface with this speed swings by speed / angular frequency; more would take it through.
double Stylus::amplitude(double normal_speed_mm_s) const {
  return std::clamp(normal_speed_mm_s / angular_frequency_, 0.0, bounce_mm_);
}

double Stylus::decayed(double amplitude_mm, double elapsed_s) const {
  if (amplitude_mm <= 0 || elapsed_s > 40 * decay_s_) return 0;
  return amplitude_mm * std::exp(-elapsed_s / decay_s_) * std::sin(angular_frequency_ * elapsed_s);
}

const Contact* Stylus::contactAt(MonoTime at, double delay_s) const {
  for (std::uint64_t i = count_; const Contact* contact = i > 0 ? this->contact(i - 1) : nullptr; --i) {
    if (contact->begin.elapsed(at, delay_s) >= 0) return contact;
  }
  return nullptr;
}

Vector3 Stylus::displaced(const Contact& contact, const Vector3& body, double c_rad, MonoTime at,
                          double delay_s) const {
  const double free_s = contact.end ? contact.end->elapsed(at, delay_s) : -1;
  if (free_s >= 0) return -decayed(contact.ring_mm, free_s) * contact.normal;
  // A bounce goes off the surface alone.
  const double touched_s = contact.begin.elapsed(at, delay_s);
  const Vector3 bounced = std::abs(decayed(contact.bounce_mm, touched_s)) * contact.normal;
  const Vector3 unheld = body + contact.tip;
  if (const auto& turn = contact.turned_into) {
    const Vector3 arm = contact.point - turn->through, swayed = sway_.none() ? Vector3{} : contact.point - unheld;
    const double turned_rad = turn->sense * std::max(turn->beyond(c_rad), 0.0);
    return rotation(turn->axis, turned_rad) * arm - arm + bounced + swayed;
  }
  // A body that sways may come off the surface for a moment.
  if (!sway_.none() && dot(contact.point - unheld, contact.normal) < 0) return bounced;
  const double slid_s = contact.slide ? contact.slides_from.elapsed(at, delay_s) : -1;
  if (slid_s >= 0 && !(contact.slides_until && contact.slides_until->elapsed(at, delay_s) >= 0))
    return contact.slide->heldAt(unheld, slid_s).value_or(unheld) - unheld;
  return contact.lever * (contact.point - unheld) + bounced;
}

Vector3 Stylus::displacement(const Vector3& body, double c_rad, MonoTime at, double delay_s) const {
  const Contact* contact = contactAt(at, delay_s);
  return contact != nullptr ? displaced(*contact, body, c_rad, at, delay_s) : Vector3{};
}

Vector3 Stylus::inProbeAxes(const Vector3& body, double c_rad, MonoTime at, double delay_s) const {
  const Contact* contact = contactAt(at, delay_s);
  if (contact == nullptr || contact->tool) return {};
  return transposed(contact->turned) * displaced(*contact, body, c_rad, at, delay_s);
}

const Contact* Stylus::contact(std::uint64_t number) const {
  return number < count_ && count_ - number <= kRemembered ? &contacts_[number % kRemembered] : nullptr;
}

std::optional<Vector3> Slide::heldAt(const Vector3& unheld, double elapsed_s) const {
  // No slide is so slow that its ball still sticks then.
  constexpr double kSticking_s = 0.3;
  const Vector3 from_centre = unheld - ball.centre;
  const double distance_mm = norm(from_centre);
  const Vector3 outwards = unit(from_centre), forwards = sense * unit(cross({0, 0, 1}, outwards));
  const double reach_mm = reach(outwards);
  if (distance_mm >= reach_mm) return std::nullopt;
  double angle_rad = friction_rad;
  if (elapsed_s < kSticking_s) angle_rad = std::min(angle_rad, std::atan2(norm(unheld - from), reach_mm - distance_mm));
  // In the triangle of both centres and the unheld ball, the friction angle is at the held one.
  const double aside_mm = reach_mm * std::sin(angle_rad);
  if (aside_mm >= distance_mm) return std::nullopt;
  const double deflection_mm =
      reach_mm * std::cos(angle_rad) - std::sqrt(distance_mm * distance_mm - aside_mm * aside_mm);
  const double behind_rad = std::asin(deflection_mm * std::sin(angle_rad) / distance_mm);
  return ball.centre + reach_mm * (std::cos(behind_rad) * outwards - std::sin(behind_rad) * forwards);
}

double Slide::reach(const Vector3& outwards) const {
  return ball.reach_mm - lobes.at(transposed(turned) * outwards);
}

}  // namespace probebox::world
