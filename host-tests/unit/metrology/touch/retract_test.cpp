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

// docs/metrology.md A.3: a sample that is off alone is left out, wherever it is, at rest and at the ends too.
TEST(Retract, LeavesOutAWildSampleWhereverItIs) {
  const auto sound = touched();
  const auto clean = fitRetract(sound, {});
  ASSERT_TRUE(clean);
  for (Stream Touch::*stream : {&Touch::machine, &Touch::probe}) {
    const auto rows = (sound.*stream).values.rows();
    for (Eigen::Index k = 0; k < rows; ++k) {
      for (const double off_mm : {0.05, -3.0}) {
        auto touch = sound;
        (touch.*stream).values(k, k % 3) += off_mm;
        const auto retract = fitRetract(touch, {});
        ASSERT_TRUE(retract) << "row " << k << " of " << rows << " off by " << off_mm << ": " << retract.error().reason;
        EXPECT_NEAR(separationTime(retract->probe), separationTime(clean->probe), 1e-4) << "row " << k;
      }
    }
  }
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
  EXPECT_THAT(retract.error().reason, testing::HasSubstr("cable"));
}

}  // namespace
}  // namespace probebox::metrology
