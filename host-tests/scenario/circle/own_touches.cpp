#include "own_touches.hpp"

#include <cmath>
#include <gtest/gtest.h>

#include "protocol/units/angle.hpp"

namespace probebox::scenario {
namespace {

using namespace std::chrono_literals;
using world::Vector3;
using world::operator+;
using world::operator-;

constexpr double kTraverse_mm_s = 60;
constexpr double kClearance_mm = 1;
constexpr double kOvertravel_mm = 0.8;

}  // namespace

AddedCorrection::AddedCorrection(Scenario& scenario, RegisterLink& line) : scenario_{scenario}, line_{line} {
  scenario_.world().machine().driveBy([this](const Vector3& to_mm, MonoTime now) { return reached(to_mm, now); });
}

// The motors take the corrected command; the nuts are off from there by what the screws have grown.
Vector3 AddedCorrection::reached(const Vector3& commanded_mm, MonoTime now) {
  if (!adds_) correction_mm_ = {};
  const auto status = static_cast<unsigned>(line_.value(modbus::address::status));
  if (adds_ && (status & published::kValid) != 0 && (status & published::kReferenced) != 0) {
    for (std::size_t i = 0; i < 3; ++i)
      correction_mm_[i] = line_.value(static_cast<std::uint16_t>(modbus::address::correction_f32 + 2 * i));
  }
  const Vector3 motor_mm = commanded_mm + correction_mm_;
  Vector3 nut_mm = motor_mm;
  // The error depends on where the nut is: by a ten-thousandth of it.
  for (int round = 0; round < 3; ++round)
    for (std::size_t i = 0; i < 3; ++i)
      nut_mm[i] = motor_mm[i] + scenario_.world().screws().nutError_mm(i, nut_mm[i], now);
  added_mm_ = nut_mm - commanded_mm;
  return nut_mm;
}

OwnTouches::OwnTouches(Boot& boot, Scenario& scenario, RegisterLink& line, const AddedCorrection& correction,
                       const Config& config, std::uint64_t seed)
    : boot_{boot}, scenario_{scenario}, line_{line}, correction_{correction}, config_{config}, random_{seed, 77} {}

void OwnTouches::settle() {
  while (!scenario_.machine().atRest(scenario_.now())) boot_.run(100ms);
  boot_.run(300ms);
  for (int k = 0; k < 300 && line_.value(modbus::address::settled) != 1; ++k) boot_.run(100ms);
}

void OwnTouches::go(const Vector3& to_mm, double speed_mm_s) {
  settle();
  ASSERT_TRUE(scenario_.world().machine().moveTo(to_mm, speed_mm_s, scenario_.now()));
}

void OwnTouches::traverse(const Vector3& to_mm) {
  const auto from_mm = scenario_.machine().commandedPosition();
  go({from_mm[0], from_mm[1], config_.free_height_mm}, kTraverse_mm_s);
  go({to_mm[0], to_mm[1], config_.free_height_mm}, kTraverse_mm_s);
  go(to_mm, kTraverse_mm_s);
}

void OwnTouches::stand(const world::Pose& pose, std::uint32_t tool) {
  goHome();
  settle();
  auto& machine = scenario_.world().machine();
  ASSERT_TRUE(machine.takeTool(tool, scenario_.now()));
  settle();
  ASSERT_TRUE(machine.turnTo(pose, scenario_.now()));
  settle();
  standHere();
  settle();
}

// Angle of B, and the tool.
void OwnTouches::standHere() {
  const auto& machine = scenario_.machine();
  const auto commit = line_.value(modbus::address::pose_commit) + 1;
  ASSERT_TRUE(line_.write(modbus::address::pose_angle,
                          {0, machine.commandedPose().head_rad / kDegree, 0, 0b1010, machine.tool() * 1.0, 0, commit}));
}

void OwnTouches::goHome() {
  const auto from_mm = scenario_.machine().commandedPosition();
  go({from_mm[0], from_mm[1], config_.free_height_mm}, kTraverse_mm_s);
}

// Where the control stands along the axis at contact, coming against `sense` to a surface that is expected there.
double OwnTouches::touch(const Vector3& surface_mm, std::size_t axis, double sense) {
  Vector3 outside = surface_mm, inside = surface_mm;
  outside[axis] += sense * kClearance_mm;
  inside[axis] -= sense * kOvertravel_mm;
  // Again, with the correction for the place where it is touched.
  go(outside, config_.speed_mm_s);
  go(outside, config_.speed_mm_s);
  const auto& stylus = scenario_.machine().stylus();
  const auto before = stylus.contactCount();
  go(inside, config_.speed_mm_s);
  EXPECT_EQ(stylus.contactCount(), before + 1) << "nothing is where the control expects it";
  const auto* contact = stylus.contact(before);
  const Vector3 at_mm = contact != nullptr ? contact->point - contact->tip - correction_.added() : Vector3{};
  go(outside, config_.speed_mm_s);
  return at_mm[axis] + config_.repeatability_mm * random_.normal();
}

Vector3 OwnTouches::centreOf(const Ball& ball) {
  const auto& [centre, reach] = ball;
  return centreOf(Block{centre, {reach, reach, reach}});
}

// Sides first; the top is then touched in the middle.
Vector3 OwnTouches::centreOf(const Block& block) {
  constexpr double kAround_mm = 3;
  Vector3 centre = block.centre_mm;
  for (const std::size_t axis : {0U, 1U}) {
    Vector3 high = centre, low = centre;
    high[axis] += block.half_mm[axis];
    low[axis] -= block.half_mm[axis];
    Vector3 beside = high;
    beside[axis] += kAround_mm;
    traverse(beside);
    const double one = touch(high, axis, 1);
    go(beside, kTraverse_mm_s);
    beside = low;
    beside[axis] -= kAround_mm;
    traverse(beside);
    const double other = touch(low, axis, -1);
    go(beside, kTraverse_mm_s);
    centre[axis] = (one + other) / 2;
  }
  const Vector3 top = centre + Vector3{0, 0, block.half_mm[2]};
  traverse(top + Vector3{0, 0, kAround_mm});
  centre[2] = touch(top, 2, 1) - block.half_mm[2];
  goHome();
  return centre;
}

}  // namespace probebox::scenario
