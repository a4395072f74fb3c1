// The periodic check against a machine in three dimensions: swivel, spindle and C each turn what hangs on them.
#include "firmware/metrology/centreline/periodic_check.hpp"

#include <algorithm>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <numbers>
#include <string>
#include <vector>

#include "host-tests/metrology/checked_machine.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Vector3d;
using testing::HasSubstr;

TEST(PeriodicCheck, FindsWhatTheMachineIsAndStatesItsUncertainty) {
  std::mt19937_64 random{1};
  Judgement means;
  Judgement x;
  Judgement z;
  for (int trial = 0; trial < 500; ++trial) {
    CheckedMachine machine;
    machine.centreline = {uniform(random, -.02, .02), uniform(random, -.02, .02), 0.0};
    machine.ball = {uniform(random, -3, 3), uniform(random, -3, 3), kExpectedZ};
    machine.x_offset_error = uniform(random, -.03, .03);
    machine.z_offset_error = uniform(random, -.03, .03);
    const double sigma = uniform(random, 3e-4, 3e-3);
    const auto solved = solve(checkOf(machine, sigma, random));
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    const auto add = [&](Judgement& into, const char* key, double truth, double bound) {
      into.add(solved->find(key)->value() - truth, solved->find(key)->sd[0], bound);
    };
    add(means, "Ycen_B90_mm", machine.centreline.y(), sigma / 2.0);
    add(means, "Xcen_B0_mm", machine.centreline.x(), sigma / 2.0);
    add(means, "Ycen_B0_mm", machine.centreline.y(), sigma / 2.0);
    add(means, "Ycen_B45_mm", machine.centreline.y(), sigma / 2.0);
    add(x, "x_offset_error_mm", machine.x_offset_error, sigma / std::numbers::sqrt2);
    add(z, "z_offset_error_mm", machine.z_offset_error, sigma);
    EXPECT_NEAR(solved->find("Zcen_B90_mm")->value(), kExpectedZ, 5.0 * sigma);
  }
  expectHonest(means);
  expectHonest(x, 0.88);
  expectHonest(z, 0.88);
}

// As a lathe of X and Z reads it, whose turret turns no stylus.
Dataset checkWithoutY(const CheckedMachine& machine, double sigma, std::mt19937_64& random) {
  Dataset dataset = checkOf(machine, sigma, random);
  dataset.config["machine_axes"] = std::string{"XZ"};
  auto centres =
      Table::withColumns("centres", std::array<std::string_view, 5>{"B_deg", "C_deg", "A_deg", "x_mm", "z_mm"});
  auto top = Table::withColumns("z_touch", std::array<std::string_view, 4>{"B_deg", "C_deg", "A_deg", "z_mm"});
  for (const double c : {0.0, 180.0, 180.0, 0.0}) {
    const auto at = machine.centred(0, c, 0);
    const double z = at.z() + machine.z_offset_error + gauss(random, sigma);
    centres.append({0, c, 0, at.x() + gauss(random, sigma), z});
    if (c == 0) top.append({0, c, 0, z + kRe});
  }
  dataset.tables = {std::move(centres), std::move(top)};
  return dataset;
}

// The stylus' offset from the turret's reference is in X, and cancels against the accepted one.
TEST(PeriodicCheck, TellsXAndTheHeightOfALatheWithoutY) {
  std::mt19937_64 random{11};
  Judgement x, z;
  for (int trial = 0; trial < 500; ++trial) {
    CheckedMachine machine;
    machine.centreline = {uniform(random, -.02, .02), uniform(random, -.02, .02), 0.0};
    machine.ball = {uniform(random, -3, 3), uniform(random, -3, 3), kExpectedZ};
    machine.z_offset_error = uniform(random, -.03, .03);
    const double sigma = uniform(random, 3e-4, 3e-3);
    const auto solved = solve(checkWithoutY(machine, sigma, random));
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    const auto add = [&](Judgement& into, const char* key, double truth, double bound) {
      into.add(solved->find(key)->value() - truth, solved->find(key)->sd[0], bound);
    };
    add(x, "Xcen_B0_mm", machine.centreline.x() - machine.stylus.x(), sigma / 2);
    add(z, "z_offset_error_mm", machine.z_offset_error, sigma / std::numbers::sqrt2);
    EXPECT_NEAR(solved->find("ball_offset_x_mm")->value(), machine.ball.x(), 5 * sigma);
    EXPECT_NEAR(solved->find("ball_centre_z_mm")->value(), kExpectedZ + machine.z_offset_error, 5 * sigma);
    EXPECT_EQ(solved->estimates.size(), 2U) << "nothing of Y";
  }
  expectHonest(x);
  expectHonest(z);
}

