// A machine and a probe that are wired up, and described, in every wrong way.
#include "firmware/metrology/selftest/selftest.hpp"

#include <Eigen/Core>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "firmware/metrology/solve.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using testing::HasSubstr;

constexpr double kJog_mm = 10;
constexpr double kPush_mm = 0.4;

struct Wiring {
  Matrix3d counts = Matrix3d::Identity();     // described position = counts * true position
  Matrix3d described = Matrix3d::Identity();  // gain as it is described; the true one is the identity
  double jog_mm = kJog_mm;                    // what the machine really does
  Vector3d push_mm = {kPush_mm, kPush_mm, kPush_mm};
};

// Three jogs and three pushes, 100 rows each: rest, on the way, and rest again or let go.
Dataset measured(const Wiring& wiring) {
  Dataset dataset = touchDataset("selftest");
  Matrix gain(3, std::vector<double>(3));
  for (Eigen::Index i = 0; i < 3; ++i) {
    for (Eigen::Index k = 0; k < 3; ++k)
      gain[static_cast<std::size_t>(i)][static_cast<std::size_t>(k)] = wiring.described(i, k);
  }
  dataset.config["gain"] = gain;
  auto steps = Table::withColumns("steps", kSelftestColumns);
  for (int step = 0; step < 6; ++step) {
    const bool jogs = step < 3;
    const Vector3d towards = Vector3d::Unit(step % 3);
    for (int row = 0; row < 100; ++row) {
      const double t = row * 1e-3, share = std::clamp((row - 10) / 40.0, 0.0, 1.0);
      const double pushed = row > 20 && row < 80 ? 1 : 0;
      const Vector3d at = wiring.counts * (jogs ? Vector3d{share * wiring.jog_mm * towards} : Vector3d::Zero());
      const Vector3d d = jogs ? Vector3d::Zero() : Vector3d{pushed * wiring.push_mm.cwiseProduct(towards)};
      dataset.tables[0].append({1.0 * step, t, at[0] + 5, at[1] - 7, at[2] + 100});
      dataset.tables[1].append({1.0 * step, t, d[0] + 0.01, d[1] - 0.02, d[2] + 0.03});
    }
    dataset.tables[2].append({1.0 * step, towards[0], towards[1], towards[2], towards[0], towards[1], towards[2], 10});
    steps.append({1.0 * step, jogs ? kJog_mm : 0});
  }
  dataset.tables.push_back(std::move(steps));
  return dataset;
}

std::vector<std::string> names(const Wiring& wiring) {
  const auto findings = selftestFindings(measured(wiring));
  EXPECT_TRUE(findings);
  std::vector<std::string> names;
  for (const auto& finding : *findings) {
    EXPECT_EQ(finding.good, finding.name.empty());
    names.push_back(finding.name);
  }
  return names;
}

// Half a digit of either end is in no scatter.
TEST(Selftest, HasTheSdOfTheDigitsOfItsReadings) {
  Dataset dataset = measured({.jog_mm = 10.0137});
  const auto fine = solve(dataset);
  ASSERT_TRUE(fine) << fine.error().reason;
  EXPECT_LT(fine->find("moved_mm")->sd[0], 1e-4);
  for (auto& table : dataset.tables) {
    for (auto& column : table.columns) {
      if (column.name != "x_mm" && column.name != "b") continue;
      for (double& value : column.values) value = std::round(value / 0.01) * 0.01;
    }
  }
  const auto coarse = solve(dataset);
  ASSERT_TRUE(coarse) << coarse.error().reason;
  const auto& moved = *coarse->find("moved_mm");
  EXPECT_NEAR(moved.sd[0], 0.01 / std::sqrt(6.0), 1e-6) << "two means";
  EXPECT_LT(std::abs(moved.values[0] - 10.0137), 2 * moved.sd[0]);
  EXPECT_LT(moved.sd[1], 1e-4) << "its digits are finer";
  const auto& deflected = *coarse->find("deflected_mm");
  EXPECT_NEAR(deflected.sd[13], 0.01 / std::sqrt(6.0), 1e-6) << "the push along Y";
}

TEST(Selftest, IsContentWithAMachineThatIsDescribedAsItIs) {
  const auto solved = solve(measured({}));
  ASSERT_TRUE(solved) << solved.error().reason;
  const auto& moved = solved->find("moved_mm")->values;
  for (std::size_t step = 0; step < 6; ++step) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const bool jogged = step == axis;
      EXPECT_NEAR(moved[3 * step + axis], jogged ? kJog_mm : 0, 1e-12);
      EXPECT_NEAR(solved->find("deflected_mm")->values[3 * step + axis], step == axis + 3 ? kPush_mm : 0, 1e-12);
    }
  }
}

// Every set of wrong senses, signs of the probe and scales is told step by step, and nothing else is.
RC_GTEST_PROP(Selftest, NamesExactlyWhatIsWrong, ()) {
  Wiring wiring;
  std::vector<std::string> expected(6);
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const auto at = static_cast<std::size_t>(axis);
    const auto trouble = *rc::gen::inRange(0, 4);
    const double scale = *rc::gen::element(0.1, 0.5, 0.97, 1.03, 2.54, 10.0);
    if (trouble == 1) wiring.counts(axis, axis) = -1, expected[at] = "sense-wrong";
    if (trouble == 2) wiring.counts(axis, axis) = scale, expected[at] = "scale-wrong";
    if (trouble == 3) wiring.counts(axis, axis) = 0, expected[at] = "axis-stood";
    const auto probe = *rc::gen::inRange(0, 3);
    if (probe == 1) wiring.described.row(axis) *= -1, expected[at + 3] = "probe-sign-wrong";
    if (probe == 2) wiring.push_mm[axis] = 0.01, expected[at + 3] = "not-deflected";
  }
  RC_ASSERT(names(wiring) == expected);
}

