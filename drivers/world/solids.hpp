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

// A block with faces across the machine axes. Its edges are met as corners of the block that is larger by the stylus
// ball's radius.
struct SolidBlock {
  Vector3 from{}, to{};  // already larger by that radius

  std::optional<Meeting> meet(const Move& way) const;
};

// The datum sphere first.
struct BallCentres {
  std::array<Vector3, 1 + PartSpindleConfig::kMostBalls> centres{};
  std::size_t count{};
};

// How the part is held: the angle of its spindle, and the tilt of the table under that.
struct PartPose {
  double c_rad{};
  double tilt_rad{};
};

// Everything that the stylus can touch, with the part in one pose. Real points are turned about real axes: no
// formula of any calibration stands here.
class Solids {
 public:
  explicit Solids(const Config& config);

  void turnPart(const PartPose& pose);
  // The balls stand in another mount, from 1; they are there with the next turnPart().
  void mountBalls(std::size_t mount) { mount_ = mount; }
  // Where a point of the part is in that pose: it stands at `at_zero` at C = 0 without a tilt.
  Vector3 partPoint(const Vector3& at_zero, const PartPose& pose) const;
  // The nearest surface from `from_mm` on; nothing when the way is free. A shank meets balls alone: nothing else
  // reaches up to it.
  std::optional<Meeting> meet(const Move& way, double from_mm, const std::optional<Shank>& shank = {}) const;
  // The same of a tool. It meets the device that it is set on, and nothing else stands near its ways.
  std::optional<Meeting> meetTool(const Move& way, double from_mm, double radius_mm) const;
  // Of all balls, as they stand now.
  BallCentres ballCentres() const;
  // True when the stylus ball, or the shank above it, cannot be there with the part in that pose, because a ball is.
  bool occupied(const Vector3& point, const PartPose& pose, const std::optional<Shank>& shank = {}) const;

 private:
  Vector3 ballAt(std::size_t ball, const PartPose& pose) const;
  std::optional<Meeting> metBy(const Move& way, const SolidBlock& setter) const;

  PartSpindleConfig spindle_;
  std::size_t mount_{1};
  TiltingTableConfig table_;
  double sphere_radius_mm_;
  SolidBall sphere_;
  std::array<SolidBlock, 2> plates_{};
  std::size_t plate_count_{};
  std::array<SolidBall, PartSpindleConfig::kMostBalls> part_{};
  ToolSetterConfig setter_;
  SolidBlock setter_for_stylus_;
};

}  // namespace probebox::world
