// The periodic check against a machine in three dimensions: swivel, spindle and C each turn what hangs on them.
#include "firmware/metrology/centreline/periodic_check.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <map>
#include <numbers>
#include <string>
#include <vector>

#include "host-tests/metrology/cases.hpp"
#include "protocol/units/angle.hpp"

namespace probebox::metrology {
namespace {

using Eigen::AngleAxisd;
using Eigen::Vector3d;
using testing::AllOf;
using testing::HasSubstr;

constexpr double kRe = 12.5;
constexpr double kExpectedZ = 80.0;

struct CheckedMachine {
  Vector3d centreline{0.02, -0.006, 0.0};  // C axis, parallel to Z
  Vector3d ball{1.9, 1.4, kExpectedZ};     // on the chuck at C = 0, from the C axis
  Vector3d stylus{0.025, -0.026, 0.0};     // from the spindle axis, at A = 0
  double x_offset_error{0.0095};           // of the tool table at B = 90
  double z_offset_error{0.0125};           // and at B = 0
  double sigma_c_rad{0};                   // of every stop of C

  // What the control shows when the stylus is centred on the ball: its tool table knows all but the stylus' run-out.
  Vector3d centred(double b, double c, double a) const {
    const AngleAxisd chuck{c * kDegree, Vector3d::UnitZ()};
    const AngleAxisd swivel{b * kDegree, Vector3d::UnitY()};
    const AngleAxisd spindle{a * kDegree, Vector3d::UnitZ()};
    return centreline + chuck * ball - swivel * (spindle * stylus);
  }
};

Dataset check(const CheckedMachine& machine, double sigma, std::mt19937_64& random, bool diameters = false) {
  Dataset dataset{.method = "periodic-check",
                  .config = {{"effective_ball_radius_mm", kRe},
                             {"expected_ball_centre_z_mm", kExpectedZ},
                             {"x_is_radius", !diameters},
                             {"sigma_mm", sigma}},
                  .tables = {}};
  Table centres =
      Table::withColumns("centres", std::array<std::string_view, 6>{"B_deg", "C_deg", "A_deg", "x_mm", "y_mm", "z_mm"});
  std::map<std::array<double, 3>, double> off;  // of C in every pose, degrees
  for (const double b : {90.0, 0.0, 45.0}) {
    for (const double c : {0.0, 180.0}) {
      for (const double a : {0.0, 180.0}) {
        if (machine.sigma_c_rad > 0) off[{b, c, a}] = gauss(random, machine.sigma_c_rad) / kDegree;
        const Vector3d at = machine.centred(b, c + off[{b, c, a}], a);
        centres.append(
            {b, c, a, at.x() + gauss(random, sigma), at.y() + gauss(random, sigma), at.z() + gauss(random, sigma)});
      }
    }
  }
  Table x = Table::withColumns("x_touch", std::array<std::string_view, 4>{"B_deg", "C_deg", "A_deg", "x_mm"});
  for (const double c : {0.0, 180.0}) {
    // The tip lies along X here; from +X it touches the ball, Re short of it. X counts from the C axis.
    const double turned = c + off[{90.0, c, 180.0 - c}];
    const Vector3d chuck = AngleAxisd{turned * kDegree, Vector3d::UnitZ()} * machine.ball;
    const double radius = chuck.x() + kRe + machine.x_offset_error;
    x.append({90.0, c, 180.0 - c, (diameters ? 2.0 : 1.0) * radius + gauss(random, sigma)});
  }
  Table z = Table::withColumns("z_touch", std::array<std::string_view, 4>{"B_deg", "C_deg", "A_deg", "z_mm"});
  z.append({0.0, 180.0, 0.0, machine.ball.z() + kRe + machine.z_offset_error + gauss(random, sigma)});
  dataset.tables = {std::move(centres), std::move(x), std::move(z)};
  return dataset;
}

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
    const auto solved = solve(check(machine, sigma, random));
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

TEST(PeriodicCheck, ListsItsValuesByAngleOfTheHead) {
  std::mt19937_64 random{3};
  const auto solved = solve(check(CheckedMachine{}, 1e-3, random));
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
    Dataset dataset = check(machine, sigma, random, diameters);
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
  Dataset dataset = check({}, 0.001, random);
  dataset.config["sigma_C_rad"] = 1e-5;
  const auto& b = columnNamed(dataset, "centres", "B_deg");
  const std::vector<double> at = b;
  keepRows(tableNamed(dataset, "centres"), [&](std::size_t row) { return at[row] == 45.0; });
  std::erase_if(dataset.tables, [](const Table& table) { return table.name != "centres"; });
  const auto solved = solve(dataset);
  ASSERT_TRUE(solved.ok()) << solved.error().reason;
  EXPECT_THAT(solved->warnings, testing::Contains(HasSubstr("sigma_C_rad is not used")));
}

TEST(PeriodicCheck, IsExactWithoutNoiseAndWithADropOut) {
  std::mt19937_64 random{2};
  const CheckedMachine machine;
  Dataset dataset = check(machine, 0.0, random);
  keepRows(tableNamed(dataset, "centres"), [](std::size_t row) { return row != 1 && row != 6; });
  const auto solved = solve(dataset);
  ASSERT_TRUE(solved.ok()) << solved.error().reason;
  EXPECT_NEAR(solved->find("Ycen_B90_mm")->value(), machine.centreline.y(), 1e-9);
  EXPECT_NEAR(solved->find("Xcen_B0_mm")->value(), machine.centreline.x(), 1e-9);
  EXPECT_NEAR(solved->find("x_offset_error_mm")->value(), machine.x_offset_error, 1e-9);
}

TEST(PeriodicCheck, GivesTheWorkedExample) {
  std::mt19937_64 random{3};
  Dataset dataset = check({}, 0.001, random);
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
  Dataset dataset = check(machine, 0.0, random);
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
  Dataset dataset = check({}, 1e-3, random);
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
  const auto solved = solve(check({}, 0.0, random, true));
  EXPECT_NEAR(solved->find("x_offset_error_mm")->value(), 2.0 * CheckedMachine{}.x_offset_error, 1e-9)
      << "in diameters too";
}

// ISO 14253-1: neither conformity nor its contrary is proven where the limit lies within U.
TEST(PeriodicCheck, PassesFailsOrProvesNeitherAgainstWhatWasAccepted) {
  std::mt19937_64 random{5};
  const auto verdict = [&](double accepted, double sigma) {
    Dataset dataset = check({}, 0.0, random);
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
  Dataset dataset = check({}, 0.001, random);
  EXPECT_EQ(solve(dataset)->find("verdict"), nullptr) << "nothing to compare with";
  dataset.config["limit_mm"] = 0.005;
  EXPECT_EQ(solve(dataset)->find("verdict")->value(), 2.0) << "the offset errors compare with none";
  EXPECT_THAT(solve(dataset)->warnings, testing::Contains(HasSubstr("calibrate again")));
}

// Two degrees of freedom give no sd, and without U nothing is proven.
TEST(PeriodicCheck, ProvesNothingWhereUIsUnknown) {
  std::mt19937_64 random{15};
  Dataset dataset = check({}, 1e-4, random);
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
  EXPECT_THAT(solved->warnings, testing::Contains(AllOf(HasSubstr("not proven: Xcen_B0_mm"), HasSubstr("U is unknown"),
                                                        HasSubstr("state sigma_mm"))));
  dataset.config["accepted_Xcen_B0_mm"] = 0.1;
  EXPECT_EQ(solve(dataset)->find("verdict")->value(), 1.0) << "beyond the limit, and not proven to be";
}

TEST(PeriodicCheck, DoesNotPassWhatHasALimitAndIsComparedWithNothing) {
  std::mt19937_64 random{16};
  Dataset dataset = check({}, 1e-4, random);
  dataset.config["limit_Xcen_B0_mm"] = 0.010;
  EXPECT_EQ(solve(dataset)->find("verdict")->value(), 1.0);
  EXPECT_THAT(solve(dataset)->warnings, testing::Contains(AllOf(HasSubstr("not proven: Xcen_B0_mm has a limit"),
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
  EXPECT_THAT(solve(dataset)->warnings, testing::Contains(HasSubstr("Ycen_B45_mm has a limit and was not measured")));
}

// What was accepted was measured too.
TEST(PeriodicCheck, JudgesWithTheDoubtOfWhatWasAccepted) {
  std::mt19937_64 random{12};
  Dataset exact = check({}, 0.0, random);
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
    const auto before = solve(check({}, 0.001, random));
    Dataset again = check({}, 0.001, random);
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
TEST(PeriodicCheck, JudgesWithWhatIsStatedOfBallAndCentre) {
  std::mt19937_64 random{8};
  const auto judged = [&](double sd_radius, double sd_centre, bool diameters) {
    Dataset dataset = check({.x_offset_error = 0.008, .z_offset_error = 0.001}, 0.0, random, diameters);
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
TEST(PeriodicCheck, JudgesRunOutsWithTheUncertaintyOfThePreTravel) {
  std::mt19937_64 random{17};
  Dataset dataset = check({}, 1e-4, random);
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

TEST(PeriodicCheck, TellsWhereTheBallIsAndWhetherItOrTheStylusHasMoved) {
  std::mt19937_64 random{7};
  Moments pull;
  for (int trial = 0; trial < 200; ++trial) {
    const CheckedMachine machine;
    const auto solved = solve(check(machine, 0.001, random));
    const auto& centre = *solved->find("ball_centre_mm");
    const Vector3d truth = machine.centreline + machine.ball + Vector3d{0, 0, machine.z_offset_error};
    for (std::size_t k = 0; k < 3; ++k) pull.add(centre.values[k] - truth[static_cast<Eigen::Index>(k)], centre.sd[k]);
    const auto& stylus = *solved->find("stylus_offset_y_mm");
    pull.add(stylus.value() - machine.stylus.y(), stylus.sd[0]);
    const auto& ball = *solved->find("ball_offset_x_mm");
    pull.add(ball.value() - machine.ball.x(), ball.sd[0]);
  }
  expectHonest(pull);
  Dataset dataset = check({}, 0.001, random);
  dataset.config["accepted_stylus_offset_x_mm"] = 0.025;
  dataset.config["limit_stylus_offset_x_mm"] = 0.005;
  EXPECT_EQ(solve(dataset)->find("verdict")->value(), 0.0);
  dataset.config["accepted_stylus_offset_x_mm"] = 0.045;
  EXPECT_EQ(solve(dataset)->find("verdict")->value(), 2.0);
  EXPECT_THAT(solve(dataset)->warnings, testing::Contains(HasSubstr("full calibration")));
}

TEST(PeriodicCheck, RefusesByName) {
  std::mt19937_64 random{6};
  const auto refusal = [&](const std::function<void(Dataset&)>& damage) {
    Dataset dataset = check({}, 0.001, random);
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
  Dataset partial = check({}, 0.001, random);
  keepRows(tableNamed(partial, "centres"), [](std::size_t row) { return row < 8; });
  EXPECT_EQ(solve(partial)->find("Ycen_B45_mm"), nullptr);
  EXPECT_THAT(solve(partial)->unobservable, testing::Contains(HasSubstr("Ycen_B45_mm: no reading")));
  EXPECT_THAT(solve(partial)->warnings, testing::Not(testing::Contains(HasSubstr("Ycen_B45_mm"))));
  partial.config["accepted_Ycen_B45_mm"] = 1.0;
  EXPECT_THAT(solve(partial)->warnings, testing::Contains(HasSubstr("Ycen_B45_mm was accepted once")));
}

}  // namespace
}  // namespace probebox::metrology
