#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "board/describe/world.hpp"
#include "drivers/world/config.hpp"
#include "drivers/world/motion.hpp"
#include "drivers/world/random.hpp"
#include "drivers/world/sensor_head.hpp"
#include "drivers/world/solids.hpp"
#include "drivers/world/stylus.hpp"
#include "drivers/world/sway.hpp"
#include "drivers/world/vector.hpp"
#include "protocol/units/time.hpp"

namespace probebox::world {

// Angles of the rotary axes: the probe's spindle, the head that holds it, the table under the part, the part's
// spindles.
struct Pose {
  double a_rad{};
  double head_rad{};
  double table_rad{};
  double c_rad{};
  double second_c_rad{};

  PartPose part() const { return {c_rad, table_rad, second_c_rad}; }
  friend bool operator==(const Pose&, const Pose&) = default;
};

// The longest of the turns from one pose to another.
inline double wayBetween(const Pose& from, const Pose& to) {
  return std::max({std::abs(to.a_rad - from.a_rad), std::abs(to.head_rad - from.head_rad),
                   std::abs(to.table_rad - from.table_rad), std::abs(to.c_rad - from.c_rad),
                   std::abs(to.second_c_rad - from.second_c_rad)});
}

inline Pose between(const Pose& from, const Pose& to, double share) {
  const auto at = [share](double one, double other) { return one + share * (other - one); };
  return {at(from.a_rad, to.a_rad), at(from.head_rad, to.head_rad), at(from.table_rad, to.table_rad),
          at(from.c_rad, to.c_rad), at(from.second_c_rad, to.second_c_rad)};
}

// Computes the geometric errors of the linear axes (board::WorldLinearAxes).
class LinearErrors {
 public:
  explicit LinearErrors(const board::WorldLinearAxes& config);

  // Returns the position of the body minus the position on the scales, mm. Exactly zero for a machine without errors.
  Vector3 at(const Vector3& position) const;
  bool none() const { return none_; }

 private:
  board::WorldLinearAxes config_;
  bool none_;
};

// Emulates a machine: three linear axes carry the probe or a tool in a spindle (rotary axis A) in a head that may
// swivel; a part spindle (C) stands on a table that may tilt. A position is that of the moving reference: the centre of
// the free stylus ball without the offset that the probe's spindle adds.
class Machine {
 public:
  explicit Machine(const Config& config, std::uint64_t seed = 0);

  // Takes a command of the control to where its drives really bring the axes, from the next move on: by corrections
  // that the control adds, and by errors between motor and nut. Without one they go where they are told.
  using Drives = std::function<Vector3(const Vector3& commanded_mm, MonoTime now)>;
  void driveBy(Drives drives) { drives_ = std::move(drives); }

  // Commands, for a controller.

  // Starts a straight move from rest to rest at `now`. Returns false without effect while the last move lasts.
  bool moveTo(const Vector3& target_mm, double speed_mm_s, MonoTime now);
  bool traverseTo(const Vector3& target_mm, MonoTime now) { return moveTo(target_mm, axes_.traverse_mm_s, now); }
  // The same until the stylus, or the tool, meets something: the move ends beyond_mm behind that, as that of a control
  // with a skip function does. Returns the commanded position at the contact; nothing where it met nothing.
  std::optional<Vector3> moveUntilContact(const Vector3& target_mm, double speed_mm_s, MonoTime now, double beyond_mm);
  // As moveTo(), while the stylus stays in contact with the datum sphere and its ball slides along it. The sense is
  // that of the first such move. The second moves by an arc about a centre in the plane of X and Y.
  bool slideTo(const Vector3& target_mm, double speed_mm_s, MonoTime now);
  bool slideRound(const Vector3& centre_mm, double turn_rad, double speed_mm_s, MonoTime now);
  bool atRest(MonoTime now) const { return motion_.atRest(now) && now >= turned_at_; }
  // Turns the rotary axes to these angles without taking the shorter direction. Returns false without effect during a
  // motion. The true stop deviates by the noise of a stop.
  bool turnTo(const Pose& pose, MonoTime now) { return turnTo(pose, rotary_.speed_rad_s, now); }
  bool turnTo(const Pose& pose, double speed_rad_s, MonoTime now);
  // Turns C alone towards this angle and stops at the trigger when a ball of the part meets the free stylus, as a
  // control with a skip function does, beyond_rad after the contact. Without contact C turns to the angle. Returns
  // false without effect during a motion or while the stylus touches.
  bool turnUntilContact(double c_rad, double speed_rad_s, MonoTime now, double beyond_rad = 0);
  const Pose& commandedPose() const { return commanded_; }
  // Commands, for a control outside that leads the axes cycle by cycle, in place of those above. They may lie ahead of
  // what the sensors have been asked for.