TEST(PeriodicCheck, ReadsALatheWithoutYAtALevelHeadAlone) {
  std::mt19937_64 random{12};
  auto swivelled = checkWithoutY(CheckedMachine{}, 1e-3, random);
  for (auto& table : swivelled.tables) table.columns[0].values[0] = 45;
  EXPECT_EQ(solve(swivelled).error().name, "bad-angle");
  auto half = checkWithoutY(CheckedMachine{}, 1e-3, random);
  for (double& c : half.tables[0].columns[1].values) c = 0;
  EXPECT_EQ(solve(half).error().name, "missing-orientation") << "the run-out of the ball stays in it";
}

TEST(PeriodicCheck, ListsItsValuesByAngleOfTheHead) {
  std::mt19937_64 random{3};
  const auto solved = solve(checkOf(CheckedMachine{}, 1e-3, random));
  ASSERT_TRUE(solved.ok()) << solved.error().reason;
  std::vector<std::string> keys;
  for (const auto& estimate : solved->estimates) keys.push_back(estimate.key);
  EXPECT_EQ(keys, (std::vector<std::string>{"Xcen_B0_mm", "Ycen_B0_mm", "z_offset_error_mm", "Ycen_B45_mm",
                                            "Ycen_B90_mm", "x_offset_error_mm"}));
  std::vector<std::string_view> described;
  for (const auto& result : kPeriodicCheck.results) described.push_back(result.key);
  EXPECT_TRUE(std::ranges::equal(keys, described));
}

// A stop of C moves the ball along one direction, which X does not see where the ball is at Y = 0.
TEST(PeriodicCheck, StatesWhatStopsOfCLeave) {
  std::mt19937_64 random{21};
  Judgement x, y, side;
  Moments anywhere;
  for (int trial = 0; trial < 800; ++trial) {
    CheckedMachine machine;
    const bool along_x = trial % 2 == 0;
    const double reach = uniform(random, 30, 90), angle = along_x ? 0 : uniform(random, 0, 2 * std::numbers::pi);
    machine.ball = {reach * std::cos(angle), reach * std::sin(angle), kExpectedZ};
    const double sigma = uniform(random, 3e-4, 3e-3), across = sigma * uniform(random, 0.3, 3);
    machine.sigma_c_rad = across / reach;
    const bool diameters = trial % 4 >= 2;
    Dataset dataset = checkOf(machine, sigma, random, diameters);
    dataset.config["sigma_C_rad"] = machine.sigma_c_rad;
    const auto solved = solve(dataset);
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    const auto add = [&](Judgement& into, const char* key, double truth, double bound) {
      const double error = solved->find(key)->value() - truth, sd = solved->find(key)->sd[0];
      if (along_x) into.add(error, sd, bound);
      anywhere.add(error, sd);
    };
    add(x, "Xcen_B0_mm", machine.centreline.x(), sigma / 2);
    for (const char* key : {"Ycen_B0_mm", "Ycen_B45_mm", "Ycen_B90_mm"})
      add(y, key, machine.centreline.y(), std::hypot(sigma, across) / 2);
    add(side, "x_offset_error_mm", (diameters ? 2 : 1) * machine.x_offset_error, sigma / std::numbers::sqrt2);
    // C comes to every pose anew: what one angle of the head says, another one does not.
    const auto& [names, values] = solved->covariance.value();
    const auto at = [&](const char* key) {
      return static_cast<std::size_t>(std::ranges::find(names, key) - names.begin());
    };
    EXPECT_NEAR(values.at(at("Ycen_B0_mm") * names.size() + at("Ycen_B90_mm")), 0.0, 1e-6 * sigma * sigma);
  }
  expectHonest(x);
  expectHonest(y);
  expectHonest(side);
  expectHonest(anywhere);
}

