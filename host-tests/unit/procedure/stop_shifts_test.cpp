#include "firmware/procedure/dataset/stop_shifts.hpp"

#include <Eigen/Geometry>
#include <array>
#include <gtest/gtest.h>
#include <string_view>
#include <vector>

#include "firmware/procedure/dataset/b_tables.hpp"

// What a stop of the table or of the head displaces readings by, against the rotation itself.
namespace probebox::procedure {
namespace {

using Eigen::AngleAxisd;
using Eigen::Vector3d;

Facts factsOfBoth() {
  Facts facts;
  facts.tilting_table = BFacts{.axis = {1, 0, 0}, .sigma_rad = 5e-6, .point_mm = std::array<double, 3>{330, 200, -260}};
  facts.swivel_head =
      HeadFacts{.b = {.axis = {0, 1, 0}, .sigma_rad = 1e-6}, .pivot_mm = {0, 0, 60}, .ball_mm = {}, .sd_ball_mm = {}};
  facts.probe_tools = {.count = 2, .numbers = {1, 2}, .lengths_mm = {150, 200}};
  return facts;
}

BallReadings oneReading(const Vector3d& at_mm, std::uint32_t tool, double b_rad = 0) {
  BallReadings found;
  Reading& reading = found.readings.emplace_back();
  reading.b_rad = b_rad;
  reading.tool = tool;
  reading.centre.centre_mm = at_mm;
  return found;
}

Vector3d movedBy(const BallReadings& further, const Vector3d& at_mm) {
  return further.readings.front().centre.centre_mm - at_mm;
}

TEST(StopOfTheTable, TurnsTheBallAboutItsAxis) {
  const Facts facts = factsOfBoth();
  const Vector3d ball{360, 220, -160}, point{330, 200, -260};
  const Vector3d truth = AngleAxisd{5e-6, Vector3d::UnitX()} * (ball - point) + point - ball;
  EXPECT_LT((movedBy(withTableFurther(oneReading(ball, 1), facts), ball) - truth).norm(), 1e-8);
  // With a tool that is 50 mm longer the machine stands 50 mm higher over the same ball.
  const Vector3d higher = ball + Vector3d{0, 0, 50};
  EXPECT_LT((movedBy(withTableFurther(oneReading(higher, 2), facts), higher) - truth).norm(), 1e-8);
  // So it does elsewhere with the head swivelled.
  const Vector3d aside = ball + nominalTip(*facts.swivel_head, 0, 150) - nominalTip(*facts.swivel_head, 0.7, 150);
  EXPECT_LT((movedBy(withTableFurther(oneReading(aside, 1, 0.7), facts), aside) - truth).norm(), 1e-8);
}

TEST(StopOfTheHead, MovesTheMachineAgainstTheTip) {
  const Facts facts = factsOfBoth();
  const Vector3d at{360, 220, -160};
  for (const auto& [tool, length_mm] : {std::pair{0U, 150.0}, {1U, 150.0}, {2U, 200.0}}) {
    const Vector3d truth =
        nominalTip(*facts.swivel_head, 0, length_mm) - nominalTip(*facts.swivel_head, 1e-6, length_mm);
    EXPECT_LT((movedBy(withHeadFurther(oneReading(at, tool), facts), at) - truth).norm(), 1e-8) << tool;
    EXPECT_GT(truth.norm(), 2e-4);
  }
  EXPECT_EQ(movedBy(withHeadFurther(oneReading(at, 1, 0.7), facts), at), Vector3d::Zero().eval()) << "another stop";
}

// Numbered where the head stood at several stops; what touched hangs further down with a longer tool.
TEST(StopsOfTheHead, AreNumberedByVisitWhereAToolSetterIsTouchedAtSeveralAngles) {
  const Facts facts = factsOfBoth();
  constexpr std::array<std::string_view, 3> kColumns{"x_mm", "y_mm", "z_mm"};
  const Vector3d probe{0.02, -0.01, -150}, tool{0, 0, -190}, pivot{0, 0, 60};
  const std::vector<TouchingTip> rows{{0, probe}, {0, probe}, {1.5, probe}, {0, tool}, {1.5, tool}};
  metrology::Dataset dataset;
  addStopsOfHead(dataset, "touches", kColumns, rows, facts);
  const auto* shift = dataset.table("touches_by_stop_of_head");
  ASSERT_NE(shift, nullptr);
  EXPECT_EQ(*shift->column("of_stop"), (std::vector<double>{1, 1, 2, 3, 4}));
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const auto at = [&](double b_rad) -> Vector3d {
      return AngleAxisd{b_rad, Vector3d::UnitY()} * (rows[k].tip_mm - pivot);
    };
    const Vector3d truth = at(rows[k].b_rad) - at(rows[k].b_rad + 1e-6);
    for (std::size_t i = 0; i < 3; ++i)
      EXPECT_NEAR((*shift->column(kColumns[i]))[k], truth[static_cast<Eigen::Index>(i)], 1e-8) << k;
  }
  // One stop for all where B never moves, as in any other run.
  addStopsOfHead(dataset, "readings", kColumns, std::span{rows}.first(2), facts);
  EXPECT_EQ(dataset.table("readings_by_stop_of_head")->column("of_stop"), nullptr);
  Facts without = facts;
  without.swivel_head->b.sigma_rad = 0;
  addStopsOfHead(dataset, "others", kColumns, rows, without);
  EXPECT_EQ(dataset.table("others_by_stop_of_head"), nullptr);
}

// Its readings are places, and its centre hangs aside of the stylus ball.
TEST(StopsOfASensorHead, MoveItsReadingsAsBallAndCentreMove) {
  Facts facts = factsOfBoth();
  facts.sensor_head = SensorHead{.tool = 5, .range_mm = 0.5, .centre_offset_mm = {10, 0, -70}};
  const Vector3d ball{360, 220, -160}, point{330, 200, -260}, pivot{0, 0, 60};
  const Vector3d with_table = AngleAxisd{5e-6, Vector3d::UnitX()} * (ball - point) + point - ball;
  EXPECT_LT((movedBy(withTableFurther(oneReading(ball, 5), facts), ball) - with_table).norm(), 1e-8);
  const Vector3d arm = Vector3d{10, 0, -220} - pivot;
  const Vector3d with_head = arm - AngleAxisd{1e-6, Vector3d::UnitY()} * arm;
  EXPECT_LT((movedBy(withHeadFurther(oneReading(ball, 5), facts), ball) - with_head).norm(), 1e-8);
}

}  // namespace
}  // namespace probebox::procedure