RC_GTEST_PROP(Selftest, TellsInputsThatAreExchanged, ()) {
  const auto first = *rc::gen::inRange(0, 3);
  const auto second = (first + *rc::gen::inRange(1, 3)) % 3;
  Wiring wiring;
  wiring.counts.row(first).swap(wiring.counts.row(second));
  wiring.described.row(first).swap(wiring.described.row(second));
  std::vector<std::string> expected(6);
  for (const auto axis : {first, second}) {
    expected[static_cast<std::size_t>(axis)] = "axes-exchanged";
    expected[static_cast<std::size_t>(axis) + 3] = "probe-direction-wrong";
  }
  RC_ASSERT(names(wiring) == expected);
}

TEST(Selftest, AsksForOneAxisAlone) {
  Wiring wiring;
  wiring.counts(1, 0) = 0.03;
  const auto found = names(wiring);
  EXPECT_EQ(found.front(), "not-alone");
}

TEST(Selftest, GivesTheFactorThatMendsAScale) {
  Wiring wiring;
  wiring.counts(2, 2) = 25.4;
  const auto solved = solve(measured(wiring));
  ASSERT_FALSE(solved);
  EXPECT_EQ(solved.error().name, "scale-wrong");
  EXPECT_THAT(solved.error().reason,
              testing::AllOf(HasSubstr("counts_per_mm"), HasSubstr("[axis.Z]"), HasSubstr("by 25.4")));
}

// One wild sample decides nothing.
TEST(Selftest, DoesNotTakeASpikeForAPush) {
  Wiring wiring;
  wiring.push_mm = {0, kPush_mm, kPush_mm};
  auto dataset = measured(wiring);
  dataset.tables[1].columns[2].values[350] = 0.5;
  const auto findings = selftestFindings(dataset);
  ASSERT_TRUE(findings);
  EXPECT_EQ((*findings)[3].name, "not-deflected");
}

// Pushed before the step began, or not released before it ended.
TEST(Selftest, TakesNoPushForOneInTheOtherSense) {
  for (const bool begins_free : {false, true}) {
    auto dataset = measured({});
    const auto& touch = dataset.tables[1].columns[0].values;
    auto& channel = dataset.tables[1].columns[2].values;
    const auto first = static_cast<std::size_t>(std::ranges::find(touch, 3.0) - touch.begin());
    const auto rows = static_cast<std::size_t>(std::ranges::count(touch, 3.0));
    for (std::size_t row = 0; row < rows; ++row) channel[first + row] = (row < rows / 2) == begins_free ? 0 : kPush_mm;
    const auto findings = selftestFindings(dataset);
    ASSERT_TRUE(findings);
    EXPECT_EQ((*findings)[3].name, "not-free");
    EXPECT_THAT((*findings)[3].what, HasSubstr("release"));
  }
}

// Where samples are missing around the contact, few are left of the free probe.
TEST(Selftest, TakesFiveRowsBeforeAPushAndFiveAfterItForFree) {
  auto dataset = measured({});
  auto& probe = dataset.tables[1];
  for (int more = 0; more < 300; ++more) probe.append({3.0, 0.1 + more * 1e-3, kPush_mm + 0.01, -0.02, 0.03});
  const auto& touch = probe.columns[0].values;
  const auto rows = static_cast<std::size_t>(std::ranges::count(touch, 3.0));
  std::size_t row = 0;
  for (std::size_t i = 0; i < touch.size(); ++i) {
    if (touch[i] != 3.0) continue;
    probe.columns[2].values[i] = 0.01 + (row < kSelftestEndRows || row >= rows - kSelftestEndRows ? 0 : kPush_mm);
    ++row;
  }
  const auto findings = selftestFindings(dataset);
  ASSERT_TRUE(findings);
  EXPECT_TRUE((*findings)[3].good) << (*findings)[3].what;
}

// A right description would be told off: by A = 90 X is seen as Y.
TEST(Selftest, RefusesAProbeThatIsKnownToBeTurned) {
  Dataset dataset = measured({});
  dataset.config["A_rad"] = 0.001;
  EXPECT_TRUE(solve(dataset));
  dataset.config["A_rad"] = -1.5707963;
  EXPECT_EQ(solve(dataset).error().name, "spindle-turned");
}

TEST(Selftest, AsksForTheAngleOfTheSpindleBeforeItBlamesTheDescription) {
  const Matrix3d quarter{{0, -1, 0}, {1, 0, 0}, {0, 0, 1}};
  for (const Matrix3d& turned : {quarter, Matrix3d{quarter * quarter}}) {
    const auto findings = selftestFindings(measured({.described = turned}));
    ASSERT_FALSE((*findings)[3].good);
    EXPECT_THAT((*findings)[3].what, HasSubstr("A stands"));
  }
}

TEST(Selftest, RefusesStepsThatAreNotThere) {
  auto dataset = measured({});
  dataset.tables[3].columns[0].values[2] = 17;
  EXPECT_EQ(selftestFindings(dataset).error().name, "incomplete-step");
  dataset.config.erase("gain");
  EXPECT_EQ(selftestFindings(dataset).error().name, "bad-config");
}

}  // namespace
}  // namespace probebox::metrology
