// screw-reference: a cold screw at rest before a sensor with noise, a face that is not plane, and a resolution.
#include <array>
#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <vector>

#include "host-tests/metrology/cases.hpp"
#include "host-tests/support/runs.hpp"
#include "protocol/units/angle.hpp"

namespace probebox::metrology {
namespace {

using testing::Contains;
using testing::HasSubstr;

constexpr double kReading_um = 12.5;

struct Rest {
  double sigma_um{0.1};
  double drift_um_s{0};
  double seconds{60};
  double rate_hz{20};
  double angle_rad{0.7};
  std::array<double, 2> face_um{3, 0.8};  // once and twice a turn
  std::size_t sectors{24};
  double sd_sector_um{0};
  double step_um{0};         // of a reading
  double time_constant_s{};  // of the sensor
  double white_um{};         // of its converter
  double drift_limit_um_s{0.002};
};

double faceAt(const Rest& rest, double angle_rad) {
  return rest.face_um[0] * std::cos(angle_rad - 0.4) + rest.face_um[1] * std::cos(2 * angle_rad - 1.9);
}

double sectorMean(const Rest& rest, std::size_t sector) {
  constexpr int kSteps = 1000;
  double sum = 0;
  for (int k = 0; k < kSteps; ++k)
    sum += faceAt(rest, kTurn * (static_cast<double>(sector) + (k + 0.5) / kSteps) / static_cast<double>(rest.sectors));
  return sum / kSteps;
}

// The sensor averages over its time constant, and rounds.
Dataset caseOf(const Rest& rest, std::mt19937_64& random) {
  Dataset dataset{.method = "screw-reference",
                  .config = {{"axis", std::string{"X"}}, {"drift_limit_um_s", rest.drift_limit_um_s}},
                  .tables = {}};
  auto& readings = addTable(dataset, "at_rest", {"t_s", "phi_rad", "sensor_um"});
  const double keeps = rest.time_constant_s > 0 ? std::exp(-1 / (rest.rate_hz * rest.time_constant_s)) : 0;
  double noise = gauss(random, rest.sigma_um);
  const auto count = static_cast<int>(rest.seconds * rest.rate_hz);
  for (int k = 0; k < count; ++k) {
    noise = keeps * noise + std::sqrt(1 - keeps * keeps) * gauss(random, rest.sigma_um);
    const double t = k / rest.rate_hz;
    double y = kReading_um + faceAt(rest, rest.angle_rad) + rest.drift_um_s * (t - rest.seconds / 2) + noise;
    if (rest.white_um > 0) y += gauss(random, rest.white_um);
    if (rest.step_um > 0) y = rest.step_um * std::round(y / rest.step_um);
    readings.append({t, rest.angle_rad, y});
  }
  auto& table = addTable(dataset, "sector_table", {"sector", "T_um"});
  for (std::size_t i = 0; i < rest.sectors; ++i)
    table.append({static_cast<double>(i), sectorMean(rest, i) + gauss(random, rest.sd_sector_um)});
  if (rest.sd_sector_um > 0) dataset.config["sd_T_um"] = rest.sd_sector_um;
  return dataset;
}

Moments errorsOf(const Rest& like, std::uint64_t cases) {
  std::mt19937_64 random{3};
  Moments errors;
  for (std::uint64_t k = 0; k < cases; ++k) {
    Rest rest = like;
    rest.angle_rad = uniform(random, -20, 20);
    const auto solved = solve(caseOf(rest, random));
    EXPECT_TRUE(solved.ok()) << solved.error().reason;
    if (!solved.ok()) break;
    const auto& reference = *solved->find("reference_um");
    errors.add(reference.value() - kReading_um, reference.sd[0]);
  }
  return errors;
}

TEST(ScrewReference, IsAsUncertainAsItSays) {
  expectHonest(errorsOf({}, runs(300)));
  expectHonest(errorsOf({.sd_sector_um = 0.05}, runs(300)));
  expectHonest(errorsOf({.drift_um_s = 0.001, .sectors = 7}, runs(300)));
}

TEST(ScrewReference, TakesOutAFaceThatItsTableDescribes) {
  std::mt19937_64 random{1};
  for (const std::size_t sectors : {6U, 12U, 24U, 72U}) {
    const auto solved = solve(caseOf({.sigma_um = 1e-4, .sectors = sectors}, random));
    ASSERT_TRUE(solved.ok());
    EXPECT_NEAR(solved->find("reference_um")->value(), kReading_um, 1e-4) << sectors;
  }
}

TEST(ScrewReference, RefusesATableThatIsNotThatOfAWholeTurn) {
  std::mt19937_64 random{1};
  const auto refusal = [&](const std::function<void(Dataset&)>& damage, double sd_sector_um = 0) {
    auto dataset = caseOf({.sd_sector_um = sd_sector_um}, random);
    damage(dataset);
    return refusalOf(dataset);
  };
  const auto keepFirst = [](std::size_t count) {
    return [=](Dataset& d) { keepRows(tableNamed(d, "sector_table"), [=](std::size_t k) { return k < count; }); };
  };
  const auto table = [](Dataset & d) -> auto& {
    return columnNamed(d, "sector_table", "T_um");
  };
  const auto roundTo = [&](double step_um) {
    return [=](Dataset& d) {
      for (double& value : table(d)) value = step_um * std::round(value / step_um);
    };
  };
  EXPECT_EQ(refusal(keepFirst(24)), "");
  EXPECT_EQ(refusal(keepFirst(12)), "bad-sectors");
  EXPECT_EQ(refusal(keepFirst(1)), "bad-sectors");
  EXPECT_EQ(refusal([&](Dataset& d) { table(d)[12] *= 10; }), "bad-sectors");
  EXPECT_EQ(refusal([&](Dataset& d) {
              for (double& value : table(d)) value += 1;
            }),
            "bad-sectors");
  // As printed, and with noise.
  EXPECT_EQ(refusal(roundTo(0.1)), "");
  EXPECT_EQ(refusal(keepFirst(24), 0.3), "");
}

// A sensor of 0.15 s that is read 20 times a second: neighbours differ by 0.7 of their noise.
TEST(ScrewReference, KnowsThatReadingsOfASlowSensorAreNotIndependent) {
  const auto errors = errorsOf({.time_constant_s = 0.15}, 300);
  EXPECT_GT(errors.pull(), 0.75);
  EXPECT_LT(errors.pull(), 1.3) << "6 for independent readings";
  std::mt19937_64 random{2};
  EXPECT_THAT(solve(caseOf({.time_constant_s = 0.15}, random))->warnings, Contains(HasSubstr("correlated")));
}

// A converter of 0.2 um: neighbours are correlated by 0.16 to 0.37, readings a second apart almost as much.
TEST(ScrewReference, KnowsOfSlowNoiseBelowThatOfItsConverter) {
  for (const auto& [slow_um, time_constant_s] : {std::pair{0.16, 1.0}, std::pair{0.1, 0.3}, std::pair{0.1, 1.0}}) {
    if (!runsAreComplete() && slow_um < 0.16) continue;
    const auto errors = errorsOf(
        {.sigma_um = slow_um, .time_constant_s = time_constant_s, .white_um = 0.2, .drift_limit_um_s = 0.1}, 300);
    EXPECT_GT(errors.pull(), 0.7) << slow_um << " um, " << time_constant_s << " s";
    EXPECT_LT(errors.pull(), 1.6) << slow_um << " um, " << time_constant_s << " s";
  }
}

TEST(ScrewReference, SaysThatATableWithoutAnSdCountsAsExact) {
  std::mt19937_64 random{4};
  auto dataset = caseOf({}, random);
  EXPECT_THAT(solve(dataset)->warnings, Contains(HasSubstr("sd_T_um")));
  dataset.config["sd_T_um"] = 0.05;
  EXPECT_THAT(solve(dataset)->warnings, testing::Not(Contains(HasSubstr("sd_T_um"))));
}

// A mean of readings that are rounded to 1 um cannot know the third of a micrometre, however many there are, unless
// their noise is as large.
TEST(ScrewReference, DoesNotAverageItsResolutionOut) {
  const auto few_steps = errorsOf({.sigma_um = 0.25, .seconds = 120, .step_um = 1}, 100);
  EXPECT_GT(few_steps.pull(), 0.02) << "how little noise averages is not known from two steps";
  EXPECT_LT(few_steps.pull(), 1.0) << "45 for a mean without steps";
  const auto many_steps = errorsOf({.sigma_um = 0.6, .seconds = 120, .step_um = 1}, 100);
  EXPECT_GT(many_steps.pull(), 0.6);
  EXPECT_LT(many_steps.pull(), 1.4);
}

TEST(ScrewReference, RefusesAScrewThatIsNotAtRest) {
  std::mt19937_64 random{5};
  EXPECT_EQ(refusalOf(caseOf({.drift_um_s = 0.004}, random)), "not-steady");
  EXPECT_EQ(refusalOf(caseOf({.drift_um_s = -0.004}, random)), "not-steady");
  Dataset allowed = caseOf({.drift_um_s = 0.004}, random);
  allowed.config["drift_limit_um_s"] = 0.01;
  EXPECT_EQ(refusalOf(allowed), "");
  EXPECT_EQ(refusalOf(caseOf({.seconds = 6}, random)), "too-few-samples") << "such a drift would not show";
  EXPECT_EQ(refusalOf(caseOf({.seconds = 0.4}, random)), "too-few-samples");
}

TEST(ScrewReference, RefusesAFrozenSensorUnlessItsResolutionIsStated) {
  std::mt19937_64 random{6};
  Dataset frozen = caseOf({.sigma_um = 0}, random);
  EXPECT_EQ(refusalOf(frozen), "constant-sensor");
  frozen.config["resolution_um"] = 1.0;
  const auto solved = solve(frozen);
  ASSERT_TRUE(solved.ok()) << solved.error().reason;
  EXPECT_NEAR(solved->find("reference_um")->sd[0], 1 / std::sqrt(12.0), 1e-9);
}

TEST(ScrewReference, RefusesACopiedRow) {
  std::mt19937_64 random{8};
  Dataset dataset = caseOf({}, random);
  columnNamed(dataset, "at_rest", "t_s")[5] = columnNamed(dataset, "at_rest", "t_s")[4];
  EXPECT_EQ(refusalOf(dataset), "time-not-rising");
}

TEST(ScrewReference, NeedsTheFace) {
  std::mt19937_64 random{7};
  Dataset dataset = caseOf({}, random);
  dataset.tables.pop_back();
  EXPECT_EQ(refusalOf(dataset), "missing-key");
  dataset.config["sd_face_um"] = 2.2;
  const auto solved = solve(dataset);
  ASSERT_TRUE(solved.ok());
  EXPECT_NEAR(solved->find("reference_um")->sd[0], 2.2, 0.01);
  Dataset twice = caseOf({}, random);
  columnNamed(twice, "sector_table", "sector")[3] = 4;
  EXPECT_EQ(refusalOf(twice), "bad-sectors");
}

}  // namespace
}  // namespace probebox::metrology
