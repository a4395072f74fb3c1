// Verdicts of the periodic check against accepted values and limits.
#include <array>
#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <string>
#include <string_view>
#include <utility>

#include "host-tests/metrology/checked_machine.hpp"

namespace probebox::metrology {
namespace {

using testing::AllOf;
using testing::HasSubstr;

// ISO 14253-1: neither conformity nor its contrary is proven where the limit lies within U.
TEST(CheckVerdict, PassesFailsOrProvesNeitherAgainstWhatWasAccepted) {
  std::mt19937_64 random{5};
  const auto verdict = [&](double accepted, double sigma) {
    Dataset dataset = checkOf({}, 0.0, random);
    dataset.config["sigma_mm"] = sigma;
    dataset.config["accepted_Ycen_B0_mm"] = accepted;
    dataset.config["limit_Ycen_B0_mm"] = 0.010;
    const auto solved = solve(dataset);
    EXPECT_NEAR(solved->find("deviation_Ycen_B0_mm")->value(), -0.006 - accepted, 1e-9);
    return solved->find("verdict")->value();
  };
  EXPECT_EQ(verdict(-0.010, 0.001), 0.0);
  EXPECT_EQ(verdict(-0.0155, 0.001), 1.0) << "9.5 um off, limit 10, sd 0.5";
  EXPECT_EQ(verdict(-0.0155, 0.0001), 0.0);
  EXPECT_EQ(verdict(-0.017, 0.0005), 2.0) << "11 um off, limit 10, U 0.5 by the mean of four";
  EXPECT_EQ(verdict(-0.0165, 0.001), 1.0) << "10.5 um off, limit 10, U 1: beyond it, and not proven to be";
  Dataset dataset = checkOf({}, 0.001, random);
  EXPECT_EQ(solve(dataset)->find("verdict"), nullptr) << "nothing to compare with";
  dataset.config["limit_mm"] = 0.005;
  EXPECT_EQ(solve(dataset)->find("verdict")->value(), 2.0) << "the offset errors compare with none";
  EXPECT_THAT(solve(dataset)->warnings, testing::Contains(HasSubstr("calibrate again")));
}

// Two degrees of freedom give no sd, and without U nothing is proven.
TEST(CheckVerdict, ProvesNothingWhereUIsUnknown) {
  std::mt19937_64 random{15};
  Dataset dataset = checkOf({}, 1e-4, random);
  std::erase_if(dataset.tables, [](const Table& table) { return table.name == "x_touch"; });
  const auto swivels = columnNamed(dataset, "centres", "B_deg");
  keepRows(tableNamed(dataset, "centres"), [&](std::size_t row) { return swivels[row] == 0.0; });
  dataset.config.erase("sigma_mm");
  dataset.config["limit_mm"] = 0.020;
  dataset.config["accepted_Xcen_B0_mm"] = 0.019;
  const auto solved = solve(dataset);
  ASSERT_TRUE(solved.ok()) << solved.error().reason;
  EXPECT_EQ(solved->dof, 2u);
  ASSERT_TRUE(solved->find("deviation_Xcen_B0_mm")->sd.empty());
  EXPECT_EQ(solved->find("verdict")->value(), 1.0);
  EXPECT_EQ(solved->find("worst_ratio"), nullptr) << "it has U in it";
  EXPECT_THAT(solved->warnings, testing::Contains(AllOf(HasSubstr("not proven"), HasSubstr("Xcen_B0_mm"),
                                                        HasSubstr("U is"), HasSubstr("state sigma_mm"))));
  dataset.config["accepted_Xcen_B0_mm"] = 0.1;
  EXPECT_EQ(solve(dataset)->find("verdict")->value(), 1.0) << "beyond the limit, and not proven to be";
}

TEST(CheckVerdict, DoesNotPassWhatHasALimitAndIsComparedWithNothing) {
  std::mt19937_64 random{16};
  Dataset dataset = checkOf({}, 1e-4, random);
  dataset.config["limit_Xcen_B0_mm"] = 0.010;
  EXPECT_EQ(solve(dataset)->find("verdict")->value(), 1.0);
  EXPECT_THAT(solve(dataset)->warnings,
              testing::Contains(AllOf(HasSubstr("not proven"), HasSubstr("Xcen_B0_mm"), HasSubstr("a limit"),
                                      HasSubstr("state accepted_Xcen_B0_mm"))));
  dataset.config["accepted_Xcen_B0_mm"] = 0.020;
  EXPECT_EQ(solve(dataset)->find("verdict")->value(), 0.0);
  dataset.config["limit_stylus_offset_x_mm"] = 0.010;
  EXPECT_EQ(solve(dataset)->find("verdict")->value(), 1.0);
  dataset.config.erase("limit_stylus_offset_x_mm");
  dataset.config["limit_Ycen_B45_mm"] = 0.010;
  dataset.config["accepted_Ycen_B45_mm"] = -0.006;
  EXPECT_EQ(solve(dataset)->find("verdict")->value(), 0.0);
  const auto swivels = columnNamed(dataset, "centres", "B_deg");
  keepRows(tableNamed(dataset, "centres"), [&](std::size_t row) { return swivels[row] != 45.0; });
  EXPECT_EQ(solve(dataset)->find("verdict")->value(), 1.0);
  EXPECT_THAT(solve(dataset)->warnings, testing::Contains(AllOf(HasSubstr("Ycen_B45_mm"), HasSubstr("not measured"))));
}

// What was accepted was measured too.
TEST(CheckVerdict, JudgesWithTheDoubtOfWhatWasAccepted) {
  std::mt19937_64 random{12};
  Dataset exact = checkOf({}, 0.0, random);
  exact.config["sigma_mm"] = 1e-4;
  exact.config["accepted_Ycen_B0_mm"] = -0.0155;
  exact.config["limit_Ycen_B0_mm"] = 0.010;
  Dataset measured = exact;
  measured.config["sd_accepted_Ycen_B0_mm"] = 0.0004;
  EXPECT_EQ(solve(exact)->find("verdict")->value(), 0.0);
  EXPECT_EQ(solve(measured)->find("verdict")->value(), 1.0) << "9.5 um off, limit 10, U 0.8";
  measured.config["sd_accepted_Ycen_B0_mm"] = -1e-4;
  EXPECT_EQ(solve(measured).error().name, "bad-config");
  Moments pull;
  for (int world = 0; world < 400; ++world) {
    const auto before = solve(checkOf({}, 0.001, random));
    Dataset again = checkOf({}, 0.001, random);
    again.config["limit_mm"] = 0.1;
    for (const std::string key : {"Xcen_B0_mm", "Ycen_B0_mm", "Ycen_B45_mm", "Ycen_B90_mm"}) {
      again.config["accepted_" + key] = before->find(key)->value();
      again.config["sd_accepted_" + key] = before->find(key)->sd[0];
    }
    const auto solved = solve(again);
    for (const std::string key : {"Xcen_B0_mm", "Ycen_B0_mm", "Ycen_B45_mm", "Ycen_B90_mm"}) {
      const auto* deviation = solved->find("deviation_" + key);
      pull.add(deviation->value(), deviation->sd[0]);
    }
  }
  expectHonest(pull);
}

// A radius that is known to 2 um only cannot pass a machine that is 8 um off where the limit is 10.
TEST(CheckVerdict, JudgesWithWhatIsStatedOfBallAndCentre) {
  std::mt19937_64 random{8};
  const auto judged = [&](double sd_radius, double sd_centre, bool diameters) {
    Dataset dataset = checkOf({.x_offset_error = 0.008, .z_offset_error = 0.001}, 0.0, random, diameters);
    dataset.config["sigma_mm"] = 1e-4;
    dataset.config["limit_x_offset_error_mm"] = diameters ? 0.020 : 0.010;
    dataset.config["limit_z_offset_error_mm"] = 0.010;
    if (sd_radius > 0.0) dataset.config["sd_effective_ball_radius_mm"] = sd_radius;
    if (sd_centre > 0.0) dataset.config["sd_expected_ball_centre_z_mm"] = sd_centre;
    const auto solved = solve(dataset);
    EXPECT_TRUE(solved.ok());
    return solved->find("verdict")->value();
  };
  EXPECT_EQ(judged(0.0, 0.0, false), 0.0);
  EXPECT_EQ(judged(0.0005, 0.0, false), 0.0);
  EXPECT_EQ(judged(0.002, 0.0, false), 1.0);
  EXPECT_EQ(judged(0.0005, 0.0, true), 0.0);
  EXPECT_EQ(judged(0.0015, 0.0, true), 1.0) << "twice the radius is off by twice as much";
  EXPECT_EQ(judged(0.0, 0.003, false), 0.0);
  EXPECT_EQ(judged(0.0, 0.005, false), 1.0);
}

// What the pre-travel of a trigger probe is uncertain by is no part of any sd, and judges run-outs too.
TEST(CheckVerdict, JudgesRunOutsWithTheUncertaintyOfThePreTravel) {
  std::mt19937_64 random{17};
  Dataset dataset = checkOf({}, 1e-4, random);
  Table shifts = Table::withColumns("centres_by_pre_travel_1", std::array<std::string_view, 1>{"x_mm"});
  for (const double a : columnNamed(dataset, "centres", "A_deg")) shifts.append({a < 90.0 ? -0.003 : 0.003});
  dataset.tables.push_back(std::move(shifts));
  dataset.config["accepted_stylus_offset_x_mm"] = 0.025;
  dataset.config["limit_stylus_offset_x_mm"] = 0.004;
  const auto solved = solve(dataset);
  ASSERT_TRUE(solved.ok()) << solved.error().reason;
  const auto& offset = *solved->find("stylus_offset_x_mm");
  ASSERT_EQ(offset.uncertainty.size(), 1U);
  EXPECT_NEAR(offset.uncertainty[0], std::hypot(offset.sd[0], 0.003), 1e-9);
  const auto& other = *solved->find("stylus_offset_y_mm");
  ASSERT_EQ(other.uncertainty.size(), 1U);
  EXPECT_NEAR(other.uncertainty[0], other.sd[0], 1e-12);
  EXPECT_EQ(solved->find("verdict")->value(), 1.0) << "U of 6 um beside a limit of 4";
}

}  // namespace
}  // namespace probebox::metrology
