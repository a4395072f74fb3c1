// A ball plate in several mounts on a rotary table, read by machine axes that have errors of their own.
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <ctime>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "firmware/metrology/rotary/rotary_axis_errors.hpp"
#include "host-tests/metrology/cases.hpp"
#include "host-tests/metrology/turned.hpp"
#include "protocol/units/angle.hpp"

namespace probebox::metrology {
namespace {

using Eigen::AngleAxisd;
using Eigen::Matrix3d;
using Eigen::Vector3d;

struct Bench {
  std::vector<Vector3d> balls;   // as they are, in the plate's frame
  std::vector<Vector3d> shifts;  // of each mount
  std::vector<Matrix3d> rotations;
  std::vector<double> angles;
  std::vector<SixErrors> errors;
  double linear_mm{};  // errors of the linear axes, by place

  Vector3d placed(std::size_t mount, std::size_t ball) const { return rotations[mount] * balls[ball] + shifts[mount]; }
  Vector3d moved(const Vector3d& place, std::size_t k) const {
    return errors[k].head<3>() + turned(errors[k].tail<3>()) * (AngleAxisd{angles[k], Vector3d::UnitZ()} * place);
  }
  // What the machine's axes show of a place: bent and stretched, the same whenever they go there.
  Vector3d shown(const Vector3d& at) const {
    return at + linear_mm * Vector3d{std::sin(0.03 * at.y()) + std::cos(0.05 * at.x()), std::cos(0.04 * at.x() - 1.0),
                                     std::sin(0.02 * at.x() + 0.03 * at.y())};
  }
};

Bench randomBench(std::mt19937_64& random, std::size_t mounts, std::size_t angles) {
  Bench bench;
  for (int k = 0; k < 8; ++k) {
    const double angle = kTurn * k / 8.0;
    bench.balls.emplace_back(120 * std::cos(angle), 120 * std::sin(angle), 40.0);
  }
  for (std::size_t m = 0; m < mounts; ++m) {
    bench.shifts.push_back(0.2 * anywhere(random, 1.0) + Vector3d{0, 0, 60.0 * static_cast<double>(m)});
    bench.rotations.push_back(turned(anywhere(random, 0.001)));
  }
  for (std::size_t k = 0; k < angles; ++k) {
    bench.angles.push_back(kTurn / 8.0 * static_cast<double>(k + 1));
    SixErrors errors;
    errors << anywhere(random, 0.01), anywhere(random, 5e-5);
    bench.errors.push_back(errors);
  }
  return bench;
}

// which: balls that are read at an angle in a mount.
using Which = std::function<bool(std::size_t angle, std::size_t mount, std::size_t ball)>;

// What is not as good as sigma_mm says: coordinates along the axis, and where the axis stops.
struct Worse {
  double axial{};
  double angle{};
};

Dataset datasetOf(const Bench& bench, const Which& which, double sigma, double third_sigma, std::mt19937_64& random,
                  const Worse& worse = {}) {
  Dataset dataset{.method = "rotary-axis-errors",
                  .config = {{"axis_point_mm", std::vector<double>{0, 0, 0}},
                             {"axis_direction", std::vector<double>{0, 0, 1}},
                             {"sigma_mm", sigma}},
                  .tables = {}};
  stateExactMachine(dataset);
  const auto blur = [&](double by) { return Vector3d{gauss(random, by), gauss(random, by), gauss(random, by)}; };
  const auto read = [&](const Vector3d& place, double stop) -> Vector3d {
    const Vector3d further =
        Vector3d::UnitZ() * gauss(random, std::sqrt(std::max(worse.axial * worse.axial - sigma * sigma, 0.0)));
    return bench.shown(place + stop * Vector3d::UnitZ().cross(place)) + blur(sigma) + further;
  };
  std::vector<double> stops(bench.angles.size() + 1);
  for (double& stop : stops) stop = gauss(random, worse.angle);
  Table first =
      Table::withColumns("first", std::array<std::string_view, 6>{"phi_rad", "mount", "ball", "x_mm", "y_mm", "z_mm"});
  Table second = Table::withColumns("second", std::array<std::string_view, 5>{"mount", "ball", "x_mm", "y_mm", "z_mm"});
  Table third = Table::withColumns("third", std::array<std::string_view, 4>{"ball", "x_mm", "y_mm", "z_mm"});
  for (std::size_t ball = 0; ball < bench.balls.size(); ++ball) {
    const auto id = static_cast<double>(ball);
    const Vector3d certified = bench.balls[ball] + blur(third_sigma);
    third.append({id, certified.x(), certified.y(), certified.z()});
    for (std::size_t mount = 0; mount < bench.shifts.size(); ++mount) {
      const auto name = static_cast<double>(mount + 1);
      const Vector3d at = read(bench.placed(mount, ball), stops.back());
      second.append({name, id, at.x(), at.y(), at.z()});
      for (std::size_t k = 0; k < bench.angles.size(); ++k) {
        if (!which(k, mount, ball)) continue;
        const Vector3d found = read(bench.moved(bench.placed(mount, ball), k), stops[k]);
        first.append({bench.angles[k], name, id, found.x(), found.y(), found.z()});
      }
    }
  }
  dataset.tables = {std::move(first), std::move(second), std::move(third)};
  return dataset;
}

const Which kAll = [](std::size_t, std::size_t, std::size_t) { return true; };
// Only the ball that the axis has brought to the first station, or next to it.
const Which kOneStation = [](std::size_t angle, std::size_t, std::size_t ball) { return (ball + angle + 1) % 8 == 0; };

double worst(const Result& result, const Bench& bench) {
  double worst = 0.0;
  for (std::size_t k = 0; k < bench.angles.size(); ++k) {
    for (std::size_t e = 0; e < 6; ++e) {
      const double lever = e < 3 ? 1.0 : 120.0;
      const double off = result.find("six_errors")->values[6 * k + e] - bench.errors[k][static_cast<Eigen::Index>(e)];
      worst = std::max(worst, lever * std::abs(off));
    }
  }
  return worst;
}

TEST(RotaryStack, IsExactWithoutNoiseFromAnyNumberOfMounts) {
  std::mt19937_64 random{1};
  for (const std::size_t mounts : {1U, 2U, 4U}) {
    const Bench bench = randomBench(random, mounts, 4);
    const auto solved = solve(datasetOf(bench, kAll, 0.0, 0.0, random));
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    EXPECT_LT(worst(solved.value(), bench), 1e-8);
  }
  // One ball an angle and mount: three mounts that are not in line fix all.
  Bench bench = randomBench(random, 3, 4);
  bench.shifts[1] += Vector3d{40, 0, 0};
  const auto solved = solve(datasetOf(bench, kOneStation, 0.0, 0.0, random));
  ASSERT_TRUE(solved.ok()) << solved.error().reason;
  EXPECT_LT(worst(solved.value(), bench), 1e-8);
}

TEST(RotaryStack, StatesItsUncertaintyForStacksStationsAndCertificates) {
  std::mt19937_64 random{2};
  Moments stacked;
  Moments certificate;
  Moments station;
  Moments worse, about_axis;
  for (int trial = 0; trial < 60; ++trial) {
    const double sigma = uniform(random, 3e-4, 3e-3);
    const auto add = [&](Moments& into, const Bench& bench, Dataset dataset) {
      const auto solved = solve(dataset);
      ASSERT_TRUE(solved.ok()) << solved.error().reason;
      const auto& six = *solved->find("six_errors");
      for (std::size_t k = 0; k < bench.angles.size(); ++k) {
        for (std::size_t e = 0; e < 6; ++e) {
          into.add(six.values[6 * k + e] - bench.errors[k][static_cast<Eigen::Index>(e)], six.sd[6 * k + e]);
        }
      }
    };
    const Bench two = randomBench(random, 2, 4);
    add(stacked, two, datasetOf(two, kAll, sigma, 0.0, random));
    const Which some = [](std::size_t, std::size_t, std::size_t ball) { return ball < 4; };
    const Bench one = randomBench(random, 1, 3);
    Dataset certified = datasetOf(one, some, sigma, 2.0 * sigma, random);
    certified.config["sigma_third_mm"] = 2.0 * sigma;
    add(certificate, one, certified);
    Dataset corrected = datasetOf(one, some, sigma, 0.0, random);
    corrected.config["station_correction"] = true;
    add(station, one, corrected);
    Dataset axial = datasetOf(one, some, sigma, 0.0, random, {.axial = 3 * sigma, .angle = sigma / 50});
    axial.config["sigma_axial_mm"] = 3 * sigma;
    axial.config["sigma_angle_rad"] = sigma / 50;
    add(worse, one, axial);
    const auto six = *solve(axial)->find("six_errors");
    for (std::size_t k = 0; k < one.angles.size(); ++k)
      about_axis.add(six.values[6 * k + 5] - one.errors[k][5], six.sd[6 * k + 5]);
  }
  expectHonest(about_axis, 60);  // the three angles of a run share much of their noise
  for (const auto* moments : {&stacked, &certificate, &station, &worse}) {
    expectHonest(*moments);
    EXPECT_LT(std::abs(moments->bias()), 4.0);
  }
}

// A ring of balls determines the errors of every angle alike. What chooses the place of the plate must not add to their
// sd.
TEST(RotaryStack, StationsLeaveTheSdOfAnErrorTheSameAtEveryAngle) {
  std::mt19937_64 random{13};
  Bench bench = randomBench(random, 1, 3);
  bench.linear_mm = 0.01;
  Dataset dataset = datasetOf(bench, kAll, 1e-3, 0.0, random);
  dataset.config["station_correction"] = true;
  const auto solved = solve(dataset);
  ASSERT_TRUE(solved.ok()) << solved.error().reason;
  const auto& sd = solved->find("six_errors")->sd;
  for (std::size_t k = 1; k < bench.angles.size(); ++k) {
    for (std::size_t e = 0; e < 6; ++e)
      EXPECT_NEAR(sd[6 * k + e], sd[e], 0.005 * sd[e]) << "error " << e << " at " << k;
  }
  // Tilts: two sets of eight heights at a radius of 120 mm.
  EXPECT_NEAR(sd[3], 1e-3 * std::sqrt(2.0 / (4 * 120 * 120)), 0.01 * sd[3]);
}

// As where the middle of a sensor head is not known: that is no error of the axis, but looks like one of its place.
TEST(RotaryStack, KnowsWhatAllReadingsMayBeOffByTogether) {
  std::mt19937_64 random{12};
  Moments moments;
  for (int trial = 0; trial < 150; ++trial) {
    const double sigma = uniform(random, 3e-4, 1e-3), common = uniform(random, 1, 10) * sigma;
    const Bench bench = randomBench(random, 1, 3);
    Dataset dataset = datasetOf(bench, kAll, sigma, 0.0, random);
    const auto alone = solve(dataset);
    for (const char* table : {"first", "second"}) {
      std::mt19937_64 same{static_cast<std::uint64_t>(trial)};
      for (const char* column : {"x_mm", "y_mm", "z_mm"}) {
        const double off = gauss(same, common);
        for (double& value : columnNamed(dataset, table, column)) value += off;
      }
    }
    dataset.config["sigma_offset_mm"] = common;
    const auto solved = solve(dataset);
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    const auto &six = *solved->find("six_errors"), &six_alone = *alone->find("six_errors");
    const std::size_t k = bench.angles.size() - 1;
    for (std::size_t e = 0; e < 2; ++e) {
      moments.add(six.values[6 * k + e] - bench.errors[k][static_cast<Eigen::Index>(e)], six.sd[6 * k + e]);
      EXPECT_GT(six.sd[6 * k + e], six_alone.sd[6 * k + e]);
    }
    EXPECT_NEAR(six.sd[6 * k + 5], six_alone.sd[6 * k + 5], 0.01 * six_alone.sd[6 * k + 5]) << "no turn is doubtful";
  }
  expectHonest(moments);
}

// What holds the stations and the certificate is no reading.
TEST(RotaryStack, ResidualRmsIsThatOfTheReadings) {
  std::mt19937_64 random{9};
  const Which some = [](std::size_t, std::size_t, std::size_t ball) { return ball < 4; };
  Dataset dataset = datasetOf(randomBench(random, 1, 3), some, 0.001, 0.0, random);
  dataset.config["station_correction"] = true;
  const auto solved = solve(dataset);
  const double squares = *solved->chi2_reduced * static_cast<double>(solved->dof) * 1e-6;
  EXPECT_NEAR(solved->rms, std::sqrt(squares / (3.0 * (8.0 + 3.0 * 4.0))), 1e-11);
}

TEST(RotaryStack, AKeyAtItsDefaultChangesNothing) {
  std::mt19937_64 random{10};
  Bench bench = randomBench(random, 1, 5);
  for (double& angle : bench.angles) angle -= kTurn / 8.0;  // from zero on
  bench.errors[0].setZero();
  Dataset dataset = datasetOf(bench, kAll, 0.001, 0.0, random);
  for (auto& table : dataset.tables) std::erase_if(table.columns, [](const auto& c) { return c.name == "mount"; });
  const auto plain = solve(dataset);
  dataset.config["station_correction"] = false;
  const auto stated = solve(dataset);
  EXPECT_EQ(stated->find("six_errors")->values, plain->find("six_errors")->values);
  EXPECT_EQ(stated->warnings, plain->warnings);
}

TEST(RotaryStack, TwoMountsTellTiltsBetterThanOne) {
  std::mt19937_64 random{3};
  const auto sd = [&](std::size_t mounts) {
    const Bench bench = randomBench(random, mounts, 3);
    return solve(datasetOf(bench, kAll, 0.001, 0.0, random))->find("six_errors")->sd[3];
  };
  EXPECT_LT(sd(2), 0.85 * sd(1));
}

// Linear axes that are off by some um, four of eight balls within reach.
TEST(RotaryStack, TakesTheErrorsOfTheLinearAxesOut) {
  std::mt19937_64 random{4};
  Bench bench = randomBench(random, 1, 4);
  bench.linear_mm = 0.005;
  const Which reachable = [](std::size_t angle, std::size_t, std::size_t ball) { return (ball + angle + 1) % 8 < 4; };
  Dataset dataset = datasetOf(bench, reachable, 0.0, 0.0, random);
  // What the linear axes do to the plate as one body is the axis' location in the machine's own coordinates, the same
  // at every angle but for the turn: compare what the corrected errors leave of a rigid motion turned along.
  dataset.config["station_correction"] = false;
  const auto raw = solve(dataset);
  dataset.config["station_correction"] = true;
  const auto corrected = solve(dataset);
  ASSERT_TRUE(corrected.ok()) << corrected.error().reason;
  const auto left = [&](const Result& result) {
    // (I - R(phi)) g for one rigid motion g, by least squares; what it does not explain is left.
    Eigen::MatrixXd design = Eigen::MatrixXd::Zero(24, 6);
    Eigen::VectorXd off{24};
    for (std::size_t k = 0; k < 4; ++k) {
      const Matrix3d gone = Matrix3d::Identity() - AngleAxisd{bench.angles[k], Vector3d::UnitZ()}.toRotationMatrix();
      const auto row = static_cast<Eigen::Index>(6 * k);
      design.block<3, 3>(row, 0) = gone;
      design.block<3, 3>(row + 3, 3) = 120.0 * gone;
      off.segment<6>(row) =
          Eigen::Map<const SixErrors>{result.find("six_errors")->values.data() + 6 * k} - bench.errors[k];
      off.segment<3>(row + 3) *= 120.0;
    }
    const Eigen::VectorXd g = design.completeOrthogonalDecomposition().solve(off);
    return (off - design * g).cwiseAbs().maxCoeff();
  };
  EXPECT_GT(left(raw.value()), 5e-4);
  EXPECT_LT(left(corrected.value()), 5e-5) << "of 5 um; the field changes by 20 um of way";
}

TEST(RotaryStack, RefusesByName) {
  std::mt19937_64 random{5};
  const auto refusal = [&](std::size_t mounts, const Which& which, const std::function<void(Dataset&)>& damage) {
    Dataset dataset = datasetOf(randomBench(random, mounts, 3), which, 0.001, 0.0, random);
    damage(dataset);
    return refusalOf(dataset);
  };
  const auto keep = [](Dataset&) {};
  EXPECT_EQ(refusal(2, kAll, keep), "");
  EXPECT_EQ(refusal(1, kOneStation, keep), "rank-too-small");
  EXPECT_EQ(refusal(2, kOneStation, keep), "rank-too-small") << "two balls on a line along the axis";
  EXPECT_EQ(refusal(2, kAll, [](Dataset& d) { columnNamed(d, "first", "mount")[0] = 7.0; }), "missing-ball");
  EXPECT_EQ(refusal(2, kAll, [](Dataset& d) { columnNamed(d, "first", "ball")[0] = 70.0; }), "missing-ball");
  EXPECT_EQ(refusal(2, kAll, [](Dataset& d) { columnNamed(d, "second", "ball")[0] = 1.0; }), "duplicated-ball");
  EXPECT_EQ(refusal(2, kAll, [](Dataset& d) { columnNamed(d, "second", "x_mm")[0] += 0.05; }), "residual-too-large");
  EXPECT_EQ(refusal(2, kAll, [](Dataset& d) { d.config.erase("axis_point_mm"); }), "missing-key");
  EXPECT_EQ(refusal(1, kAll,
                    [](Dataset& d) {
                      d.config["station_correction"] = true;
                      d.config["station_radius_mm"] = 0.01;
                    }),
            "not-at-station");
  EXPECT_EQ(refusal(1, kAll,
                    [](Dataset& d) {
                      d.config["sigma_third_mm"] = 0.001;
                      d.config.erase("sigma_mm");
                    }),
            "missing-key");
  EXPECT_EQ(refusal(1, kAll,
                    [](Dataset& d) {
                      d.config["sigma_third_mm"] = 0.001;
                      d.config["sd_certificate_mm"] = 0.001;
                    }),
            "bad-config")
      << "one uncertainty, counted twice";
  for (const char* key : {"sigma_axial_mm", "sigma_angle_rad", "sigma_offset_mm"}) {
    EXPECT_EQ(refusal(1, kAll,
                      [key](Dataset& d) {
                        d.config[key] = 0.001;
                        d.config.erase("sigma_mm");
                      }),
              "missing-key")
        << key;
  }
}

// Time that a solver takes for so many angles of three balls, s of the processor.
double timeOf(std::size_t angles, const char* further_sigma, std::mt19937_64& random) {
  Bench bench = randomBench(random, 1, angles);
  for (std::size_t k = 0; k < angles; ++k)
    bench.angles[k] = kTurn / static_cast<double>(angles) * (static_cast<double>(k) + 0.5);
  const Which three = [](std::size_t, std::size_t, std::size_t ball) { return ball % 3 == 0; };
  Dataset dataset = datasetOf(bench, three, 1e-3, 0.0, random);
  if (further_sigma != nullptr)
    dataset.config[further_sigma] = 2e-3;
  else
    for (auto& table : dataset.tables)
      std::erase_if(table.columns, [](const auto& each) { return each.name == "mount"; });
  double least = 1e9;
  for (int again = 0; again < 3; ++again) {
    const auto from = std::clock();
    EXPECT_TRUE(solveRotaryAxisErrors(dataset).ok());
    least = std::min(least, static_cast<double>(std::clock() - from) / CLOCKS_PER_SEC);
  }
  return least;
}

TEST(RotaryAxisErrors, TakesTimeInProportionToTheAngles) {
  std::mt19937_64 random{31};
  for (const char* further_sigma : {static_cast<const char*>(nullptr), "sigma_axial_mm"}) {
    // The square would be 16, the cube 64.
    EXPECT_LT(timeOf(720, further_sigma, random), 10 * timeOf(180, further_sigma, random));
  }
}

}  // namespace
}  // namespace probebox::metrology
