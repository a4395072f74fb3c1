// Records of one touch that no line can be drawn through.
#include "firmware/metrology/touch/retract.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "firmware/metrology/touch/touch.hpp"
#include "host-tests/metrology/cases.hpp"
#include "host-tests/metrology/touch_simulation.hpp"

namespace probebox::metrology {
namespace {

Touch touched() {
  std::mt19937_64 random{17};
  return readTouches(simulation::measure(simulation::Scene{}, random)).value().front();
}

TEST(Retract, OfASoundRecordHasBothLines) {
  EXPECT_TRUE(fitRetract(touched(), {}));
}

// As a receiver that repeats samples of another touch makes it.
TEST(Retract, IsRefusedWhereTheDeflectionAtRestHasNoOneDirection) {
  auto touch = touched();
  auto& values = touch.probe.values;
  for (Eigen::Index k = 0; k < values.rows(); ++k)
    values.row(k) = values.row(k).norm() * Eigen::RowVector3d::Unit(k % 3);
  const auto retract = fitRetract(touch, {});
  ASSERT_FALSE(retract);
  EXPECT_EQ(retract.error().name, "deflection-unsteady");
  EXPECT_THAT(retract.error().reason, testing::HasSubstr("check probe and cable"));
}

}  // namespace
}  // namespace probebox::metrology
