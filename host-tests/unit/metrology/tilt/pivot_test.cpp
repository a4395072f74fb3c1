// A tilting table in three dimensions, its axes anywhere and not quite parallel to X or Y.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "firmware/metrology/tilt/pivot_axis.hpp"
#include "host-tests/metrology/cases.hpp"
#include "host-tests/metrology/fisher.hpp"
#include "host-tests/metrology/tilting_table.hpp"
#include "protocol/units/angle.hpp"

namespace probebox::metrology {
namespace {

using Eigen::AngleAxisd;
using Eigen::Vector3d;

// Two points at two tilts fit a skew axis exactly, whatever one reading is off; the way along the axis tells.
TEST(TablePivot, RefusesABadReadingThatItsPartnerContradicts) {
  std::mt19937_64 random{11};
  for (const double off_mm : {21.5, -2.0, 0.5}) {
    for (std::size_t row = 0; row < 4; ++row) {
      for (const auto* across : {"y_mm", "z_mm"}) {
        Dataset dataset = tableDataset(randomTable(random, 4e-4), {-90, 0}, {0, 180}, 1e-3, random);
        columnNamed(dataset, "readings", across)[row] += off_mm;
        const auto solved = solve(dataset);
        // A small one may hide below a tenth of a millimetre along the axis: then a warning names it.
        if (solved && off_mm == 0.5) {
          EXPECT_THAT(solved->warnings, testing::Contains(testing::HasSubstr("contradict")));
          continue;
        }
        ASSERT_FALSE(solved) << across << ", row " << row << ", " << off_mm;
        EXPECT_THAT(solved.error().name, testing::AnyOf("readings-contradict", "pivot-check-disagrees"));
      }
    }
  }
}

TEST(TablePivot, WarnsOfAReadingThatIsALittleOff) {
  std::mt19937_64 random{12};
  Tilting table;
  table.ball = {40, 2, 255.6};
  Dataset dataset = tableDataset(table, {-90, 0}, {0, 180}, 1e-4, random);
  ASSERT_TRUE(solve(dataset));
  EXPECT_THAT(solve(dataset)->warnings, testing::ElementsAre(testing::StartsWith("no-redundancy")));
  columnNamed(dataset, "readings", "z_mm")[3] += 0.01;
  const auto solved = solve(dataset);
  ASSERT_TRUE(solved) << solved.error().reason;
  EXPECT_THAT(solved->warnings, testing::Contains(testing::HasSubstr("its skew")));
}

TEST(TablePivot, ReachesTheBoundAndStatesItsUncertainty) {
  std::mt19937_64 random{1};
  Judgement judgement;
  for (int trial = 0; trial < 600; ++trial) {
    const Tilting table = randomTable(random, 4e-4);
    const double sigma = uniform(random, 3e-4, 3e-3);
    const bool two = trial % 2 == 0;
    const std::vector<double> tilts = two ? std::vector<double>{-90, 0} : std::vector<double>{-80, -35, 10, 30};
    const auto solved = solve(tableDataset(table, tilts, {0, 180}, sigma, random));
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    // (B7) for points of sigma / sqrt2.
    Eigen::Vector2d mean{0, 0};
    for (const double tilt : tilts) mean += Eigen::Vector2d{std::cos(tilt * kDegree), std::sin(tilt * kDegree)};
    const auto n = static_cast<double>(tilts.size());
    const double bound = sigma / std::sqrt(2.0 * n * (1.0 - (mean / n).squaredNorm()));
    const auto& pivot = *solved->find("pivot_yz_mm");
    for (std::size_t k = 0; k < 2; ++k) {
      judgement.add(pivot.values[k] - table.pivot[static_cast<Eigen::Index>(k) + 1], pivot.sd[k], bound);
    }
  }
  expectHonest(judgement);
}

// Any tilts, angles of C and readings that are missing: the pivot counts where the C axis is.
TEST(TablePivot, IsAsUncertainAsItSaysWhateverIsMissing) {
  std::mt19937_64 random{21};
  const std::vector<std::vector<double>> angles{{0, 180}, {0, 90, 135}, {0, 90, 180, 270}};
  for (std::size_t k = 0; k < angles.size(); ++k) {
    Moments pivot;
    for (int trial = 0; trial < 500; ++trial) {
      const Tilting table = randomTable(random, 4e-4);
      const double sigma = uniform(random, 1e-4, 1e-2);
      std::vector<double> tilts{-90, 0};
      while (tilts.size() < 3 + random() % 6) tilts.push_back(uniform(random, -100, 40));
      Dataset dataset = tableDataset(table, tilts, angles[k], sigma, random);
      keepRows(dataset.tables[0], [&](std::size_t row) { return row < 2 * angles[k].size() || random() % 3 > 0; });
      const auto solved = solve(dataset);
      ASSERT_TRUE(solved.ok()) << solved.error().reason;
      EXPECT_NEAR(solved->find("along_mm")->value(), table.c_axis.x(), 0.2);
      const auto& found = *solved->find("pivot_yz_mm");
      for (std::size_t j = 0; j < 2; ++j) {
        pivot.add(found.values[j] - table.pivot[static_cast<Eigen::Index>(j) + 1], found.sd[j]);
      }
    }
    SCOPED_TRACE(testing::Message() << angles[k].size() << " angles");
    expectHonest(pivot);
    EXPECT_LT(std::abs(pivot.bias()), 4.0);
  }
}

// The readings as they are when every stop of the table is off by an angle of its own.
Dataset withStopsOff(const Tilting& table, const std::vector<double>& tilts, double sigma_mm, double sigma_rad,
                     std::mt19937_64& random) {
  std::vector<double> real = tilts;
  for (double& tilt : real) tilt += gauss(random, sigma_rad) / kDegree;
  Dataset dataset = tableDataset(table, real, {0, 180}, sigma_mm, random);
  auto& told = columnNamed(dataset, "readings", "tilt_deg");
  for (std::size_t row = 0; row < told.size(); ++row) told[row] = tilts[row / 2];
  dataset.config["sigma_angle_rad"] = sigma_rad;
  return dataset;
}

// A stop that is off moves all its readings across their arms, so the two coordinates are not known equally well.
TEST(TablePivot, StatesWhatStopsOfTheTableMayBeOff) {
  std::mt19937_64 random{11};
  for (const char* method : {"table-pivot", "table-pivot-3d"}) {
    std::array<Moments, 2> pulls;
    for (int trial = 0; trial < 600; ++trial) {
      const Tilting table = randomTable(random, 4e-4);
      Dataset dataset = withStopsOff(table, {-40, 0, 30}, 2e-4, 1e-5, random);
      dataset.method = method;
      const auto solved = solve(dataset);
      ASSERT_TRUE(solved.ok()) << solved.error().reason;
      EXPECT_THAT(solved->warnings, testing::Not(testing::Contains(testing::HasSubstr("sigma_angle_rad"))));
      const auto& pivot = *solved->find("pivot_yz_mm");
      for (std::size_t k = 0; k < 2; ++k) {
        pulls[k].add(pivot.values[k] - table.pivot[static_cast<Eigen::Index>(k) + 1], pivot.sd[k]);
      }
      EXPECT_GT(pivot.sd[1], 1.5 * pivot.sd[0]);
    }
    SCOPED_TRACE(method);
    for (const auto& pull : pulls) expectHonest(pull);
  }
}

// The table stands clamped while C turns: its error is one, however often the control reads its angle.
TEST(TablePivot, CountsTheErrorOfAStopOnceWhateverDigitsAreReported) {
  std::mt19937_64 random{15};
  for (const char* method : {"table-pivot", "table-pivot-3d"}) {
    std::array<Moments, 2> pulls;
    for (int trial = 0; trial < 600; ++trial) {
      const Tilting table = randomTable(random, 4e-4);
      Dataset dataset = withStopsOff(table, {-45, 45}, 2e-4, 1e-5, random);
      dataset.method = method;
      for (double& tilt : columnNamed(dataset, "readings", "tilt_deg")) tilt += uniform(random, -2e-5, 2e-5);
      const auto solved = solve(dataset);
      ASSERT_TRUE(solved.ok()) << solved.error().reason;
      const auto& pivot = *solved->find("pivot_yz_mm");
      for (std::size_t k = 0; k < 2; ++k) {
        pulls[k].add(pivot.values[k] - table.pivot[static_cast<Eigen::Index>(k) + 1], pivot.sd[k]);
      }
    }
    SCOPED_TRACE(method);
    for (const auto& pull : pulls) expectHonest(pull);
  }
}

// (B28) checks a quarter turn as it is reported: the case that fails it at -90 and 0 does so beside them.
TEST(TablePivot, ChecksAQuarterTurnThatIsMeasured) {
  std::mt19937_64 random{16};
  Tilting aside;
  aside.c_axis.y() = aside.pivot.y() + 300.0;
  aside.ball = {-3.0, aside.c_axis.y(), aside.pivot.z() + 210.0};
  for (const double off_deg : {0.0001, 0.05, -0.1}) {
    const std::vector<double> tilts{-90 + off_deg, 0 - off_deg};
    EXPECT_EQ(refusalOf(tableDataset(aside, tilts, {0, 180}, 0.001, random)), "pivot-check-disagrees") << off_deg;
    for (int trial = 0; trial < 50; ++trial) {
      EXPECT_EQ(refusalOf(tableDataset(randomTable(random, 4e-4), tilts, {0, 180}, 0.001, random)), "") << off_deg;
    }
  }
}

TEST(TablePivot, CannotWeighStopsWithoutTheSigmaOfAReading) {
  std::mt19937_64 random{12};
  auto dataset = tableDataset({}, {-90, -30, 0}, {0, 180}, 1e-3, random);
  const auto plain = solve(dataset);
  dataset.config.erase("sigma_mm");
  dataset.config["sigma_angle_rad"] = 1e-5;
  const auto solved = solve(dataset);
  ASSERT_TRUE(solved.ok());
  EXPECT_THAT(solved->warnings,
              testing::Contains(testing::AllOf(testing::HasSubstr("sigma_angle_rad"), testing::HasSubstr("not used"))));
  EXPECT_NEAR(solved->find("pivot_yz_mm")->values[0], plain->find("pivot_yz_mm")->values[0], 1e-9);
}

// Of C a control reports where it stopped.
TEST(TablePivot, TakesAnglesOfCAsTheyAreRead) {
  std::mt19937_64 random{42};
  Moments errors;
  for (int trial = 0; trial < 300; ++trial) {
    const Tilting table = randomTable(random, 4e-4);
    Dataset dataset = tableDataset(table, {-90, -45, 0}, {0, 180}, 1e-3, random);
    for (double& c : columnNamed(dataset, "readings", "C_deg")) c += gauss(random, 1e-5);
    const auto solved = solve(dataset);
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    EXPECT_THAT(solved->warnings, testing::Not(testing::Contains(testing::HasSubstr("degrees apart"))));
    const auto& found = *solved->find("pivot_yz_mm");
    for (std::size_t k = 0; k < 2; ++k)
      errors.add(found.values[k] - table.pivot[static_cast<Eigen::Index>(k) + 1], found.sd[k]);
  }
  expectHonest(errors);
  Dataset dataset = tableDataset(randomTable(random, 4e-4), {-90, -45, 0}, {0, 180}, 1e-3, random);
  columnNamed(dataset, "readings", "C_deg")[2] += 0.01;
  EXPECT_THAT(solve(dataset)->warnings, testing::Contains(testing::HasSubstr("0.01")));
}

TEST(TablePivot, GivesTheWorkedExample) {
  std::mt19937_64 random{2};
  const Tilting table{.ball = {-3.0, -5.3, 255.6}};  // on the C axis
  const auto dataset = tableDataset(table, {-90, 0}, {0}, 0.0, random);
  EXPECT_NEAR((*dataset.tables[0].column("y_mm"))[0], 197.7, 1e-9);
  EXPECT_NEAR((*dataset.tables[0].column("z_mm"))[0], 38.6, 1e-9);
  const auto solved = solve(dataset);
  EXPECT_NEAR(solved->find("pivot_yz_mm")->values[0], -12.3, 1e-9);
  EXPECT_NEAR(solved->find("pivot_yz_mm")->values[1], 45.6, 1e-9);
}

RC_GTEST_PROP(TablePivot, IsFoundForAnyAxisItsSenseAndAnyOrderOfReadings, ()) {
  std::mt19937_64 random{*rc::gen::arbitrary<std::uint64_t>()};
  const auto k = *rc::gen::inRange<Eigen::Index>(0, 3);
  Tilting table = randomTable(random, 0.0);
  table.axis = Vector3d::Zero();
  table.axis[k] = *rc::gen::element(1.0, -1.0);
  table.c_axis = table.pivot;
  table.ball = table.pivot + Vector3d{uniform(random, 50, 90), uniform(random, 50, 90), uniform(random, 90, 150)};
  Dataset dataset = tableDataset(table, {-60, -20, 35, 70}, {0, 75, 180}, 0.0, random);
  // A channel without any noise is refused.
  for (auto& column : dataset.tables[0].columns) {
    if (column.name.ends_with("_mm"))
      for (double& value : column.values) value += gauss(random, 1e-10);
  }
  // Rows change places.
  std::vector<std::size_t> order{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11};
  std::ranges::shuffle(order, random);
  for (auto& column : dataset.tables[0].columns) {
    const auto values = column.values;
    for (std::size_t row = 0; row < order.size(); ++row) column.values[row] = values[order[row]];
  }
  const auto solved = solve(dataset);
  RC_ASSERT(solved.ok());
  const char* keys[]{"pivot_yz_mm", "pivot_xz_mm", "pivot_xy_mm"};
  const auto* pivot = solved->find(keys[k]);
  RC_ASSERT(pivot != nullptr);
  const std::array<Eigen::Index, 2> plane = k == 0   ? std::array<Eigen::Index, 2>{1, 2}
                                            : k == 1 ? std::array<Eigen::Index, 2>{0, 2}
                                                     : std::array<Eigen::Index, 2>{0, 1};
  RC_ASSERT(std::abs(pivot->values[0] - table.pivot[plane[0]]) < 1e-8);
  RC_ASSERT(std::abs(pivot->values[1] - table.pivot[plane[1]]) < 1e-8);
}

// Everything unknown: pivot, lean of the axis, and where each angle of C has the ball.
Eigen::MatrixXd boundInSpace(const Tilting& table, const std::vector<double>& tilts, std::size_t cs, double along,
                             double sigma) {
  const auto observe = [&](const Eigen::VectorXd& p) {
    Eigen::VectorXd seen{static_cast<Eigen::Index>(3 * tilts.size() * cs)};
    Eigen::Index row = 0;
    for (const double tilt : tilts) {
      for (std::size_t c = 0; c < cs; ++c) {
        const Vector3d pivot{along, p[0], p[1]};
        const Vector3d direction = Vector3d{1.0, p[2] / 100.0, p[3] / 100.0}.normalized();  // steps like the others
        const Vector3d at = p.segment<3>(4 + 3 * static_cast<Eigen::Index>(c));
        seen.segment<3>(row) = pivot + AngleAxisd{tilt * kDegree, direction} * (at - pivot);
        row += 3;
      }
    }
    return seen;
  };
  Eigen::VectorXd truth{4 + 3 * static_cast<Eigen::Index>(cs)};
  truth.head(4) << table.pivot.y(), table.pivot.z(), 100.0 * table.skew.y(), 100.0 * table.skew.z();
  for (std::size_t c = 0; c < cs; ++c) {
    truth.segment<3>(4 + 3 * static_cast<Eigen::Index>(c)) = table.at(0.0, c == 0 ? 0.0 : 180.0);
  }
  return smallestCovariance(observe, truth, sigma);
}

TEST(TablePivot3d, ReachesTheBoundAndStatesItsUncertainty) {
  std::mt19937_64 random{11};
  Judgement pivot;
  Judgement lean;
  for (int trial = 0; trial < 500; ++trial) {
    Tilting table = randomTable(random, 5e-3);
    table.axis = Vector3d::UnitX();
    const double sigma = uniform(random, 3e-4, 3e-3);
    const std::vector<double> tilts = trial % 2 == 0 ? std::vector<double>{-90, 0} : std::vector<double>{-80, -35, 10};
    const std::vector<double> cs = trial % 2 == 0 ? std::vector<double>{0, 180} : std::vector<double>{0};
    Dataset dataset = tableDataset(table, tilts, cs, sigma, random);
    dataset.method = "table-pivot-3d";
    const auto solved = solve(dataset);
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    const double along = solved->find("along_mm")->value();
    const auto bound = boundInSpace(table, tilts, cs.size(), along, sigma);
    for (std::size_t k = 0; k < 2; ++k) {
      const auto at = static_cast<Eigen::Index>(k);
      const auto& found = *solved->find("pivot_yz_mm");
      const double truth = table.pivot[at + 1] + (along - table.pivot.x()) * table.skew[at + 1];
      pivot.add(found.values[k] - truth, found.sd[k], std::sqrt(bound(at, at)));
      const auto& leans = *solved->find("lean_yz_rad");
      lean.add(leans.values[k] - table.skew[at + 1], leans.sd[k], std::sqrt(bound(at + 2, at + 2)) / 100.0);
    }
  }
  expectHonest(pivot);
  expectHonest(lean);
}

RC_GTEST_PROP(TablePivot3d, IsExactWhateverTheAxisAndItsSense, ()) {
  std::mt19937_64 random{*rc::gen::arbitrary<std::uint64_t>()};
  const auto k = *rc::gen::inRange<Eigen::Index>(0, 3);
  Tilting table = randomTable(random, 0.0);
  table.axis = Vector3d::Zero();
  table.axis[k] = *rc::gen::element(1.0, -1.0);
  table.skew = Vector3d{uniform(random, -.01, .01), uniform(random, -.01, .01), uniform(random, -.01, .01)};
  table.skew[k] = 0.0;
  table.c_axis = table.pivot;
  table.ball = table.pivot + Vector3d{uniform(random, 50, 90), uniform(random, 50, 90), uniform(random, 90, 150)};
  Dataset dataset = tableDataset(table, {-60, -20, 35, 70}, {0, 75, 180}, 0.0, random);
  dataset.method = "table-pivot-3d";
  const auto solved = solve(dataset);
  RC_ASSERT(solved.ok());
  const char* keys[]{"yz", "xz", "xy"};
  const auto& pivot = solved->find("pivot_" + std::string{keys[k]} + "_mm")->values;
  const auto& lean = solved->find("lean_" + std::string{keys[k]} + "_rad")->values;
  const double along = solved->find("along_mm")->value() - table.pivot[k];
  Eigen::Index at = 0;
  for (std::size_t slot = 0; slot < 2; ++slot, ++at) {
    if (at == k) ++at;
    const double slope = table.skew[at] / table.axis[k];
    RC_ASSERT(std::abs(lean[slot] - slope) < 1e-9);
    RC_ASSERT(std::abs(pivot[slot] - (table.pivot[at] + along * slope)) < 1e-7);
  }
}

TEST(TablePivot3d, RefusesByName) {
  std::mt19937_64 random{12};
  const auto refusal = [&](const std::vector<double>& tilts, const std::vector<double>& cs) {
    Dataset dataset = tableDataset({}, tilts, cs, 0.001, random);
    dataset.method = "table-pivot-3d";
    return refusalOf(dataset);
  };
  EXPECT_EQ(refusal({-90, 0}, {0, 180}), "");
  EXPECT_EQ(refusal({-90, 0}, {0}), "too-few-readings") << "six coordinates for seven unknowns";
  EXPECT_EQ(refusal({-90, -45, 0}, {0}), "");
  EXPECT_EQ(refusal({-15, 0}, {0, 180}), "tilt-span-too-small");
  EXPECT_EQ(refusal({0, 360}, {0, 180}), "tilt-span-too-small") << "the same place";
  EXPECT_EQ(refusal({0, 359}, {0, 180}), "tilt-span-too-small") << "nearly the same place";
  // Points that lie close together along the axis show no lean at two tilts, but do at three.
  const Tilting close{.ball = {-2.9, -5.3, 255.6}};
  const auto refused = [&](const std::vector<double>& tilts) {
    Dataset dataset = tableDataset(close, tilts, {0, 180}, 0.001, random);
    dataset.method = "table-pivot-3d";
    return refusalOf(dataset);
  };
  EXPECT_EQ(refused({-60, 0}), "ill-conditioned");
  EXPECT_EQ(refused({-60, 0, 60}), "");
}

// (B31): the point of a tool that is moved along stays on the part.
TEST(TiltAxis, CarriesAPointAsTheTableDoes) {
  Tilting table;
  table.skew = {0, 3e-3, -2e-3};
  const TiltAxis axis{table.pivot, table.axis + table.skew};
  for (const double tilt : {-90.0, -20.0, 55.0}) {
    EXPECT_LT((axis.tilted(table.at(0.0, 30.0), tilt * kDegree) - table.at(tilt, 30.0)).norm(), 1e-9);
  }
}

TEST(TablePivot, RefusesByName) {
  std::mt19937_64 random{3};
  const auto refusal = [&](const Tilting& table, const std::vector<double>& tilts, const std::vector<double>& cs) {
    return refusalOf(tableDataset(table, tilts, cs, 0.001, random));
  };
  EXPECT_EQ(refusal({}, {-19.9, 0}, {0, 180}), "tilt-span-too-small");
  EXPECT_EQ(refusal({}, {-20.1, 0}, {0, 180}), "");
  EXPECT_EQ(refusal({}, {0, 0}, {0, 180}), "tilt-span-too-small");
  EXPECT_EQ(refusal({}, {0, 360}, {0, 180}), "tilt-span-too-small") << "the same place";
  EXPECT_EQ(refusal({}, {0, 359}, {0, 180}), "tilt-span-too-small") << "nearly the same place";
  EXPECT_EQ(refusal({}, {0, 350}, {0, 180}), "tilt-span-too-small") << "ten degrees apart";
  EXPECT_EQ(refusal({}, {0, 330}, {0, 180}), "");
  EXPECT_EQ(refusal({.ball = {0, -12.3, 45.6}}, {-90, 0}, {0}), "arm-too-short");
  // The C axis misses the pivot by more than the height of the ball.
  Tilting aside;
  aside.c_axis.y() = aside.pivot.y() + 300.0;
  aside.ball = {-3.0, aside.c_axis.y(), aside.pivot.z() + 210.0};
  EXPECT_EQ(refusal(aside, {-90, 0}, {0, 180}), "pivot-check-disagrees");
  EXPECT_EQ(refusal(aside, {-90, -30, 0}, {0, 180}), "");
  Dataset dataset = tableDataset({}, {-90, 0}, {0, 180}, 0.001, random);
  dataset.config["tilt_axis"] = std::vector<double>{0.6, 0.8, 0.0};
  EXPECT_EQ(refusalOf(dataset), "bad-axis");
  dataset.config.erase("tilt_axis");
  EXPECT_EQ(refusalOf(dataset), "missing-key");
}

}  // namespace
}  // namespace probebox::metrology