TEST(PeriodicCheck, SaysThatAStopOfCIsNotUsedWhereTheBallIsUnknown) {
  std::mt19937_64 random{22};
  Dataset dataset = checkOf({}, 0.001, random);
  dataset.config["sigma_C_rad"] = 1e-5;
  const auto& b = columnNamed(dataset, "centres", "B_deg");
  const std::vector<double> at = b;
  keepRows(tableNamed(dataset, "centres"), [&](std::size_t row) { return at[row] == 45.0; });
  std::erase_if(dataset.tables, [](const Table& table) { return table.name != "centres"; });
  const auto solved = solve(dataset);
  ASSERT_TRUE(solved.ok()) << solved.error().reason;
  EXPECT_THAT(solved->warnings, testing::Contains(testing::AllOf(HasSubstr("sigma_C_rad"), HasSubstr("not used"))));
}

TEST(PeriodicCheck, IsExactWithoutNoiseAndWithADropOut) {
  std::mt19937_64 random{2};
  const CheckedMachine machine;
  Dataset dataset = checkOf(machine, 0.0, random);
  keepRows(tableNamed(dataset, "centres"), [](std::size_t row) { return row != 1 && row != 6; });
  const auto solved = solve(dataset);
  ASSERT_TRUE(solved.ok()) << solved.error().reason;
  EXPECT_NEAR(solved->find("Ycen_B90_mm")->value(), machine.centreline.y(), 1e-9);
  EXPECT_NEAR(solved->find("Xcen_B0_mm")->value(), machine.centreline.x(), 1e-9);
  EXPECT_NEAR(solved->find("x_offset_error_mm")->value(), machine.x_offset_error, 1e-9);
}

TEST(PeriodicCheck, GivesTheWorkedExample) {
  std::mt19937_64 random{3};
  CheckedMachine machine;
  machine.ball.head<2>() << (13.7105 - 11.3085) / 2, -.00015;
  machine.stylus.y() = -.00005;
  Dataset dataset = checkOf(machine, 0.001, random);
  auto& y = columnNamed(dataset, "centres", "y_mm");
  const std::array<double, 4> printed{-.0052, -.0070, -.0066, -.0050};
  std::ranges::copy(printed, y.begin());
  columnNamed(dataset, "x_touch", "x_mm") = {13.7105, 11.3085};
  columnNamed(dataset, "z_touch", "z_mm") = {92.5125};
  const auto solved = solve(dataset);
  EXPECT_NEAR(solved->find("Ycen_B90_mm")->value(), -.00595, 1e-9);
  EXPECT_NEAR(solved->find("x_offset_error_mm")->value(), .0095, 1e-9);
  EXPECT_NEAR(solved->find("z_offset_error_mm")->value(), .0125, 1e-9);
}

TEST(PeriodicCheck, NeedsTouchesWhereItsCentresWereReadOnly) {
  std::mt19937_64 random{11};
  const CheckedMachine machine;
  Dataset dataset = checkOf(machine, 0.0, random);
  dataset.tables.erase(dataset.tables.begin() + 1);
  EXPECT_EQ(solve(dataset).error().name, "missing-table") << "centres at B = 90 ask for X";
  const auto swivels = columnNamed(dataset, "centres", "B_deg");
  keepRows(tableNamed(dataset, "centres"), [&](std::size_t row) { return swivels[row] == 0.0; });
  const auto solved = solve(dataset);
  ASSERT_TRUE(solved.ok()) << solved.error().reason;
  EXPECT_NEAR(solved->find("Xcen_B0_mm")->value(), machine.centreline.x(), 1e-9);
  EXPECT_NEAR(solved->find("z_offset_error_mm")->value(), machine.z_offset_error, 1e-9);
  EXPECT_EQ(solved->find("x_offset_error_mm"), nullptr);
}