  // Moves at constant speed during one cycle, and stops there unless the next one goes on.
  void follow(const Vector3& position_mm, MonoTime from, MonoTime until);
  // Turns the rotary axes during one cycle. Where C alone turns, slowly, until a ball of the part meets the free
  // stylus, the ball takes it along from there and leaves it at the same angle on the way back.
  void followPose(const Pose& pose, MonoTime from, MonoTime until);
  // Changes the tool at once: how long that takes is up to the control. False without effect for an unknown one.
  bool followTool(std::uint32_t number, MonoTime from);
  // Puts the balls into another mount at once: a person takes their time.
  bool followMount(std::size_t mount, MonoTime from);
  // Tells whether stylus or tool touches something where the last command ends.
  bool touching() const;

  // Changes to another tool, with a stylus of its own or one that cuts. Returns false without effect during a motion
  // and for an unknown tool.
  bool takeTool(std::uint32_t number, MonoTime now);
  std::uint32_t tool() const { return tool_.number; }
  bool hasTool(std::uint32_t number) const { return toolOf(number).number == number; }
  // Puts the balls on the part's spindle into another mount, from 1. Returns false without effect during a motion and
  // for an unknown mount.
  bool mountBalls(std::size_t mount, MonoTime now);
  std::size_t mount() const { return mount_; }
  bool hasMount(std::size_t mount) const { return mount >= 1 && mount <= mounts_; }
  Vector3 commandedPosition() const { return commanded_mm_; }

  // The truth, for the sensors and for tests, `delay_s` before `at`.

  // Return the position on ideal encoders of the drives, and that of the body, which has their lost motion, the errors
  // of the linear axes and its own sway too.
  Vector3 positionAt(MonoTime at, double delay_s = 0) const {
    return motion_.positionAt(at, delay_s) + axes_sway_.at(at, delay_s);
  }
  Vector3 bodyAt(MonoTime at, double delay_s = 0) const {
    return bodyFor(motion_.slideAt(at, delay_s)) + body_sway_.at(at, delay_s);
  }
  // Returns where slides that stand there carry a body that does not sway.
  Vector3 bodyFor(const Vector3& slides) const { return slides + linear_errors_.at(slides); }
  double speedAt(MonoTime at) const { return motion_.speedAt(at); }
  // Centre of the stylus ball minus bodyAt(), mm, in machine axes.
  Vector3 stylusDisplacementAt(MonoTime at, double delay_s = 0) const {
    return stylus_.displacement(bodyAt(at, delay_s), partAngleAt(at, delay_s), at, delay_s);
  }
  // Returns it in the probe's own axes.
  Vector3 probeDisplacementAt(MonoTime at, double delay_s) const {
    return stylus_.inProbeAxes(bodyAt(at, delay_s), partAngleAt(at, delay_s), at, delay_s);
  }
  // Returns what a sensor head instead of the probe reads of the nearest ball; nothing without a head.
  std::optional<HeadReading> headReadingAt(MonoTime at, double delay_s) const {
    return sensor_head_.reading(bodyAt(at, delay_s), at, delay_s);
  }
  // Returns how far off a surface is along the axis of a probe that does not touch, from its face, whose middle of the
  // range is where a stylus would have its ball; at most twice as far.
  double distanceAt(MonoTime at, double delay_s, double stand_off_mm) const;
  const Stylus& stylus() const { return stylus_; }
  // Returns the stylus ball with that tool at an ideal stop of the pose, relative to positionAt().
  Vector3 tipIn(const Pose& pose, std::uint32_t tool) const { return holdAt(pose, toolOf(tool)).tip; }
  // Returns the angle of C on its encoder.
  double partAngleAt(MonoTime at, double delay_s = 0) const { return part_.angleAt(at, delay_s); }
  // Returns a point of the part in that pose; at_zero: the point at C = 0 without tilt.
  Vector3 partPoint(const Vector3& at_zero, const PartPose& pose) const { return solids_.partPoint(at_zero, pose); }
  // Counts collisions: stylus and ball during a turn, a turn while the stylus touched, or a sensor head that reached a
  // ball from the side.
  std::uint64_t crashes() const { return crashes_; }

