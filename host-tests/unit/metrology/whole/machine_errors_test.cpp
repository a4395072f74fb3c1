// Errors of the machine itself, of which the readings show nothing: U holds them.
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <string>
#include <vector>

#include "firmware/metrology/methods.hpp"
#include "host-tests/metrology/cases.hpp"
#include "host-tests/metrology/mill_turn.hpp"
#include "host-tests/metrology/setter_cases.hpp"
#include "host-tests/metrology/touch_simulation.hpp"
#include "protocol/units/angle.hpp"

namespace probebox::metrology {
namespace {

using Eigen::AngleAxisd;
using Eigen::Vector3d;
using simulation::Scene;
using testing::IsEmpty;

// The case as nobody has stated anything of the machine.
void stateNothing(Dataset& dataset) {
  for (const auto& error : kMachineErrors) dataset.config.erase(error.key);
}

// How often answers are within four combined uncertainties of the truth.
struct Tally {
  double within{}, all{};

  void add(const Estimate& estimate, std::size_t part, double truth) {
    const double off = std::abs(estimate.values.at(part) - truth);
    within += off <= 4.0 * estimate.uncertainty.at(part) ? 1.0 : 0.0;
    all += 1.0;
  }
  double share() const { return within / all; }
};

Scene slowly() {
  Scene scene = simulation::inOut();
  scene.speeds_mm_s = {10.0};
  return scene;
}

struct TouchedWith {
  std::string name;
  std::function<Scene()> scene;
  std::vector<double> two_speeds_mm_s;
};

void PrintTo(const TouchedWith& touched, std::ostream* out) {
  *out << touched.name;
}

class TouchesOnRealMachine : public testing::TestWithParam<TouchedWith> {
 protected:
  static Dataset measured(const Scene& scene, std::mt19937_64& random) {
    Dataset dataset = simulation::measure(scene, random);
    stateNothing(dataset);
    return dataset;
  }
};

TEST_P(TouchesOnRealMachine, AreAsUncertainAsTheirErrorsAtOneSpeedAndAtTwo) {
  std::mt19937_64 random{71};
  const std::vector<std::function<void(Scene&)>> errors{
      [](Scene& s) { s.errors.lost_motion_mm.setConstant(0.005); }, [](Scene& s) { s.errors.hysteresis_mm = 0.001; },
      [](Scene& s) { s.radius_mm += s.radius_mm > 0 ? 0.0025 : -0.0025; },
      // By 1 % at the overtravel.
      [](Scene& s) { s.errors.curvature_per_mm.setConstant(0.01 / s.overtravel_mm); },
      [](Scene& s) {
        s.errors.form_mm = [](const Eigen::Vector3d& n) {
          return 0.003 * std::cos(3 * std::atan2(n.y(), n.x())) * n.head<2>().norm();
        };
      }};
  Tally tally;
  for (const bool two : {false, true}) {
    for (const auto& err : errors) {
      for (int trial = 0; trial < 3; ++trial) {
        Scene scene = simulation::shuffled(GetParam().scene(), random);
        if (two) scene.speeds_mm_s = GetParam().two_speeds_mm_s;
        Scene real = scene;
        err(real);
        Dataset dataset = measured(real, random);
        // What is stated is the size that the piece does not have.
        const auto stated = simulation::measure(scene, random).config;
        for (const auto* size : {"effective_diameter_mm", "gap_mm"}) {
          if (dataset.config.contains(size)) dataset.config[size] = stated.at(size);
        }
        const auto solved = solve(dataset);
        ASSERT_TRUE(solved.ok()) << solved.error().reason;
        const auto& delay = solved->estimates.front();
        for (std::size_t part = 0; part < delay.values.size(); ++part)
          tally.add(delay, part, scene.tauOf(static_cast<Eigen::Index>(part)));
        if (const auto* centre = solved->find("centre_mm"))
          for (std::size_t k = 0; k < 3; ++k) tally.add(*centre, k, scene.centre_mm[static_cast<Eigen::Index>(k)]);
        if (const auto* gain = solved->find("gain_matrix"))
          for (std::size_t k = 0; k < 9; ++k)
            tally.add(*gain, k, scene.gain.reshaped<Eigen::RowMajor>()[static_cast<Eigen::Index>(k)]);
      }
    }
  }
  EXPECT_GE(tally.share(), 0.98) << tally.all;
}

TEST_P(TouchesOnRealMachine, TellsOfNothingWhereTheMachineHasNoErrors) {
  std::mt19937_64 random{72};
  const bool quick = GetParam().name == "InOut";
  double warned = 0, all = 0;
  for (const bool two : {false, true}) {
    for (int trial = 0; trial < (quick ? 50 : 4); ++trial) {
      Scene scene = simulation::shuffled(GetParam().scene(), random);
      if (two) scene.speeds_mm_s = GetParam().two_speeds_mm_s;
      const auto solved = solve(measured(scene, random));
      ASSERT_TRUE(solved.ok()) << solved.error().reason;
      warned += solved->warnings.empty() ? 0 : 1;
      all += 1;
    }
  }
  EXPECT_LE(warned, 0.02 * all);
}

// A second speed parts lost motion from the delay, so that U is that of the readings again.
TEST_P(TouchesOnRealMachine, AreFarMoreCertainAtTwoSpeeds) {
  std::mt19937_64 random{73};
  Scene scene = GetParam().scene();
  const double speed_mm_s = scene.speeds_mm_s.front();
  const auto one = solve(measured(scene, random));
  scene.speeds_mm_s = GetParam().two_speeds_mm_s;
  const auto two = solve(measured(scene, random));
  ASSERT_TRUE(one.ok() && two.ok());
  // Off the normal, several axes move.
  const double of_lost_motion_s = 0.005 / (2.0 * speed_mm_s);
  EXPECT_GT(one->estimates[0].uncertainty[0], 0.95 * of_lost_motion_s);
  EXPECT_LT(one->estimates[0].uncertainty[0], 1.6 * of_lost_motion_s);
  EXPECT_LT(two->estimates[0].uncertainty[0], 0.3 * one->estimates[0].uncertainty[0]);
  EXPECT_TRUE(std::ranges::any_of(one->conditions, [](const auto& each) { return each.name == "accuracy"; }));
  const auto* lost = two->find("lost_motion_mm");
  ASSERT_NE(lost, nullptr);
  EXPECT_LT(std::ranges::max(lost->uncertainty), 2e-3) << "what tells the lost motion has no allowance for it";
}

// Against solving the case again with one touch further along its normal.
TEST_P(TouchesOnRealMachine, MoveTheValuesAsTheResultSays) {
  constexpr double kMoved_mm = 1e-5;
  std::mt19937_64 random{74};
  if (GetParam().name == "InOut") return;  // at one point: nothing but the delay
  for (const bool two : {false, true}) {
    Scene scene = simulation::shuffled(GetParam().scene(), random);
    if (two) scene.speeds_mm_s = GetParam().two_speeds_mm_s;
    const Dataset dataset = simulation::measure(scene, random);
    const auto& solver = methodNamed(dataset.method)->solver;
    const auto solved = solver(dataset);
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    ASSERT_EQ(solved->touched.rows(), dataset.table("touches")->rows());
    for (std::size_t touch = 0; touch < solved->touched.rows(); ++touch) {
      Dataset moved = dataset;
      const auto& ids = columnNamed(moved, "machine", "touch");
      for (const auto& [place, normal] : {std::pair{"x_mm", "nx"}, {"y_mm", "ny"}, {"z_mm", "nz"}}) {
        auto& values = columnNamed(moved, "machine", place);
        const double by = kMoved_mm * columnNamed(moved, "touches", normal)[touch];
        for (std::size_t row = 0; row < values.size(); ++row)
          values[row] += ids[row] == static_cast<double>(touch) ? by : 0;
      }
      const auto after = solver(moved);
      ASSERT_TRUE(after.ok()) << after.error().reason;
      for (const auto& estimate : solved->estimates) {
        if (estimate.key == "gain_matrix") continue;  // by slopes
        ASSERT_EQ(estimate.per_shift.size(), estimate.values.size() * solved->touched.rows()) << estimate.key;
        const double most = std::ranges::max(estimate.per_shift, {}, [](double each) { return std::abs(each); });
        for (std::size_t k = 0; k < estimate.values.size(); ++k)
          EXPECT_NEAR((after->find(estimate.key)->values[k] - estimate.values[k]) / kMoved_mm,
                      estimate.per_shift[k * solved->touched.rows() + touch], 0.02 * std::abs(most) + 1e-9)
              << estimate.key << " " << k << " touch " << touch << " " << two;
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Methods, TouchesOnRealMachine,
                         testing::Values(TouchedWith{"KnownSphere", simulation::knownSphere, {10, 25}},
                                         TouchedWith{"Plates", simulation::plates, {10, 25}},
                                         TouchedWith{"PerAxis", simulation::perAxis, {10, 40}},
                                         TouchedWith{"NonNormal", simulation::nonNormal, {10, 25}},
                                         TouchedWith{"InOut", slowly, {5, 10, 5}}),
                         [](const auto& each) { return each.param.name; });

TEST(MachineErrors, AreNotThereWhereZeroIsStated) {
  std::mt19937_64 random{74};
  const auto solved = solve(simulation::measure(simulation::knownSphere(), random));
  ASSERT_TRUE(solved.ok());
  EXPECT_EQ(solved->estimates[0].uncertainty, solved->estimates[0].sd);
  EXPECT_THAT(solved->conditions, IsEmpty());
}

// The box stamps each touch from its own beginning.
TEST(MachineErrors, OfADriftOfTouchesCountByTheirOrderWhereTheirStampsBeginAnew) {
  const auto driftOfCentre = [](double every_s, std::optional<double> stated_s) {
    std::mt19937_64 random{76};
    Scene scene = simulation::knownSphere();
    scene.speeds_mm_s = {10, 25};
    scene.every_s = every_s;
    Dataset dataset = simulation::measure(scene, random);
    stateNothing(dataset);
    if (stated_s) dataset.config["time_per_reading_s"] = *stated_s;
    const auto solved = solve(dataset);
    if (!solved.ok()) return 0.0;
    // Behind the delay.
    for (const auto& line : solved->budget)
      if (line.name == kDriftError.key) return line.sd.at(1);
    return 0.0;
  };
  const double by_stamps = driftOfCentre(12, {});
  EXPECT_GT(by_stamps, 1e-4);
  EXPECT_NEAR(driftOfCentre(0, {}), by_stamps, 0.05 * by_stamps) << "12 s a touch";
  EXPECT_NEAR(driftOfCentre(0, 12), by_stamps, 0.05 * by_stamps);
  EXPECT_NEAR(driftOfCentre(0, 1.2), 0.1 * by_stamps, 0.02 * by_stamps);
}

TEST(MachineErrors, OutOfRangeAreRefused) {
  std::mt19937_64 random{75};
  Dataset dataset = setterDataset({}, 2, 0.001, random);
  dataset.config["scale_ppm"] = -1.0;
  EXPECT_EQ(refusalOf(dataset), "bad-config");
  dataset.config["scale_ppm"] = 2000.0;
  EXPECT_EQ(refusalOf(dataset), "bad-config");
}

// ---- Places

// What a machine puts in the place of the one that it is at, reading by reading.
struct PlacedOff {
  Vector3d scale = Vector3d::Zero(), drift_mm = Vector3d::Zero();
  double xy{}, xz{}, yz{};

  Vector3d operator()(const Vector3d& at, std::size_t reading) const {
    return at +
           Vector3d{scale.x() * at.x() + xy * at.y() + xz * at.z(), scale.y() * at.y() + yz * at.z(),
                    scale.z() * at.z()} +
           static_cast<double>(reading) * drift_mm;
  }
};

// Drift of 0.5 um a reading, squareness of 50 urad, scale of 20 ppm: one of them.
std::vector<PlacedOff> ordinaryErrors(std::mt19937_64& random) {
  const auto either = [&](double size) { return uniform(random, 0, 1) < 0.5 ? -size : size; };
  std::vector<PlacedOff> all(3);
  all[0].drift_mm = {either(0.0005), either(0.0005), either(0.0005)};
  all[1].xy = either(50e-6), all[1].xz = either(50e-6), all[1].yz = either(50e-6);
  all[2].scale = {either(20e-6), either(20e-6), either(20e-6)};
  return all;
}

// Moves what was read about `middle`. columns: those of a place, x first; "" for none.
void moveReadings(Dataset& dataset, const std::array<std::string, 3>& columns, const Vector3d& middle,
                  const PlacedOff& err) {
  for (std::size_t row = 0; row < tableNamed(dataset, "readings").rows(); ++row) {
    Vector3d at = Vector3d::Zero();
    for (Eigen::Index k = 0; k < 3; ++k) {
      const auto& name = columns.at(static_cast<std::size_t>(k));
      if (!name.empty()) at[k] = columnNamed(dataset, "readings", name)[row] - middle[k];
    }
    const Vector3d off = err(at, row) - at;
    for (Eigen::Index k = 0; k < 3; ++k) {
      const auto& name = columns.at(static_cast<std::size_t>(k));
      if (!name.empty()) columnNamed(dataset, "readings", name)[row] += off[k];
    }
  }
}

constexpr int kMachines = 30;
constexpr double kPlaceNoise_mm = 5e-4;

TEST(MachineErrors, AreInUOfACentreline) {
  std::mt19937_64 random{81};
  Tally tally;
  for (int trial = 0; trial < kMachines; ++trial) {
    for (const auto& err : ordinaryErrors(random)) {
      const Vector3d centre{uniform(random, 100, 300), uniform(random, 100, 200), 0};
      const double arc = uniform(random, 2.0, 6.0);
      Dataset dataset{.method = "centreline", .config = {{"sigma_mm", kPlaceNoise_mm}}, .tables = {}};
      Table& readings = addTable(dataset, "readings", {"C_rad", "x_mm", "y_mm"});
      for (int k = 0; k < 8; ++k) {
        const double c = arc * k / 8;
        readings.append({c, centre.x() + 60 * std::cos(c) + gauss(random, kPlaceNoise_mm),
                         centre.y() + 60 * std::sin(c) + gauss(random, kPlaceNoise_mm)});
      }
      moveReadings(dataset, {"x_mm", "y_mm", ""}, centre, err);
      const auto solved = solve(dataset);
      if (!solved.ok()) continue;
      for (const std::size_t k : {0U, 1U})
        tally.add(*solved->find("centre_mm"), k, centre[static_cast<Eigen::Index>(k)]);
    }
  }
  EXPECT_GT(tally.all, 1.8 * 3 * kMachines);
  EXPECT_GE(tally.share(), 0.98);
}

// U of the centre's x by the drift alone, of readings in this order.
double driftInU(const std::vector<std::size_t>& order, bool stamped) {
  constexpr double kEach_s = 40;
  Dataset dataset{.method = "centreline", .config = {{"sigma_mm", kPlaceNoise_mm}}, .tables = {}};
  Table& readings = addTable(dataset, "readings", {"C_rad", "x_mm", "y_mm"});
  Column stamps{"time_s", {}};
  for (const auto k : order) {
    const double c = 0.4 * static_cast<double>(k);
    readings.append({c, 60 * std::cos(c), 60 * std::sin(c)});
    stamps.values.push_back(1000 + kEach_s * static_cast<double>(k));
  }
  if (stamped) readings.columns.push_back(std::move(stamps));
  if (!stamped) dataset.config["time_per_reading_s"] = kEach_s;
  const auto solved = solve(dataset);
  if (!solved.ok()) return NAN;
  for (const auto& line : solved->budget)
    if (line.name == kDriftError.key) return line.sd.front();
  return NAN;
}

TEST(MachineErrors, OfADriftCountByTheStampsOfTheReadings) {
  const std::vector<std::size_t> in_order{0, 1, 2, 3, 4, 5, 6, 7}, shuffled{3, 0, 7, 1, 6, 2, 5, 4};
  const double by_order = driftInU(in_order, false);
  EXPECT_GT(by_order, 1e-4);
  EXPECT_NEAR(driftInU(in_order, true), by_order, 1e-6 * by_order);
  EXPECT_NEAR(driftInU(shuffled, true), by_order, 1e-6 * by_order);
  EXPECT_GT(std::abs(driftInU(shuffled, false) - by_order), 0.1 * by_order);
}

TEST(MachineErrors, AreInUOfTheDirectionOfC) {
  std::mt19937_64 random{82};
  Tally tally;
  for (int trial = 0; trial < kMachines; ++trial) {
    for (const auto& err : ordinaryErrors(random)) {
      Machine machine = randomMachine(random, 2e-4);
      auto rows = grid({80, 120, 160}, kOpposed, kOpposed);
      for (auto& row : rows) {
        machine.ball.z() = row.lever;
        row.at = machine.reading(row.spindle, row.c, 0).head<2>();
        for (double& value : row.at) value += gauss(random, kPlaceNoise_mm);
      }
      Dataset dataset = ballDataset("c-axis-alignment", "z_mm", rows, kPlaceNoise_mm);
      stateNothing(dataset);
      moveReadings(dataset, {"x_mm", "y_mm", "z_mm"}, {machine.c_point.x(), machine.c_point.y(), 120}, err);
      const auto solved = solve(dataset);
      if (!solved.ok()) continue;
      for (const std::size_t k : {0U, 1U})
        tally.add(*solved->find("C_tilt_rad"), k, machine.c_tilt[static_cast<Eigen::Index>(k)]);
    }
  }
  EXPECT_GT(tally.all, 1.8 * 3 * kMachines);
  EXPECT_GE(tally.share(), 0.98);
}

TEST(MachineErrors, AreInUOfThePivotOfAHead) {
  std::mt19937_64 random{83};
  Tally tally;
  for (int trial = 0; trial < kMachines; ++trial) {
    for (const auto& err : ordinaryErrors(random)) {
      const Vector3d pivot{uniform(random, -.1, .1), 0, uniform(random, -200, -80)}, tip{-0.17, 0, 100},
          ball{18, -9, -8};
      Dataset dataset{.method = "head-pivot",
                      .config = {{"sigma_mm", kPlaceNoise_mm},
                                 {"ball_mm", std::vector<double>{ball.x(), ball.y(), ball.z()}},
                                 {"swivel_axis", std::vector<double>{0, 1, 0}}},
                      .tables = {}};
      Table& readings = addTable(dataset, "readings", {"B_deg", "A_deg", "x_mm", "y_mm", "z_mm"});
      Vector3d middle = Vector3d::Zero();
      for (const double b : {0.0, 90.0}) {
        for (const double a : {0.0, 180.0}) {
          const Vector3d at_zero = tip + AngleAxisd{a * kDegree, Vector3d::UnitZ()} * Vector3d{0.02, -0.04, 0};
          const Vector3d at = ball - (pivot + AngleAxisd{b * kDegree, Vector3d::UnitY()} * (at_zero - pivot));
          middle += at / 4;
          readings.append({b, a, at.x() + gauss(random, kPlaceNoise_mm), at.y() + gauss(random, kPlaceNoise_mm),
                           at.z() + gauss(random, kPlaceNoise_mm)});
        }
      }
      moveReadings(dataset, {"x_mm", "y_mm", "z_mm"}, middle, err);
      const auto solved = solve(dataset);
      if (!solved.ok()) continue;
      tally.add(*solved->find("pivot_xz_mm"), 0, pivot.x());
      tally.add(*solved->find("pivot_xz_mm"), 1, pivot.z());
    }
  }
  EXPECT_GT(tally.all, 1.8 * 3 * kMachines);
  EXPECT_GE(tally.share(), 0.98);
}

TEST(MachineErrors, AreInUOfAToolOnTheSetter) {
  std::mt19937_64 random{84};
  Tally tally;
  for (int trial = 0; trial < kMachines; ++trial) {
    for (const auto& err : ordinaryErrors(random)) {
      const Setter setter{.at = anywhere(random, 100), .tool = anywhere(random, 60) + Vector3d{0, 0, 125}};
      Dataset dataset = setterDataset(setter, 3, kPlaceNoise_mm, random);
      stateNothing(dataset);
      moveReadings(dataset, {"x_mm", "y_mm", "z_mm"}, setter.reading(setter.probe), err);
      const auto solved = solve(dataset);
      if (!solved.ok()) continue;
      for (const std::size_t k : {0U, 1U, 2U})
        tally.add(*solved->find("tool_offset_mm"), k, setter.tool[static_cast<Eigen::Index>(k)]);
    }
  }
  EXPECT_GT(tally.all, 2.7 * 3 * kMachines);
  EXPECT_GE(tally.share(), 0.98);
}

}  // namespace
}  // namespace probebox::metrology
