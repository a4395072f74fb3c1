#pragma once
#include <array>
#include <cstddef>
#include <optional>

#include "drivers/world/config.hpp"
#include "drivers/world/meeting.hpp"
#include "drivers/world/motion.hpp"
#include "drivers/world/shank.hpp"
#include "drivers/world/solid_ball.hpp"
#include "drivers/world/vector.hpp"

namespace probebox::world {

// Models a block with faces normal to the machine axes, grown by the stylus ball's radius; its edges are not
// rounded.
struct SolidBlock {
  Vector3 from{}, to{};  // already larger by that radius

  std::optional<Meeting> meet(const Move& way) const;
};

// The datum sphere first.
struct BallCentres {
  std::array<Vector3, 1 + board::WorldPartSpindle::kMostBalls> centres{};
  std::size_t count{};
};

// Pose of the part: the angle of its spindle and the tilt of the table under it.
struct PartPose {
  double c_rad{};
  double tilt_rad{};
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

  board::WorldPartSpindle spindle_;
  std::size_t mount_{1};
  board::WorldTiltingTable table_;
  double sphere_radius_mm_;
  SolidBall sphere_;
  std::array<SolidBlock, 2> plates_{};
  std::size_t plate_count_{};
  std::array<SolidBall, board::WorldPartSpindle::kMostBalls> part_{};
  std::optional<board::WorldToolSetter> setter_;
  SolidBlock setter_for_stylus_;
};

}  // namespace probebox::world
