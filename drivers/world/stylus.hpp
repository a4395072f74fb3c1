#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "drivers/world/config.hpp"
#include "drivers/world/motion.hpp"
#include "drivers/world/solids.hpp"
#include "drivers/world/sway.hpp"
#include "drivers/world/vector.hpp"
#include "protocol/units/time.hpp"

namespace probebox::world {

// Travel by direction from where a surface really is to where a probe finds it. The stylus sits on contacts, so it has
// lobes about its axis.
struct Lobes {
  double mean_mm{};  // across the stylus
  double twice_mm{}, thrice_mm{};
  double along_mm{};

  // Of the outward normal in the probe's own axes.
  double at(const Vector3& normal) const;
};

// Emulates a stylus ball that slides around the equator of a ball with friction: its deflection deviates from the
// normal by the friction angle, against the motion. Before that it sticks while the body moves on.
struct Slide {
  SolidBall ball{};
  double sense{1};        // 1: from X to Y
  double friction_rad{};  // arc tangent of the coefficient
  Vector3 from{};         // free stylus ball as it begins
  Lobes lobes{};
  Matrix3 turned{};  // of the probe

  // Centre of the stylus ball for where it would be without contact, `elapsed_s` after the slide began. Nothing beyond
  // the surface, where contact is lost.
  std::optional<Vector3> heldAt(const Vector3& unheld, double elapsed_s) const;
  // From the ball's centre to that of the stylus ball, in that direction.
  double reach(const Vector3& outwards) const;
};

// An instant finer than a nanosecond.
struct Instant {
  MonoTime base{};
  double offset_s{};

  // From this instant to the one `delay_s` before `at`.
  double elapsed(MonoTime at, double delay_s) const { return toSeconds(at - base) - delay_s - offset_s; }
  MonoTime rounded() const;
};

// The part has turned into the stylus, which sticks to the touched point until the part has turned back to there.
struct TurnOfPart {
  Vector3 axis{}, through{};  // of the part's spindle
  double contact_rad{};       // by its encoder
  double sense{};             // in which it came

  double beyond(double c_rad) const { return sense * (c_rad - contact_rad); }
};

// Contact of the stylus ball or its shank. The ball's centre stays at `point` until the body releases it.
struct Contact {
  Vector3 point{};   // mm
  Vector3 normal{};  // outward
  Vector3 tip{};     // of the stylus ball's centre against the body while it touches
  Matrix3 turned{};  // of the probe, from its own axes into the machine's
  Instant begin;
  std::optional<Instant> end;
  double bounce_mm{};  // first amplitudes
  double ring_mm{};
  double speed_mm_s{};                      // along the normal, at contact
  double release_mm_s{};                    // the same at its end
  bool setter{};                            // with the tool-setting device
  bool tool{};                              // of a tool, and not of the stylus
  std::optional<TurnOfPart> turned_into{};  // the part came to the stylus, which stood still
  // Displacement of the ball per displacement of the touched shank; 1 where the ball itself is touched.
  double lever{1};
  double pre_travel{1};  // of the switch, over that of the first tool touched by its ball
  // From `slides_from` until the body begins to withdraw the ball slides; then `point` is where it has come to.
  std::optional<Slide> slide{};
  Instant slides_from{};
  std::optional<Instant> slides_until{};
};

// State of the probe's spindle: the stylus ball's centre, or the tip of a tool, relative to the body, and the
// orientation of the probe.
struct Hold {
  Vector3 tip{};
  Matrix3 turned{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  std::optional<double> tool_radius_mm{};  // of a tool instead of the probe
  bool nose{};                             // about the tip, and not above it
  bool touches_nothing{};                  // a sensor head, or a probe that reads distances
  std::optional<Shank> shank{};            // above the stylus' ball
  double pre_travel{1};                    // of its switch, over that with the first tool
};

// Emulates the stylus as a ball on a spring. In contact the ball sticks to the touched point for any direction of
// approach, unless it is made to slide; its centre never enters a solid grown by its radius. It bounces at contact and
// rings at release, both at the frequency of the free stylus.
class Stylus {
 public:
  static constexpr std::size_t kRemembered = 64;

  // `sway` of the body is added to its moves here, and is part of what the other functions call `body`.
  Stylus(const Config& config, Sway sway);

  // Finds the contacts that a move of the body makes and ends.
  void follow(const Move& move, const Solids& solids, const Hold& hold);
  // Returns where what is held meets a surface on a move of the body, from that distance on.
  std::optional<Meeting> meeting(const Move& move, double from_mm, const Solids& solids, const Hold& hold) const;

  // The ball that touches `ball` slides along it from `begin` on, until a move that it follows. False where it does not
  // touch it.
  bool slide(const Instant& begin, const Vector3& body, const SolidBall& ball, double sense);

  // Makes a contact: the part turns against the resting stylus, its ball's centre at `point`, and on. normal: outwards
  // from what struck it.
  void struckAt(const Vector3& point, const Vector3& normal, const Instant& begin, const Hold& hold,
                const TurnOfPart& turn, double speed_rad_s);
  // Ends that contact: the part leaves the stylus, where it met it, at that speed; 0 where it had not turned beyond.
  void partedAt(const Instant& end, double speed_rad_s);

  // Returns the displacement of the stylus ball from its free position, mm, in machine axes, `delay_s` before `at`.
  // body, c_rad: position and angle of the part by its encoder at that instant.
  Vector3 displacement(const Vector3& body, double c_rad, MonoTime at, double delay_s) const;
  // Returns it in the probe's own axes, which turn with its spindle; zero while a tool is in the spindle.
  Vector3 inProbeAxes(const Vector3& body, double c_rad, MonoTime at, double delay_s) const;

  std::uint64_t contactCount() const { return count_; }
  bool slides() const;  // along a ball, at present
  // Returns the contact of that number, from 0; null when it lies ahead or is no longer remembered.
  const Contact* contact(std::uint64_t number) const;

 private:
  void endSlide(Contact& contact, const Move& move);
  double release(const Move& way);  // distance from which on the ball is free; the length when it stays in contact
  Move wayOf(const Move& move, const Hold& hold) const;
  double swayed(const Move& way, double distance_mm, const Vector3& normal) const;
  const Contact* contactAt(MonoTime at, double delay_s) const;
  Vector3 displaced(const Contact& contact, const Vector3& body, double c_rad, MonoTime at, double delay_s) const;
  static double alongNormal(const Contact& contact, double speed_rad_s);
  double amplitude(double normal_speed_mm_s) const;
  double decayed(double amplitude_mm, double elapsed_s) const;

  Sway sway_;
  Lobes lobes_;
  double bounce_mm_;
  double decay_s_;
  double angular_frequency_;
  double friction_rad_;
  std::array<Contact, kRemembered> contacts_{};
  std::uint64_t count_{};
};

}  // namespace probebox::world