TEST(PeriodicCheck, WeighsASingleTouchByASigmaOfItsOwn) {
  std::mt19937_64 random{12};
  Dataset dataset = checkOf({}, 1e-3, random);
  dataset.config["sigma_touch_mm"] = 3e-3;
  const auto solved = solve(dataset);
  ASSERT_TRUE(solved.ok()) << solved.error().reason;
  EXPECT_NEAR(solved->find("z_offset_error_mm")->sd[0], 3e-3, 1e-9);
  EXPECT_NEAR(solved->find("Xcen_B0_mm")->sd[0], 1e-3 / 2, 1e-9);
  dataset.config.erase("sigma_mm");
  EXPECT_EQ(solve(dataset).error().name, "missing-key");
}

TEST(PeriodicCheck, TakesTheDiameterOffWhereXCountsDiameters) {
  std::mt19937_64 random{4};
  const auto solved = solve(checkOf({}, 0.0, random, true));
  EXPECT_NEAR(solved->find("x_offset_error_mm")->value(), 2.0 * CheckedMachine{}.x_offset_error, 1e-9)
      << "in diameters too";
}

TEST(PeriodicCheck, TellsWhereTheBallIsAndWhetherItOrTheStylusHasMoved) {
  std::mt19937_64 random{7};
  Moments pull;
  for (int trial = 0; trial < 200; ++trial) {
    const CheckedMachine machine;
    const auto solved = solve(checkOf(machine, 0.001, random));
    const auto& centre = *solved->find("ball_centre_mm");
    const Vector3d truth = machine.centreline + machine.ball + Vector3d{0, 0, machine.z_offset_error};
    for (std::size_t k = 0; k < 3; ++k) pull.add(centre.values[k] - truth[static_cast<Eigen::Index>(k)], centre.sd[k]);
    const auto& stylus = *solved->find("stylus_offset_y_mm");
    pull.add(stylus.value() - machine.stylus.y(), stylus.sd[0]);
    const auto& ball = *solved->find("ball_offset_x_mm");
    pull.add(ball.value() - machine.ball.x(), ball.sd[0]);
  }
  expectHonest(pull);
  Dataset dataset = checkOf({}, 0.001, random);
  dataset.config["accepted_stylus_offset_x_mm"] = 0.025;
  dataset.config["limit_stylus_offset_x_mm"] = 0.005;
  EXPECT_EQ(solve(dataset)->find("verdict")->value(), 0.0);
  dataset.config["accepted_stylus_offset_x_mm"] = 0.045;
  EXPECT_EQ(solve(dataset)->find("verdict")->value(), 2.0);
  EXPECT_THAT(solve(dataset)->warnings, testing::Contains(HasSubstr("full calibration")));
}

TEST(PeriodicCheck, ComparesItsTouchesWithTheCentres) {
  std::mt19937_64 random{17};
  for (const bool diameters : {false, true}) {
    const Dataset good = checkOf(CheckedMachine{}, 1e-3, random, diameters);
    EXPECT_EQ(refusalOf(good), "");
    Dataset x = good;
    columnNamed(x, "x_touch", "x_mm")[0] += diameters ? 0.2 : 0.1;
    EXPECT_EQ(refusalOf(x), "readings-contradict");
    Dataset z = good;
    columnNamed(z, "z_touch", "z_mm")[0] += 0.1;
    EXPECT_THAT(solve(good)->warnings, testing::Not(testing::Contains(HasSubstr("by table z_touch"))));
    EXPECT_THAT(solve(z)->warnings, testing::Contains(HasSubstr("by table z_touch")));
    for (Dataset* each : {&x, &z}) each->config["sigma_mm"] = 0.1;
    EXPECT_EQ(refusalOf(x), "") << "within the noise";
    EXPECT_THAT(solve(z)->warnings, testing::Not(testing::Contains(HasSubstr("by table z_touch"))));
  }
}

