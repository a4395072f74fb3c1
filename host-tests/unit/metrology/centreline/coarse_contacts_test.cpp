// Contacts of C on either side of a stylus: read in coarse steps, or copied.
#include <array>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <numbers>

#include "firmware/metrology/dataset/digits.hpp"
#include "host-tests/metrology/cases.hpp"
#include "protocol/units/angle.hpp"

namespace probebox::metrology {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::Gt;
using testing::HasSubstr;
using testing::Lt;
using testing::Not;

constexpr const char* kCopies = "equal in every digit";

Dataset contacts(const std::vector<std::array<double, 2>>& pairs) {
  Dataset dataset{.method = "c-zero-shift", .config = {}, .tables = {}};
  Table& table = addTable(dataset, "contacts", {"C1_rad", "C2_rad"});
  for (const auto& [c1, c2] : pairs) table.append({c1, c2});
  return dataset;
}

// Pairs at c1 and c2 in a display of `step`, all in degrees.
Dataset displayed(double c1, double c2, double step, double noise, std::mt19937_64& random) {
  std::vector<std::array<double, 2>> pairs;
  const auto read = [&](double c) { return radians(std::round((c + gauss(random, noise)) / step) * step); };
  for (int pair = 0; pair < 5; ++pair) pairs.push_back({read(c1), read(c2)});
  return contacts(pairs);
}

TEST(CoarseContacts, HaveTheSdOfTheStepsOfC) {
  std::mt19937_64 random{81};
  constexpr double kStep = 0.001;
  for (const double noise : {0.2, 0.3, 0.5, 1.0, 3.0}) {
    Moments shift;
    int unknown = 0;
    for (int trial = 0; trial < 600; ++trial) {
      const double c1 = uniform(random, 5, 20), c2 = -uniform(random, 5, 20);
      const auto solved = solve(displayed(c1, c2, kStep, noise * kStep, random));
      ASSERT_TRUE(solved.ok()) << solved.error().reason;
      EXPECT_THAT(solved->warnings, Not(Contains(HasSubstr(kCopies)))) << "honest repeats";
      const auto& found = *solved->find("C_shift_rad");
      if (found.sd.empty()) {
        ++unknown;
        EXPECT_THAT(solved->warnings, Contains(AllOf(HasSubstr("no sd: "), HasSubstr("state sigma_C_rad"))));
        EXPECT_FALSE(solved->covariance);
        continue;
      }
      shift.add(found.value() - radians((c1 + c2) / 2), found.sd[0]);
    }
    // Too wide where one side alone shows a step: what is left of the other is smaller than from anywhere.
    EXPECT_THAT(shift.pull(), AllOf(Gt(0.15), Lt(1.3))) << noise;
    if (noise >= 1.0) {
      EXPECT_THAT(shift.pull(), Gt(0.7)) << "where noise averages the steps out: " << noise;
      EXPECT_EQ(unknown, 0);
    }
  }
}

TEST(CoarseContacts, ThatAreEqualHaveTheStatedSd) {
  std::mt19937_64 random{82};
  Dataset dataset = displayed(12.344, -12.412, 0.001, 0, random);
  const auto unknown = solve(dataset);
  ASSERT_TRUE(unknown.ok()) << unknown.error().reason;
  EXPECT_TRUE(unknown->find("C_shift_rad")->sd.empty());
  dataset.config["sigma_C_rad"] = 1e-5;
  EXPECT_NEAR(solve(dataset)->find("C_shift_rad")->sd[0], 1e-5 / std::sqrt(10.0), 1e-12);
}

// One side alone: the other may well be at the same digits.
TEST(CoarseContacts, OfOneSideThatAreEqualAreNoFrozenChannel) {
  std::mt19937_64 random{83};
  for (const double step : {0.001, 1.0 / 3600}) {
    Dataset dataset = displayed(3 * 12.344, -15.0, step, 0, random);
    columnNamed(dataset, "contacts", "C2_rad")[2] += radians(step);
    EXPECT_EQ(refusalOf(dataset), "") << step;
  }
  Dataset frozen = displayed(12.344, -12.412, 1e-9, 1e-3, random);
  std::ranges::fill(columnNamed(frozen, "contacts", "C1_rad"), 0.2154432109);
  EXPECT_EQ(refusalOf(frozen), "frozen-channel");
}

TEST(CopiedContacts, AreToldWhetherASigmaIsStatedOrNot) {
  std::mt19937_64 random{84};
  std::vector<std::array<double, 2>> pairs;
  for (int pair = 0; pair < 4; ++pair) pairs.push_back({0.21 + gauss(random, 1e-5), -0.22 + gauss(random, 1e-5)});
  const auto once = pairs;
  EXPECT_THAT(solve(contacts(pairs))->warnings, testing::IsEmpty());
  for (int paste = 1; paste < 4; ++paste) pairs.insert(pairs.end(), once.begin(), once.end());
  Dataset dataset = contacts(pairs);
  EXPECT_THAT(solve(dataset)->warnings,
              Contains(AllOf(HasSubstr("rows 1"), HasSubstr("'contacts'"), HasSubstr(kCopies))));
  dataset.config["sigma_C_rad"] = 1e-5;
  EXPECT_THAT(solve(dataset)->warnings, Contains(HasSubstr(kCopies)));
}

TEST(CopiedContacts, OfTheStepsAreTold) {
  Dataset dataset{
      .method = "centreline-by-steps", .config = {{"sigma_mm", 0.001}, {"sigma_contact_rad", 1e-5}}, .tables = {}};
  Table steps = Table::withColumns(
      "readings", std::array<std::string_view, 4>{"loop", "C_rad_clockwise_from_plus_y", "x_mm", "y_mm"});
  for (const double c : {0.7, -0.7, 0.0}) steps.append({1, c, 0.3 + 600 * std::sin(c), -0.6 + 600 * std::cos(c)});
  Table pairs = Table::withColumns("contacts", std::array<std::string_view, 2>{"C1_rad", "C2_rad"});
  pairs.append({0.0212345678, -0.0209876543});
  dataset.tables = {std::move(steps), std::move(pairs)};
  const auto once = solve(dataset);
  ASSERT_TRUE(once.ok()) << once.error().reason;
  EXPECT_THAT(once->warnings, Not(Contains(HasSubstr(kCopies))));
  tableNamed(dataset, "contacts").append({0.0212345678, -0.0209876543});
  EXPECT_THAT(solve(dataset)->warnings, Contains(HasSubstr(kCopies)));
}

TEST(DigitOfAnAngle, IsThatOfTheUnitItWasReadIn) {
  EXPECT_NEAR(digitOfAngle(0.0123), 1e-4, 1e-12);
  EXPECT_NEAR(digitOfAngle(radians(12.344)), radians(0.001), 1e-12);
  EXPECT_NEAR(digitOfAngle(std::round(radians(12.344) * 1e9) / 1e9), radians(0.001), 1e-12) << "as a case file has it";
  EXPECT_NEAR(digitOfAngle(radians(12 + 17.0 / 3600)), radians(1.0 / 3600), 1e-12);
  EXPECT_LT(digitOfAngle(0.2154432109876), 1e-7);
}

}  // namespace
}  // namespace probebox::metrology