 private:
  static constexpr double kJerkTime_s = 0.001;  // rise and fall time of the acceleration

  double stopAt(double angle_rad, double noise_rad) { return angle_rad + noise_rad * random_.normal(); }
  Hold holdAt(const Pose& pose, const board::WorldTool& tool) const;
  board::WorldTool toolOf(std::uint32_t number) const;
  bool strikesOnTheWayTo(const Pose& pose, MonoTime now) const;
  const TurnOfPart* turnedInto() const;  // null where the stylus does not touch by a turn
  Vector3 bodyEnd(MonoTime at) const;
  Vector3 tipEnd(MonoTime at) const { return bodyEnd(at) + hold_.tip; }
  double strike(double c_rad, const Instant& at, double sense, double speed_rad_s);
  void turnTouching(const Pose& pose, double speed_rad_s, MonoTime from, MonoTime until);
  bool turnsByC(const Pose& pose) const;
  double armOf(const Vector3& point) const;
  bool leadsPart(const Pose& pose, MonoTime from, MonoTime until);
  bool slidesTo(const Vector3& position_mm, double speed_mm_s, MonoTime from);
  Vector3 normalAt(const Vector3& tip) const;
  std::optional<double> shareUntilContact(const Pose& from, const Pose& to, MonoTime now) const;
  std::optional<double> shareUntilMet(const Move& move) const;
  bool comesFromAside(const Move& move) const;
  void carry(const Move& move);
  template <class Take>
  void forEachWay(const Move& move, Take take) const;
  MotionLimits limits(double speed_mm_s) const { return {speed_mm_s, axes_.acceleration_mm_s2, kJerkTime_s}; }
  void turn(const Pose& pose, MonoTime from, MonoTime until);
  void standAt(const Pose& pose, MonoTime from, MonoTime until);
  void change(const board::WorldTool& tool);
  void putInto(std::size_t mount);
  void standFrom(MonoTime since);
  void standStillFor(Nanoseconds duration, MonoTime now);

  board::WorldAxes axes_;
  Vector3 part_point_, part_axis_;  // with the table level
  board::WorldRotary rotary_;
  board::WorldProbeSpindle probe_spindle_;
  std::vector<board::WorldTool> further_tools_;
  board::WorldSwivelHead head_;
  LinearErrors linear_errors_;
  Sway axes_sway_, body_sway_;
  MotionHistory motion_;
  Drives drives_;
  Vector3 commanded_mm_;
  bool reads_distances_;
  Solids solids_;
  Stylus stylus_;
  SensorHead sensor_head_;
  Random random_;
  Hold hold_;
  Pose commanded_;
  Pose stands_;  // true angles
  board::WorldTool tool_;
  std::size_t mounts_;
  std::size_t mount_{1};
  TurnHistory part_;  // C by its encoder
  Pose led_from_;     // where the last cycle of a control outside began
  MonoTime turned_at_{MonoTime::min()};
  std::uint64_t crashes_{};
};

}  // namespace probebox::world