TEST(PeriodicCheck, ComparesRunOutsAlongTheAxisOfTheHead) {
  std::mt19937_64 random{18};
  const Dataset good = checkOf(CheckedMachine{}, 1e-3, random);
  for (const std::size_t first : {0U, 4U, 8U}) {
    for (const std::size_t beside : {1U, 2U}) {  // the other side of the stylus, or of the ball
      Dataset copied = good;
      auto& y = columnNamed(copied, "centres", "y_mm");
      y[first] = y[first + beside] + 1e-4;
      ASSERT_FALSE(solve(copied)) << first << ", " << beside;
      EXPECT_EQ(solve(copied).error().name, "readings-contradict");
      EXPECT_THAT(solve(copied).error().reason, HasSubstr("in Y"));
      copied.config["sigma_mm"] = 1.0;
      EXPECT_EQ(refusalOf(copied), "") << "within the noise";
    }
  }
  Dataset pulled = good;
  columnNamed(pulled, "centres", "y_mm")[0] += 0.03;  // moves a run-out by a quarter of it
  EXPECT_EQ(refusalOf(pulled), "") << "below 10 um";
}

TEST(PeriodicCheck, RefusesAStylusFarOffItsSpindle) {
  std::mt19937_64 random{19};
  CheckedMachine machine;
  machine.stylus = {8, -5, 0};
  EXPECT_EQ(refusalOf(checkOf(machine, 1e-3, random)), "");
  machine.stylus = {8, -7, 0};
  EXPECT_EQ(refusalOf(checkOf(machine, 1e-3, random)), "implausible");
}

TEST(PeriodicCheck, RefusesByName) {
  std::mt19937_64 random{6};
  const auto refusal = [&](const std::function<void(Dataset&)>& damage) {
    Dataset dataset = checkOf({}, 0.001, random);
    damage(dataset);
    return refusalOf(dataset);
  };
  EXPECT_EQ(refusal([](Dataset&) {}), "");
  EXPECT_EQ(refusal([](Dataset& d) { columnNamed(d, "centres", "C_deg")[0] = 90.0; }), "bad-angle");
  EXPECT_EQ(refusal([](Dataset& d) { columnNamed(d, "centres", "B_deg")[0] = 30.0; }), "bad-angle");
  EXPECT_EQ(refusal([](Dataset& d) {
              const auto a = columnNamed(d, "centres", "A_deg");
              keepRows(tableNamed(d, "centres"), [&](std::size_t row) { return a[row] == 0.0; });
            }),
            "missing-orientation");
  EXPECT_EQ(refusal([](Dataset& d) { keepRows(tableNamed(d, "x_touch"), [](std::size_t row) { return row == 0; }); }),
            "missing-orientation");
  EXPECT_EQ(refusal([](Dataset& d) { d.tables.pop_back(); }), "missing-table");
  EXPECT_EQ(refusal([](Dataset& d) { d.config.erase("effective_ball_radius_mm"); }), "missing-key");
  EXPECT_EQ(refusal([](Dataset& d) { d.config.erase("x_is_radius"); }), "missing-key");
  EXPECT_EQ(refusal([](Dataset& d) { columnNamed(d, "z_touch", "z_mm")[0] = std::nan(""); }), "not-finite");
  Dataset partial = checkOf({}, 0.001, random);
  keepRows(tableNamed(partial, "centres"), [](std::size_t row) { return row < 8; });
  EXPECT_EQ(solve(partial)->find("Ycen_B45_mm"), nullptr);
  EXPECT_THAT(solve(partial)->unobservable,
              testing::Contains(testing::AllOf(HasSubstr("Ycen_B45_mm"), HasSubstr("no reading"))));
  EXPECT_THAT(solve(partial)->warnings, testing::Not(testing::Contains(HasSubstr("Ycen_B45_mm"))));
  partial.config["accepted_Ycen_B45_mm"] = 1.0;
  EXPECT_THAT(solve(partial)->warnings, testing::Contains(testing::AllOf(HasSubstr("Ycen_B45_mm"), HasSubstr("once"))));
}

}  // namespace
}  // namespace probebox::metrology
