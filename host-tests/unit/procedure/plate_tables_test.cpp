#include "firmware/procedure/methods/plate_tables.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <set>

#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/methods/plate_poses.hpp"
#include "firmware/procedure/plan/procedure.hpp"
#include "obedient_machine.hpp"
#include "protocol/units/angle.hpp"

// Tables of a ball plate in several mounts, where C stops beside its angles and reports where.
namespace probebox::procedure {
namespace {

using Eigen::Vector3d;

const BallPlate kPlate{
    .axis_point_mm = {10, -5, 0}, .sd_mm = {}, .balls_mm = {{60, 0, 50}, {-30, 50, 50}, {-30, -50, 80}}};

// By mount and stop: 0.0004 degrees between the mounts, then more.
double besideOf(std::uint16_t mount, std::size_t stop, double most_rad) {
  return most_rad * std::sin(static_cast<double>(7U * mount + 3U * stop));
}

std::vector<Reading> readingsOfPlate(double most_rad) {
  std::vector<Reading> readings;
  for (std::uint16_t mount = 1; mount <= 2; ++mount) {
    for (std::uint16_t stop = 0; stop <= 4; ++stop) {
      const double wanted_rad = stop == 0 ? 0.0 : (stop - 1) * 90 * kDegree;
      const double c_rad = wanted_rad + besideOf(mount, stop, most_rad);
      for (std::size_t ball = 0; ball < 3; ++ball) {
        const Vector3d point = vectorOf(kPlate.axis_point_mm);
        const Vector3d on_plate = Eigen::AngleAxisd{0.3 * mount, Vector3d::UnitZ()} * vectorOf(kPlate.balls_mm[ball]);
        readings.push_back({.ball = static_cast<double>(ball + 1),
                            .c_rad = c_rad,
                            .mount = mount,
                            .note = noteOfStop(stop),
                            .centre = {.centre_mm = point + Eigen::AngleAxisd{c_rad, Vector3d::UnitZ()} * on_plate,
                                       .sd_mm = {1e-3, 1e-3, 1e-3},
                                       .radius_mm = 0}});
      }
    }
  }
  return readings;
}

TEST(PlateTables, GiveAStopOneAngleInAllMounts) {
  for (const double most_rad : {0.0, 7e-6, 9e-4}) {
    metrology::Dataset dataset;
    const auto readings = readingsOfPlate(most_rad);
    addPlate(dataset, readings, kPlate, {});
    const auto& first = *dataset.table("first");
    const auto& phi = *first.column("phi_rad");
    ASSERT_EQ(phi.size(), 24U);
    EXPECT_EQ(std::set<double>(phi.begin(), phi.end()).size(), 4U) << most_rad;
    for (std::size_t row = 0; row < phi.size(); ++row) {
      const auto mount = static_cast<std::uint16_t>((*first.column("mount"))[row]);
      const auto ball = static_cast<std::size_t>((*first.column("ball"))[row]) - 1;
      const Vector3d at{(*first.column("x_mm"))[row], (*first.column("y_mm"))[row], (*first.column("z_mm"))[row]};
      // Where the mount began, turned by phi.
      const double from_rad = besideOf(mount, 0, most_rad);
      const Vector3d on_plate = Eigen::AngleAxisd{0.3 * mount, Vector3d::UnitZ()} * vectorOf(kPlate.balls_mm[ball]);
      const Vector3d there =
          vectorOf(kPlate.axis_point_mm) + Eigen::AngleAxisd{from_rad + phi[row], Vector3d::UnitZ()} * on_plate;
      EXPECT_LT((at - there).norm(), 1e-9) << "row " << row << ", " << most_rad;
    }
  }
}

std::string refusalOfMounts(double second_beside_rad) {
  Procedure procedure{liveMethods(), capture::Capacity{}};
  ObedientMachine machine{procedure};
  procedure.start(
      {.run = 1, .method = kRotaryAxisErrors.number, .at = {}, .options = {.angles = 2, .balls = 3, .mounts = 2}});
  while (procedure.progress().state == State::waiting) {
    const auto& touch = procedure.plan().steps[procedure.progress().step].touch;
    machine.angles_rad = touch.rotary_angles_rad;
    // The mount began that much to one side, and stops to the other.
    if (touch.mount == 2) machine.angles_rad[2] += (stopOf(touch.note) == 0 ? -0.5 : 0.5) * second_beside_rad;
    machine.touch();
  }
  EXPECT_EQ(procedure.progress().state, State::solving);
  const auto refusal = whyMountsDiffer(procedure.recording());
  return refusal ? refusal->name : "";
}

TEST(PlateTables, RefuseMountsWhoseStopsDiffer) {
  EXPECT_EQ(refusalOfMounts(0), "");
  EXPECT_EQ(refusalOfMounts(1.9e-3), "");
  EXPECT_EQ(refusalOfMounts(-2.1e-3), "mounts-differ");
}

}  // namespace
}  // namespace probebox::procedure
