// Corrections at every tick: from an answer of a method to what is added to the command, against the machine itself.
#include <Eigen/Geometry>
#include <array>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <limits>
#include <numbers>
#include <rapidcheck/gtest.h>

#include "firmware/metrology/live/rotary_correction.hpp"
#include "firmware/metrology/live/swivel_correction.hpp"
#include "host-tests/metrology/cases.hpp"
#include "host-tests/support/no_alloc.hpp"
#include "protocol/units/angle.hpp"

namespace probebox::metrology {
namespace {

using Eigen::AngleAxisd;
using Eigen::Vector3d;

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
using Row1 = AngleTable<1>::Row;

std::vector<Row1> rowsOf(const std::vector<double>& angles, const std::function<double(double)>& value) {
  std::vector<Row1> rows;
  for (const double angle : angles) rows.push_back(Row1{value(angle)});
  return rows;
}

std::vector<double> evenAngles(int count, double start) {
  std::vector<double> angles;
  for (int k = 0; k < count; ++k) angles.push_back(start + kTurn * k / count);
  return angles;
}

RC_GTEST_PROP(AngleTable, GivesItsOwnValuesAtItsAnglesWhateverTheTurn, ()) {
  std::mt19937_64 random{*rc::gen::arbitrary<std::uint64_t>()};
  const auto angles = evenAngles(*rc::gen::inRange(4, 73), uniform(random, -10, 10));
  std::vector<Row1> rows;
  for (std::size_t k = 0; k < angles.size(); ++k) rows.push_back(Row1{uniform(random, -1, 1)});
  for (const Between between : {Between::linear, Between::fourier}) {
    const auto table = AngleTable<1>::make(angles, rows, between);
    RC_ASSERT(table.ok());
    for (std::size_t k = 0; k < angles.size(); ++k) {
      const auto at = table->at(angles[k] + kTurn * *rc::gen::inRange(-3, 4));
      RC_ASSERT(at.has_value());
      RC_ASSERT(std::abs((*at)[0] - rows[k][0]) < 1e-9);
    }
  }
}

TEST(AngleTable, HarmonicsAreExactBetweenTheAnglesAndChordsAreClose) {
  const auto wave = [](double a) { return 3.0 + 2.0 * std::cos(a - 0.4) + 0.7 * std::sin(3.0 * a); };
  for (const int count : {8, 9, 36}) {
    const auto angles = evenAngles(count, 0.3);
    const auto fourier = AngleTable<1>::make(angles, rowsOf(angles, wave), Between::fourier);
    const auto linear = AngleTable<1>::make(angles, rowsOf(angles, wave), Between::linear);
    const double step = kTurn / count;
    for (double a = -7.0; a < 7.0; a += 0.01) {
      ASSERT_NEAR((*fourier->at(a))[0], wave(a), 1e-12);
      ASSERT_NEAR((*linear->at(a))[0], wave(a), step * step / 8.0 * (2.0 + 9.0 * 0.7));
    }
  }
}

TEST(AngleTable, SaysNothingWhereNobodyMeasured) {
  const std::vector<double> angles{-90 * kDegree, -45 * kDegree, 0, 45 * kDegree, 90 * kDegree};
  const auto table = AngleTable<1>::make(angles, rowsOf(angles, [](double a) { return a; }), Between::linear);
  EXPECT_NEAR((*table->at(-60 * kDegree))[0], -60 * kDegree, 1e-12);
  EXPECT_TRUE(table->at(90 * kDegree).has_value());
  EXPECT_TRUE(table->at(-90 * kDegree).has_value());
  EXPECT_FALSE(table->at(91 * kDegree).has_value());
  EXPECT_FALSE(table->at(180 * kDegree).has_value());
  EXPECT_FALSE(table->at(kNone).has_value());
}

TEST(AngleTable, RefusesByName) {
  const auto refusal = [](const std::vector<double>& angles, Between between) {
    const auto table = AngleTable<1>::make(angles, rowsOf(angles, [](double) { return 1.0; }), between);
    return table.ok() ? std::string{} : table.error().name;
  };
  EXPECT_EQ(refusal({0, 1}, Between::linear), "");
  EXPECT_EQ(refusal({0}, Between::linear), "too-few-readings");
  EXPECT_EQ(refusal(evenAngles(73, 0), Between::linear), "too-many-angles");
  EXPECT_EQ(refusal({0, kNone}, Between::linear), "not-finite");
  EXPECT_EQ(refusal({0, 1, kTurn}, Between::linear), "duplicated-angle");
  EXPECT_EQ(refusal({0, 1, 2, 3}, Between::fourier), "uneven-angles");
  EXPECT_EQ(refusal(evenAngles(3, 1), Between::fourier), "");
}

// A head with errors, its reports solved, and what the correction makes of them at any angle and length.
TEST(SwivelCorrection, PutsTheTipWhereTheControlBelievesItWhateverTheModel) {
  const Vector3d gauge{0.010, 0.004, 0.025};
  const Vector3d direction{-1e-4, 5e-5, 2e-4};
  const auto error = [&](double b, double length) {
    const AngleAxisd turned{b, Vector3d::UnitY()};
    return Vector3d{-(turned * (gauge + length * direction)) + gauge + length * direction};
  };
  for (const auto& model : {"", "rigid", "free"}) {
    Dataset dataset{.method = "swivel-error", .config = {{"swivel_axis", std::vector<double>{0, 1, 0}}}, .tables = {}};
    if (*model) dataset.config["model"] = std::string{model};
    Table readings =
        Table::withColumns("readings", std::array<std::string_view, 5>{"B_deg", "L_mm", "x_mm", "y_mm", "z_mm"});
    for (const double length : {100.0, 200.0}) {
      for (const double b : {0.0, 45.0, 90.0}) {
        const Vector3d at = Vector3d{1, 2, 3} + error(b * kDegree, length);
        readings.append({b, length, at.x(), at.y(), at.z()});
      }
    }
    Table queries = Table::withColumns("queries", std::array<std::string_view, 2>{"B_deg", "L_mm"});
    queries.append({30, 150});
    dataset.tables = {std::move(readings), std::move(queries)};
    const auto solved = solve(dataset);
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    const auto correction = SwivelCorrection::from(solved.value(), false);
    ASSERT_TRUE(correction.ok());
    for (double b = -1.5; b < 1.6; b += 0.1) {
      EXPECT_LT((*correction->at(b, 130.0) - error(b, 130.0)).norm(), 1e-9) << model;
    }
    const auto* asked = solved->find("error_at_queries_mm")->values.data();
    EXPECT_LT((*correction->at(30 * kDegree, 150.0) - Vector3d{asked[0], asked[1], asked[2]}).norm(), 1e-12);
  }
}

TEST(SwivelCorrection, AddsWhatAnIndexErrorLeavesAtEachAngle) {
  Dataset dataset{.method = "swivel-error", .config = {{"swivel_axis", std::vector<double>{0, 1, 0}}}, .tables = {}};
  Table readings =
      Table::withColumns("readings", std::array<std::string_view, 5>{"B_deg", "L_mm", "x_mm", "y_mm", "z_mm"});
  for (const double length : {100.0, 200.0}) {
    for (const double b : {-90.0, -60.0, -30.0, 0.0, 30.0, 60.0, 90.0}) {
      readings.append({b, length, b == 30.0 ? 0.02 : 0.0, 2, 3});
    }
  }
  Table queries = Table::withColumns("queries", std::array<std::string_view, 2>{"B_deg", "L_mm"});
  queries.append({30, 150});
  dataset.tables = {std::move(readings), std::move(queries)};
  const auto solved = solve(dataset);
  ASSERT_TRUE(solved.ok()) << solved.error().reason;
  const auto with = SwivelCorrection::from(solved.value(), true);
  ASSERT_TRUE(with.ok());
  for (const double b : {-90.0, -60.0, 0.0, 30.0, 90.0}) {
    EXPECT_NEAR(with->at(b * kDegree, 150.0)->x(), b == 30.0 ? 0.02 : 0.0, 1e-12) << b;
  }
  EXPECT_FALSE(with->at(100 * kDegree, 150.0).has_value()) << "beyond the table";
}

TEST(SwivelCorrection, IsInvalidWithoutItsInputs) {
  const SwivelCorrection correction{SwivelTerms{.sine = {1, 0, 0}}};
  EXPECT_NEAR(correction.at(std::numbers::pi / 2.0, 100.0)->x(), 1.0, 1e-15);
  EXPECT_FALSE(correction.at(std::nullopt, 100.0).has_value());
  EXPECT_FALSE(correction.at(0.1, std::nullopt).has_value());
  EXPECT_FALSE(correction.at(kNone, 100.0).has_value());
  EXPECT_EQ(SwivelCorrection::from(Result{}, false).error().name, "wrong-result");
}

SixErrors randomErrors(std::mt19937_64& random) {
  SixErrors errors;
  for (Eigen::Index e = 0; e < 6; ++e) errors[e] = uniform(random, -1, 1) * (e < 3 ? 0.01 : 5e-5);
  return errors;
}

CalibratedAxis randomAxis(std::mt19937_64& random, const Vector3d& point, const Vector3d& direction,
                          std::vector<SixErrors>& errors) {
  const auto angles = evenAngles(12, 0.0);
  for (std::size_t k = 0; k < 12; ++k) errors.push_back(randomErrors(random));
  return {point, direction, AngleTable<6>::make(angles, errors, Between::linear).value()};
}

// B carries C; at calibrated angles the point is moved by exact rotations with the errors of both.
TEST(RotaryCorrection, FollowsThePointOfATableWithTwoAxes) {
  std::mt19937_64 random{7};
  std::vector<SixErrors> b_errors;
  std::vector<SixErrors> c_errors;
  const std::array<CalibratedAxis, 2> axes{randomAxis(random, {5, 0, -40}, Vector3d::UnitY(), b_errors),
                                           randomAxis(random, {1, 2, 0}, Vector3d::UnitZ(), c_errors)};
  const auto correction = RotaryCorrection::of(axes);
  ASSERT_TRUE(correction.ok());
  for (int trial = 0; trial < 100; ++trial) {
    const auto b = static_cast<std::size_t>(trial) % 12;
    const auto c = static_cast<std::size_t>(trial * 7) % 12;
    const Vector3d point{uniform(random, -150, 150), uniform(random, -150, 150), uniform(random, 0, 100)};
    Vector3d real = point;
    Vector3d ideal = point;
    for (const std::size_t k : {1U, 0U}) {
      const double angle = kTurn * static_cast<double>(k == 1 ? c : b) / 12.0;
      const SixErrors& errors = k == 1 ? c_errors[c] : b_errors[b];
      const Vector3d tilt = errors.tail<3>();
      const AngleAxisd turn{angle, axes[k].direction};
      real = axes[k].point + errors.head<3>() +
             AngleAxisd{tilt.norm(), tilt.normalized()} * (turn * (real - axes[k].point));
      ideal = axes[k].point + turn * (ideal - axes[k].point);
    }
    const std::array<std::optional<double>, 2> angles{kTurn * static_cast<double>(b) / 12.0,
                                                      kTurn * static_cast<double>(c) / 12.0};
    EXPECT_LT((*correction->at(angles, point) - (real - ideal)).norm(), 5e-6) << "second order of 20 um";
  }
}

TEST(RotaryCorrection, IsInvalidWithoutItsInputs) {
  std::mt19937_64 random{8};
  std::vector<SixErrors> errors;
  const std::array<CalibratedAxis, 1> axes{randomAxis(random, Vector3d::Zero(), Vector3d::UnitZ(), errors)};
  const auto correction = RotaryCorrection::of(axes);
  const std::array<std::optional<double>, 1> known{0.5};
  const std::array<std::optional<double>, 1> unknown{std::nullopt};
  EXPECT_TRUE(correction->at(known, {1, 2, 3}).has_value());
  EXPECT_FALSE(correction->at(unknown, {1, 2, 3}).has_value());
  EXPECT_FALSE(correction->at({}, {1, 2, 3}).has_value());
  EXPECT_FALSE(correction->at(known, {1, kNone, 3}).has_value());
  EXPECT_EQ(RotaryCorrection::of({}).error().name, "too-many-axes");
}

TEST(LiveCorrections, AllocateNothingAtATick) {
  std::mt19937_64 random{9};
  std::vector<SixErrors> errors;
  const std::array<CalibratedAxis, 2> axes{
      randomAxis(random, {0, 0, -40}, Vector3d::UnitY(), errors),
      CalibratedAxis{Vector3d::Zero(), Vector3d::UnitZ(),
                     AngleTable<6>::make(evenAngles(12, 0.0), errors, Between::fourier).value()}};
  const auto rotary = RotaryCorrection::of(axes);
  const SwivelCorrection swivel{SwivelTerms{.sine = {1, 2, 3}, .rest_per_mm = {1, 2, 3}}};
  Vector3d sum = Vector3d::Zero();
  const support::NoAlloc guard;
  for (int tick = 0; tick < 1000; ++tick) {
    const std::array<std::optional<double>, 2> angles{0.001 * tick, -0.002 * tick};
    sum += *rotary->at(angles, {10, 20, 30}) + *swivel.at(0.001 * tick, 120.0);
  }
  EXPECT_EQ(guard.allocations(), 0U);
  EXPECT_TRUE(sum.allFinite());
}

}  // namespace
}  // namespace probebox::metrology
