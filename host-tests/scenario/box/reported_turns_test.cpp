#include <cmath>
#include <gtest/gtest.h>
#include <vector>

#include "firmware/procedure/methods/methods.hpp"
#include "host-tests/emulation/scenario.hpp"
#include "measured.hpp"
#include "protocol/units/angle.hpp"

// A control that reports rotary angles from 0 to 360 degrees: an axis that stands a little below 0 is at 359.98.
namespace probebox::scenario {
namespace {

constexpr double kBeside_rad = 0.02 * kDegree;

// The axes stand to either side of their angles in turn.
void reportWithinATurn(Scenario& scenario) {
  scenario.as_reported = [](Marker& marker) {
    for (double& angle_rad : marker.rotary_angles_rad) {
      angle_rad += marker.step % 2 == 0 ? kBeside_rad : -kBeside_rad;
      angle_rad -= kTurn * std::floor(angle_rad / kTurn);
    }
  };
}

const std::vector<double>& column(const Scenario& scenario, const char* table, const char* name) {
  return *scenario.dataset().table(table)->column(name);
}

TEST(AnglesWithinATurn, AreThoseOfAPeriodicCheck) {
  Scenario scenario{usualWorld(), 3};
  reportWithinATurn(scenario);
  ASSERT_TRUE(measured(scenario, procedure::kPeriodicCheck));
  EXPECT_EQ(column(scenario, "z_touch", "z_mm").size(), 3U) << "the first pose is read again, last";
  for (const double c_deg : column(scenario, "centres", "C_deg")) EXPECT_TRUE(c_deg == 0 || c_deg == 180) << c_deg;
  for (const double b_deg : column(scenario, "centres", "B_deg")) EXPECT_EQ(b_deg, 0);
}

TEST(AnglesWithinATurn, AreThoseOfTheAxisThatTurns) {
  Scenario scenario{usualWorld(), 3};
  reportWithinATurn(scenario);
  ASSERT_TRUE(measured(scenario, procedure::kRotaryAxisErrors));
  EXPECT_EQ(std::get<std::string>(scenario.dataset().config.at("axis")), "C");
  for (const double phi_rad : column(scenario, "first", "phi_rad")) {
    EXPECT_LT(std::abs(std::remainder(phi_rad, kTurn / 8)), 2.1 * kBeside_rad);
    EXPECT_GT(phi_rad, -2.1 * kBeside_rad);
    EXPECT_LT(phi_rad, 7.1 * kTurn / 8);
  }
}

TEST(AnglesWithinATurn, MakeOneStopOfOne) {
  Scenario scenario{usualWorld(), 3};
  reportWithinATurn(scenario);
  ASSERT_TRUE(measured(scenario, procedure::kSpindleOffset2x2));
  const auto reported = column(scenario, "readings", "stop");
  Scenario plain{usualWorld(), 3};
  ASSERT_TRUE(measured(plain, procedure::kSpindleOffset2x2));
  EXPECT_EQ(reported, column(plain, "readings", "stop"));
}

}  // namespace
}  // namespace probebox::scenario
