#pragma once
#include <array>
#include <cstddef>
#include <optional>

#include "board/describe/world.hpp"
#include "drivers/world/config.hpp"
#include "drivers/world/motion.hpp"
#include "drivers/world/vector.hpp"

namespace probebox::world {

// Point at which a straight path of the stylus ball's centre meets a surface.
struct Meeting {
  double distance_mm{};  // along the way
  Vector3 normal{};      // of the surface, outward
  bool setter{};         // of the tool-setting device
  double lever{1};       // displacement of the stylus' ball per displacement of the touching part
};

// Models a ball for the path of the stylus ball's centre.
struct SolidBall {
  Vector3 centre{};
  double reach_mm{};  // radius of the ball and of the stylus ball

  std::optional<Meeting> meet(const Move& way) const;
};

// Models the shank above the stylus' ball in its current orientation: a cylinder with round ends.
struct Shank {
  Vector3 low{}, high{};  // the ends of its axis, from the centre of the stylus' ball
  double radius_mm{};
  double lever{1};  // displacement of the ball per displacement of the shank

  // Returns where on a straight path of the stylus ball's centre the shank touches a ball. For a path that begins
  // inside, it is the point of entry before the beginning.
  std::optional<Meeting> meet(const Move& way, const Vector3& ball, double ball_radius_mm) const;
  // Returns whether shank and ball overlap with the centre of the stylus' ball at `tip`.
  bool strikes(const Vector3& tip, const Vector3& ball, double ball_radius_mm) const;
};

// Returns where a ball of the part stands in that mount, from the spindle's point at C = 0.
inline Vector3 inMount(const board::WorldMount& mount, const Vector3& ball) {
  return rotation(unit(mount.turn_rad), norm(mount.turn_rad)) * ball + mount.shift_mm;
}

// Models a block with faces normal to the machine axes, grown by the stylus ball's radius; its edges are not
// rounded.
struct SolidBlock {
  Vector3 from{}, to{};  // already larger by that radius

  std::optional<Meeting> meet(const Move& way) const;
};

// Models a pin along Z, or a ring about a bore, grown by the stylus ball's radius; its edges are not rounded.
struct SolidRing {
  Vector3 middle{};
  double inner_mm{}, outer_mm{}, half_height_mm{};  // already grown; inner 0: a pin

  // The nearest place beyond `from_mm` where a way enters it.
  std::optional<Meeting> meet(const Move& way, double from_mm) const;
};

// The datum sphere first.
struct BallCentres {
  std::array<Vector3, 1 + 2 * board::WorldPartSpindle::kMostBalls> centres{};
  std::size_t count{};
};

// Pose of the part: the angle of its spindle and the tilt of the table under it.
struct PartPose {
  double c_rad{};
  double tilt_rad{};
  double second_c_rad{};  // of the second spindle, which no table carries
};

// Holds everything that the stylus can touch, with the part in one pose. True points turn about true axes: no formula
// of a calibration is used here.
class Solids {
 public:
  explicit Solids(const Config& config);

  void turnPart(const PartPose& pose);
  // The balls stand in another mount, from 1; they are there with the next turnPart().
  void mountBalls(std::size_t mount) { mount_ = mount; }
  // Returns a point of the part in that pose; at_zero: the point at C = 0 without tilt.
  Vector3 partPoint(const Vector3& at_zero, const PartPose& pose) const;
  // Returns the nearest surface beyond `from_mm`; nothing when the path is free. A shank can touch balls only: other
  // features do not reach up to it.
  std::optional<Meeting> meet(const Move& way, double from_mm, const std::optional<Shank>& shank = {}) const;
  // Returns it for a tool, which can touch the tool-setting device only.
  std::optional<Meeting> meetTool(const Move& way, double from_mm, double radius_mm, bool nose = false) const;
  const SolidBall& sphere() const { return sphere_; }
  // Returns all balls in the current pose.
  BallCentres ballCentres() const;
  // Returns whether the stylus ball, or the shank above it, would overlap a ball with the part in that pose.
  bool occupied(const Vector3& point, const PartPose& pose, const std::optional<Shank>& shank = {}) const;

 private:
  Vector3 ballAt(std::size_t ball, const PartPose& pose) const;
  std::optional<Meeting> metBy(const Move& way, const SolidBlock& setter) const;

  std::size_t ballCount() const { return spindle_.balls_mm.size() + second_.balls_mm.size(); }
  double radiusOf(std::size_t ball) const {
    return ball < spindle_.balls_mm.size() ? spindle_.ball_radius_mm : second_.ball_radius_mm;
  }

  board::WorldPartSpindle spindle_, second_;  // the second one without balls where there is none
  std::size_t mount_{1};
  board::WorldTiltingTable table_;
  double sphere_radius_mm_;
  SolidBall sphere_;
  std::array<SolidBlock, 7> blocks_{};  // plates across X, Y, Z, and a cube
  std::size_t block_count_{};
  std::optional<SolidRing> ring_;
  std::array<SolidBall, 2 * board::WorldPartSpindle::kMostBalls> part_{};  // those of the second spindle last
  std::optional<board::WorldToolSetter> setter_;
  SolidBlock setter_for_stylus_;
};

}  // namespace probebox::world
