#include <algorithm>
#include <cmath>
#include <gmock/gmock.h>
#include <numbers>
#include <rapidcheck/gtest.h>

#include "firmware/metrology/dataset/estimate.hpp"
#include "firmware/metrology/uncertainty/worst_determined.hpp"
#include "host-tests/metrology/cases.hpp"
#include "host-tests/metrology/touch_simulation.hpp"

// Design figures, what cannot be observed, type B inputs and expanded uncertainty: the same for every method.
namespace probebox::metrology {
namespace {

using testing::Contains;
using testing::HasSubstr;

Result solved(const Dataset& dataset) {
  auto answer = solve(dataset);
  EXPECT_TRUE(answer.ok()) << answer.error().name << ": " << answer.error().reason;
  return std::move(answer).value();
}

// Points of a sphere of this radius, with noise; the unit of length is `unit` mm.
Dataset sphere(std::uint64_t seed, std::size_t count, double sigma, double unit = 1.0) {
  std::mt19937_64 random{seed};
  Dataset dataset{.method = "sphere-fit", .config = {{"sigma_mm", sigma * unit}}, .tables = {}};
  stateExactMachine(dataset);
  Table& points = addTable(dataset, "points", {"x_mm", "y_mm", "z_mm"});
  for (std::size_t k = 0; k < count; ++k) {
    const double z = uniform(random, -0.3, 1.0);
    const double angle = uniform(random, 0.0, 6.28);
    const double r = 12.5 + gauss(random, sigma);
    const double flat = std::sqrt(1.0 - z * z);
    points.append(
        {(10.0 + r * flat * std::cos(angle)) * unit, (r * flat * std::sin(angle) - 3.0) * unit, (5.0 + r * z) * unit});
  }
  return dataset;
}

Dataset centreline(std::uint64_t seed, std::size_t count, double sigma) {
  std::mt19937_64 random{seed};
  Dataset dataset{.method = "centreline", .config = {{"sigma_mm", sigma}}, .tables = {}};
  stateExactMachine(dataset);
  Table& readings = addTable(dataset, "readings", {"C_rad", "x_mm", "y_mm"});
  for (std::size_t k = 0; k < count; ++k) {
    const double angle = 2.0 * std::numbers::pi * static_cast<double>(k) / static_cast<double>(count);
    readings.append({angle, 330.0 + 20.0 * std::cos(angle) + gauss(random, sigma),
                     200.0 + 20.0 * std::sin(angle) + gauss(random, sigma)});
  }
  return dataset;
}

// Reverses the order of the rows.
void reverse(Dataset& dataset, std::string_view table) {
  for (auto& column : tableNamed(dataset, table).columns) std::ranges::reverse(column.values);
}

double partB(const Result& result, std::size_t k) {
  double squares = 0.0;
  for (const auto& line : result.budget) squares += line.type_b ? line.sd[k] * line.sd[k] : 0.0;
  return std::sqrt(squares);
}

Dataset touches(simulation::Scene scene, std::vector<double> speeds_mm_s) {
  std::mt19937_64 random{3};
  scene.speeds_mm_s = std::move(speeds_mm_s);
  return simulation::measure(scene, random);
}

Dataset fiveTouches(double speed) {
  return touches(simulation::knownSphere(), {speed});
}

// A cause of a pre-travel's uncertainty that changes no table of a case leaves a gap in their numbers.
TEST(PreTravelOfTheProbe, IsInTheBudgetByEveryCause) {
  Dataset dataset = centreline(5, 8, 1e-3);
  for (const char* cause : {"readings_by_pre_travel_2", "readings_by_pre_travel_4"}) {
    Table& shift = addTable(dataset, cause, {"x_mm"});
    for (int row = 0; row < 8; ++row) shift.append({3e-3});
  }
  const Result result = solved(dataset);
  EXPECT_NEAR(partB(result, 0), std::hypot(3e-3, 3e-3), 1e-6);
  EXPECT_NEAR(partB(result, 1), 0, 1e-6);
}

RC_GTEST_PROP(Design, TimesSigmaIsTheSdOfAFit, ()) {
  const auto seed = *rc::gen::arbitrary<std::uint64_t>();
  const double sigma = std::pow(10.0, *rc::gen::inRange(-6, -1));
  for (const auto& dataset : {sphere(seed, 12, sigma), centreline(seed, 7, sigma)}) {
    const Result result = solved(dataset);
    for (const auto& estimate : result.estimates) {
      RC_ASSERT(estimate.design.size() == estimate.values.size());
      for (std::size_t k = 0; k < estimate.sd.size(); ++k) {
        // Where the readings agree by chance worse than promised, the sd is wider than the design says.
        const double widened = std::max(1.0, estimate.sd[k] / (estimate.design[k] * sigma));
        RC_ASSERT(std::abs(estimate.sd[k] - estimate.design[k] * sigma * widened) <= 1e-9 * estimate.sd[k]);
        RC_ASSERT(widened < 1.0 + 1e-9 || !result.warnings.empty());
      }
    }
  }
}

TEST(Design, KnowsNoNoise) {
  const Result quiet = solved(centreline(1, 8, 1e-6));
  const Result loud = solved(centreline(2, 8, 1e-2));
  for (std::size_t k = 0; k < 2; ++k) EXPECT_NEAR(quiet.estimates[0].design[k], loud.estimates[0].design[k], 1e-9);
  // (B7): sigma / sqrt(N) when the angles are spread evenly.
  EXPECT_NEAR(quiet.estimates[0].design[0], 1.0 / std::sqrt(8.0), 1e-9);
  EXPECT_NEAR(quiet.designFigure().value(), 1.0 / std::sqrt(8.0), 1e-9);
}

// Ten ways, in and out on five sides: 1/(sqrt(10) S).
TEST(Design, OfFiveTouchesIsTheBoundOfTheSpeed) {
  for (const double speed : {10.0, 25.0}) {
    const Result result = solved(fiveTouches(speed));
    ASSERT_EQ(result.estimates[0].key, "tau_s");
    EXPECT_NEAR(result.estimates[0].design.at(0), 1.0 / (std::sqrt(10.0) * speed), 0.01 / speed);
    EXPECT_THAT(result.design_per, HasSubstr("one way of one touch"));
  }
}

TEST(Design, OfAnAxisIsThatOfFourWays) {
  auto scene = simulation::perAxis();
  scene.normals = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  const Result result = solved(touches(scene, {25.0}));
  for (const double figure : result.estimates[0].design) {
    EXPECT_NEAR(figure, 1.0 / (2.0 * 25.0), 0.01 / 25.0);
  }
}

// Lengths and angles are not averaged.
TEST(Design, OfSixErrorsIsThatOfTheTranslations) {
  Result result;
  result.estimates.push_back(Estimate::matrix("six_errors", 6, std::vector<double>(12), {}));
  result.estimates[0].design = {1, 2, 3, 900, 900, 900, 3, 2, 1, 900, 900, 900};
  EXPECT_NEAR(result.designFigure().value(), std::sqrt(28.0 / 6.0), 1e-12);
  const auto parts = partsOf(result.estimates[0]);
  ASSERT_EQ(parts.size(), 2U);
  EXPECT_EQ(parts[0].key, "translations_mm");
  EXPECT_EQ(parts[1].key, "rotations_rad");
  EXPECT_EQ(parts[1].at, (std::vector<std::size_t>{3, 4, 5, 9, 10, 11}));
  EXPECT_EQ(partsOf(Estimate::vector("centre_mm", {1, 2, 3}, {})).size(), 1U);
}

RC_GTEST_PROP(Uncertainty, DoesNotDependOnTheUnitOfLength, ()) {
  const auto seed = *rc::gen::arbitrary<std::uint64_t>();
  Dataset in_mm = sphere(seed, 10, 1e-3);
  Dataset in_um = sphere(seed, 10, 1e-3, 1000.0);
  in_mm.config["radius_mm"] = 12.5;
  in_mm.config["sd_radius_mm"] = 2e-3;
  in_um.config["radius_mm"] = 12500.0;
  in_um.config["sd_radius_mm"] = 2.0;
  const auto a = solve(in_mm);
  const auto b = solve(in_um);
  RC_PRE(a.ok() && b.ok());
  for (std::size_t k = 0; k < 3; ++k) {
    RC_ASSERT(std::abs(1000.0 * a->estimates[0].uncertainty[k] - b->estimates[0].uncertainty[k]) <
              1e-4 * b->estimates[0].uncertainty[k]);
    RC_ASSERT(std::abs(a->estimates[0].design[k] - b->estimates[0].design[k]) < 1e-6 * a->estimates[0].design[k]);
  }
}

RC_GTEST_PROP(Uncertainty, DoesNotDependOnTheOrderOfTheReadings, ()) {
  Dataset dataset = sphere(*rc::gen::arbitrary<std::uint64_t>(), 10, 1e-3);
  dataset.config["radius_mm"] = 12.5;
  dataset.config["sd_radius_mm"] = 2e-3;
  const auto forward = solve(dataset);
  reverse(dataset, "points");
  auto backward = solve(dataset);
  RC_PRE(forward.ok() && backward.ok());
  for (std::size_t k = 0; k < 3; ++k) {
    RC_ASSERT(std::abs(forward->estimates[0].uncertainty[k] - backward->estimates[0].uncertainty[k]) < 1e-9);
    RC_ASSERT(std::abs(forward->estimates[0].design[k] - backward->estimates[0].design[k]) < 1e-9);
  }
  std::ranges::reverse(backward->residuals.values);
  for (std::size_t k = 0; k < forward->residuals.values.size(); ++k) {
    RC_ASSERT(std::abs(forward->residuals.values[k] - backward->residuals.values[k]) < 1e-9);
  }
}

RC_GTEST_PROP(Uncertainty, CombinesBothTypesAsRootSumOfSquares, ()) {
  Dataset dataset = sphere(*rc::gen::arbitrary<std::uint64_t>(), 10, 1e-3);
  dataset.config["radius_mm"] = 12.5;
  const auto plain = solve(dataset);
  dataset.config["sd_radius_mm"] = 2e-3;
  dataset.config["temperature_c"] = 26.0;
  dataset.config["expansion_per_k"] = 11.5e-6;
  dataset.config["sd_temperature_k"] = 0.5;
  const auto whole = solve(dataset);
  RC_PRE(plain.ok() && whole.ok());
  RC_ASSERT(whole->budget.size() == 3U);
  for (std::size_t k = 0; k < 3; ++k) {
    const auto& estimate = whole->estimates[0];
    RC_ASSERT(plain->estimates[0].uncertainty[k] == plain->estimates[0].sd[k]);
    RC_ASSERT(std::abs(estimate.uncertainty[k] - std::hypot(estimate.sd[k], partB(*whole, k))) < 1e-12);
    RC_ASSERT(estimate.uncertainty[k] > estimate.sd[k]);
  }
}

// (A7b): at one speed l / (2 S); the size says nothing of the delay, and a piece that is warm is larger than its
// certificate says.
TEST(TypeB, LostMotionGoesIntoTheDelayAndSizesDoNot) {
  Dataset dataset = fiveTouches(25.0);
  const double size = std::get<double>(dataset.config.at("effective_diameter_mm"));
  const Result cold = solved(dataset);
  dataset.config["sd_effective_diameter_mm"] = 0.5e-3;
  dataset.config["temperature_c"] = 24.0;
  dataset.config["expansion_per_k"] = 11.5e-6;
  dataset.config["sd_temperature_k"] = 0.5;
  dataset.config["lost_motion_mm"] = 0.0;
  dataset.config["sd_lost_motion_mm"] = 0.002;
  const Result result = solved(dataset);
  EXPECT_NEAR(result.estimates[0].value(), cold.estimates[0].value(), 1e-9);
  EXPECT_NEAR(result.find("static_error_mm")->value(), cold.find("static_error_mm")->value() - size * 11.5e-6 * 4.0,
              1e-7);
  const auto contribution = [&](std::string_view name) {
    const auto line = std::ranges::find(result.budget, name, &Contribution::name);
    EXPECT_NE(line, result.budget.end()) << name;
    return line == result.budget.end() ? 0.0 : line->sd[0];
  };
  EXPECT_NEAR(contribution("readings"), result.estimates[0].sd[0], 1e-15);
  EXPECT_NEAR(contribution("sd_effective_diameter_mm"), 0.0, 1e-9);
  EXPECT_NEAR(contribution("sd_temperature_k"), 0.0, 1e-9);
  EXPECT_NEAR(contribution("sd_lost_motion_mm"), 0.002 / 50.0, 1e-8);
  EXPECT_GT(result.estimates[0].uncertainty[0], 0.002 / 50.0);
}

TEST(TypeB, ChangesNeitherValuesNorSd) {
  Dataset dataset = fiveTouches(25.0);
  const Result without = solved(dataset);
  dataset.config["sd_effective_diameter_mm"] = 1e-3;
  dataset.config["probe"] = std::string{"OMP400-7"};
  const Result with = solved(dataset);
  ASSERT_EQ(without.estimates.size(), with.estimates.size());
  for (std::size_t k = 0; k < with.estimates.size(); ++k) {
    EXPECT_EQ(without.estimates[k].values, with.estimates[k].values);
    EXPECT_EQ(without.estimates[k].sd, with.estimates[k].sd);
    EXPECT_EQ(without.estimates[k].uncertainty, without.estimates[k].sd);
  }
  EXPECT_EQ(without.warnings, with.warnings) << "neither key is unknown";
  ASSERT_EQ(with.conditions.size(), 1U);
  EXPECT_EQ(with.conditions[0].value, "OMP400-7");
}

// The lengths of a tool assembly are in its sd since ever, and stay there once.
TEST(TypeB, OfAToolIsInItsSdAlready) {
  Dataset dataset{
      .method = "tool-assembly",
      .config = {{"L1_mm", 85.0}, {"L2_mm", 142.5}, {"sigma_mm", 2e-3}, {"sd_L1_mm", 3e-3}, {"sd_L2_mm", 4e-3}},
      .tables = {}};
  stateExactMachine(dataset);
  Table& readings = addTable(dataset, "readings", {"workpiece_variant", "rep", "W0_x_mm", "W0_y_mm", "L0_z_mm"});
  for (const double rep : {1.0, 2.0, 3.0, 4.0}) readings.append({0.0, rep, 0.001, -0.002, 145.25});
  const Result result = solved(dataset);
  const Estimate& length = *result.find("assembled_length_mm");
  EXPECT_NEAR(length.sd[0], std::hypot(1e-3, 3e-3), 1e-9);
  EXPECT_NEAR(length.uncertainty[0], length.sd[0], 1e-9);
  ASSERT_EQ(result.budget.size(), 3U);
  EXPECT_NEAR(result.budget[0].sd[0], 1e-3, 1e-9);
  EXPECT_NEAR(result.budget[1].sd[0], 3e-3, 1e-9);
  EXPECT_NEAR(result.budget[2].sd[0], 0.0, 1e-12) << "L2 is not in the assembled length";
  EXPECT_NEAR(result.budget[2].sd[3], 4e-3, 1e-9) << "but in its compensation";
}

TEST(TypeB, NonsenseIsRefused) {
  const auto refused = [](const char* key, Value value) {
    Dataset dataset = fiveTouches(25.0);
    dataset.config[key] = std::move(value);
    return refusalOf(dataset);
  };
  EXPECT_EQ(refused("sd_effective_diameter_mm", -1e-3), "bad-config");
  EXPECT_EQ(refused("sd_effective_diameter_mm", 0.0), "bad-config");
  EXPECT_EQ(refused("sd_effective_diameter_mm", 40.0), "bad-config") << "as large as the sphere";
  EXPECT_EQ(refused("sd_effective_diameter_mm", std::string{"0.5 um"}), "bad-config");
  EXPECT_EQ(refused("sd_effective_diameter_mm", std::nan("")), "bad-config");
  EXPECT_EQ(refused("temperature_c", 297.0), "bad-config") << "kelvin";
  EXPECT_EQ(refused("expansion_per_k", 11.5), "implausible") << "in 1e-6 per kelvin";
  EXPECT_EQ(refused("expansion_per_k", 11.5e-6), "missing-key") << "at which temperature?";
  EXPECT_EQ(refused("sd_temperature_k", 0.5), "missing-key");
  Dataset sizeless = centreline(1, 5, 1e-3);
  sizeless.config["sd_gap_mm"] = 1e-3;
  EXPECT_THAT(solved(sizeless).warnings, Contains(HasSubstr("sd_gap_mm"))) << "of no use here, and said";
  Dataset unknown_radius = sphere(1, 10, 1e-3);
  unknown_radius.config["sd_radius_mm"] = 1e-3;
  EXPECT_EQ(refusalOf(unknown_radius), "missing-key");
}

TEST(Unobservable, IsSaidByEveryMethodThatIsSolved) {
  EXPECT_THAT(solved(centreline(1, 5, 1e-3)).unobservable, Contains(HasSubstr("XOC")));
  const auto said = solved(fiveTouches(25.0)).unobservable;
  EXPECT_THAT(said, Contains(HasSubstr("tau_machine - tau_probe")));
  EXPECT_THAT(said, Contains(testing::AllOf(HasSubstr("1 um"), HasSubstr("20 us"))));
}

TEST(Unobservable, NamesWhatSpindleAndCTurnedTogetherHide) {
  Dataset dataset{.method = "spindle-offset-four", .config = {{"sigma_mm", 1e-3}}, .tables = {}};
  Table& readings = addTable(dataset, "readings", {"A_rad", "C_rad", "x_mm", "y_mm"});
  readings.append({0.0, 0.0, 1.2, 0.1});
  readings.append({std::numbers::pi, std::numbers::pi, 0.9, -0.2});
  EXPECT_THAT(solved(dataset).unobservable, Contains(HasSubstr("minus")));
}

// Touches at speeds that hardly differ tell delay and size apart badly, and the answer says in which combination.
TEST(WorstDetermined, IsTheCombinationThatTheReadingsDetermineWorst) {
  // By the ways out alone.
  Dataset dataset = touches({}, {30.0, 40.0});
  dataset.method = "delay-feature";
  dataset.config = {{"shape", std::string{"sphere"}}};
  stateExactMachine(dataset);
  const Result result = solved(dataset);
  ASSERT_TRUE(result.weakest.has_value());
  EXPECT_EQ(result.weakest->components, (std::vector<std::string>{"tau_s", "size_mm"}));
  const auto& values = result.covariance->values;
  const double correlation = values[1] / std::sqrt(values[0] * values[3]);
  EXPECT_NEAR(result.weakest->sd, std::sqrt(1.0 + std::abs(correlation)), 1e-9);
  EXPECT_FALSE(solved(centreline(1, 8, 1e-3)).weakest.has_value());
}

TEST(WorstDetermined, IsNotToldBesideAComponentThatIsExact) {
  EXPECT_FALSE(worstDeterminedOf({{"a", "b", "c"}, {4.0, 1.9, 0.0, 1.9, 1.0, 0.0, 0.0, 0.0, 0.0}}).has_value());
  EXPECT_NEAR(worstDeterminedOf({{"a", "b"}, {4.0, 1.9, 1.9, 1.0}}).value().sd, std::sqrt(1.95), 1e-9);
}

TEST(Residuals, StandAtTheirReadings) {
  const double sigma = 1e-3;
  Dataset dataset = centreline(4, 9, sigma);
  const Result result = solved(dataset);
  ASSERT_EQ(result.residuals.values.size(), 18U);
  EXPECT_EQ(result.residuals.against, "C_rad");
  EXPECT_EQ(result.residuals.unit, "mm");
  EXPECT_EQ(result.residuals.names[3], "readings 2, y_mm");
  double squares = 0.0;
  for (const double value : result.residuals.values) squares += value * value;
  EXPECT_NEAR(std::sqrt(squares / 18.0), result.rms, 1e-12);
  // Read minus fitted: a reading that is moved up stands up.
  columnNamed(dataset, "readings", "y_mm")[1] += 3.0 * sigma;
  EXPECT_GT(solved(dataset).residuals.values[3], sigma + result.residuals.values[3]);
  // One that does not belong to the others is left out, and they keep the numbers that they have in the file.
  columnNamed(dataset, "readings", "y_mm")[1] += 20.0 * sigma;
  const Result without = solved(dataset);
  ASSERT_EQ(without.residuals.values.size(), 16U);
  EXPECT_EQ(without.dropped.at(0).name, "readings 2");
  EXPECT_EQ(without.residuals.names[1], "readings 1, y_mm");
  EXPECT_EQ(without.residuals.names[2], "readings 3, x_mm");
  EXPECT_EQ(without.residuals.names[15], "readings 9, y_mm");
}

}  // namespace
}  // namespace probebox::metrology
