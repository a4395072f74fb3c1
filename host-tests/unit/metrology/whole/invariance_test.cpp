// What no method may notice: where the machine's zero is, which way its X points, the order of readings, the unit of
// length. Noisy readings, so that the fit has something to weigh.
#include <Eigen/Geometry>
#include <algorithm>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <map>
#include <numbers>
#include <rapidcheck/gtest.h>

#include "host-tests/metrology/cases.hpp"
#include "protocol/units/angle.hpp"

namespace probebox::metrology {
namespace {

using Eigen::AngleAxisd;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kSigma = 0.001;

// How an answer follows when all positions move by v.
enum class Follows { no, xy, yz, xyz, x };

struct Setup {
  Dataset dataset;
  std::map<std::string, Follows, std::less<>> follows;
};

Vector3d blurred(const Vector3d& at, std::mt19937_64& random) {
  return at + Vector3d{gauss(random, kSigma), gauss(random, kSigma), gauss(random, kSigma)};
}

Dataset emptyDataset(const char* method) {
  return {.method = method, .config = {{"sigma_mm", kSigma}}, .tables = {}};
}

Vector3d onChuck(double a, double c, double lever) {
  const Vector3d o{0.3 + 2e-4 * lever, -0.2, 0};
  return o + AngleAxisd{c, Vector3d::UnitZ()} * Vector3d{20, 5, 0} -
         AngleAxisd{a, Vector3d::UnitZ()} * Vector3d{0.03, -0.02, 0};
}

Setup spindle(const char* method, const char* lever, Follows offset, const char* key, std::mt19937_64& random) {
  Setup setup{emptyDataset(method), {{key, offset}, {"centre_mm", Follows::xy}, {"stylus_offset_mm", Follows::no}}};
  Table& readings = *lever ? addTable(setup.dataset, "readings", {"A_rad", "C_rad", "x_mm", "y_mm", lever})
                           : addTable(setup.dataset, "readings", {"A_rad", "C_rad", "x_mm", "y_mm"});
  for (const double height : *lever ? std::vector<double>{50, 120, 200} : std::vector<double>{0}) {
    for (const double a : {0.0, std::numbers::pi}) {
      for (const double c : {0.0, std::numbers::pi}) {
        const Vector3d at = blurred(onChuck(a, c, height), random);
        if (*lever) readings.append({a, c, at.x(), at.y(), height});
        if (!*lever) readings.append({a, c, at.x(), at.y()});
      }
    }
  }
  return setup;
}

Setup turned(const char* method, const char* angle, double sense, std::mt19937_64& random) {
  Setup setup{emptyDataset(method),
              {{"centre_mm", Follows::xy}, {"radius_mm", Follows::no}, {"psi0_rad", Follows::no}}};
  setup.dataset.config["sigma_C_rad"] = 1e-5;
  Table& readings = addTable(setup.dataset, "readings", {angle, "x_mm", "y_mm"});
  for (const double c : {-0.7, -0.3, 0.0, 0.4, 0.7}) {
    const Vector3d at =
        blurred(Vector3d{0.4, -0.3, 0} + AngleAxisd{sense * c, Vector3d::UnitZ()} * Vector3d{3, 400, 0}, random);
    readings.append({c, at.x(), at.y()});
  }
  return setup;
}

Setup tilting(const char* method, std::mt19937_64& random) {
  Setup setup{emptyDataset(method), {{"pivot_yz_mm", Follows::yz}, {"lean_yz_rad", Follows::no}}};
  setup.dataset.config["tilt_axis"] = std::vector<double>{1, 0, 0};
  Table& readings = addTable(setup.dataset, "readings", {"tilt_deg", "C_deg", "x_mm", "y_mm", "z_mm"});
  const AngleAxisd leaning{0.002, Vector3d::UnitZ()};
  for (const double tilt : {-80.0, -30.0, 20.0}) {
    for (const double c : {0.0, 180.0}) {
      const Vector3d arm = Vector3d{c == 0.0 ? 40.0 : -40.0, 10.0, 200.0};
      const Vector3d at =
          blurred(Vector3d{1, -12, 45} + AngleAxisd{tilt * kDegree, leaning * Vector3d::UnitX()} * arm, random);
      readings.append({tilt, c, at.x(), at.y(), at.z()});
    }
  }
  return setup;
}

Setup swivelling(const char* method, std::mt19937_64& random) {
  Setup setup{emptyDataset(method),
              {{"error_at_queries_mm", Follows::no}, {"pivot_xz_mm", Follows::no}, {"lean_xz_rad", Follows::no}}};
  const bool pivot = setup.dataset.method != "swivel-error";
  setup.dataset.config["swivel_axis"] = std::vector<double>{0, 1, 0};
  if (pivot) setup.dataset.config["ball_mm"] = std::vector<double>{5, -4, 60};
  Table& readings = addTable(setup.dataset, "readings", {"B_deg", pivot ? "A_deg" : "L_mm", "x_mm", "y_mm", "z_mm"});
  for (const double b : {0.0, 45.0, 90.0}) {
    for (const double other : {0.0, 180.0}) {
      const AngleAxisd swivel{b * kDegree, Vector3d::UnitY()};
      const Vector3d arm = pivot ? Vector3d{other == 0.0 ? 0.05 : -0.05, 8.0 - other / 10.0, 150.0}
                                 : Vector3d{0.01, 0.004, 0.02 + 2e-4 * other};
      const Vector3d at = blurred(Vector3d{5, -4, 60} - swivel * arm, random);
      readings.append({b, pivot ? other : 100.0 + other, at.x(), at.y(), at.z()});
    }
  }
  if (!pivot) addTable(setup.dataset, "queries", {"B_deg", "L_mm"}).append({30.0, 150.0});
  return setup;
}

Setup roundFeature(const char* method, std::mt19937_64& random) {
  Setup setup{emptyDataset(method),
              {{"centre_mm", Follows::xyz},
               {"centre_xy_mm", Follows::xy},
               {"radius_mm", Follows::no},
               {"effective_radius_mm", Follows::no}}};
  const bool sphere = setup.dataset.method == "sphere-fit";
  Table& points = addTable(setup.dataset, "points", {"x_mm", "y_mm", "z_mm"});
  for (int k = 0; k < 9; ++k) {
    const Vector3d normal{std::cos(0.7 * k), std::sin(0.7 * k), sphere ? 0.1 * k : 0.0};
    const Vector3d at = blurred(Vector3d{10, -20, 30} + 15.0 * (sphere ? normal.normalized() : normal), random);
    points.append({at.x(), at.y(), at.z()});
  }
  return setup;
}

Setup faces(const char* method, std::mt19937_64& random) {
  Setup setup{emptyDataset(method),
              {{"middle_mm", Follows::x},
               {"width_mm", Follows::no},
               {"effective_width_mm", Follows::no},
               {"corner_xy_mm", Follows::xy}}};
  setup.dataset.config["stylus_ball_radius_mm"] = 1.0;
  const bool corner = setup.dataset.method == "corner-fit";
  if (!corner) setup.dataset.config["width_direction"] = std::vector<double>{1, 0, 0};
  Table points = Table::withColumns("points", std::array<std::string_view, 4>{"face", "x_mm", "y_mm", "z_mm"});
  for (const double along : {5.0, 15.0, 30.0}) {
    const Vector3d first = blurred(Vector3d{31, -along, 0}, random);
    const Vector3d second = blurred(corner ? Vector3d{30 - along, 1, 0} : Vector3d{-31, -along, 0}, random);
    points.append({1.0, first.x(), first.y(), first.z()});
    points.append({2.0, second.x(), second.y(), second.z()});
  }
  setup.dataset.tables.push_back(std::move(points));
  if (!corner) return setup;
  Table& normals = addTable(setup.dataset, "faces", {"face", "nx", "ny", "nz"});
  normals.append({1, 1, 0, 0});
  normals.append({2, 0, 1, 0});
  return setup;
}

Setup toolSetter(std::mt19937_64& random) {
  Setup setup{emptyDataset("tool-setter"), {{"tool_offset_mm", Follows::no}, {"setter_mm", Follows::xyz}}};
  setup.dataset.config["probe_offset_mm"] = std::vector<double>{0.1, 0.2, 200.0};
  Table& readings = addTable(setup.dataset, "readings", {"is_tool", "x_mm", "y_mm", "z_mm"});
  for (const double tool : {0.0, 1.0, 0.0, 1.0}) {
    const Vector3d at = blurred(Vector3d{-190, 20, tool * 70 - 180}, random);
    readings.append({tool, at.x(), at.y(), at.z()});
  }
  return setup;
}

Setup rotaryAxis(std::mt19937_64& random) {
  Setup setup{emptyDataset("rotary-axis-errors"),
              {{"six_errors", Follows::no}, {"location_mm", Follows::no}, {"tilt_rad", Follows::no}}};
  setup.dataset.config["axis_point_mm"] = std::vector<double>{3, 4, 5};
  setup.dataset.config["axis_direction"] = std::vector<double>{0, 0, 1};
  constexpr std::array<std::string_view, 4> kBall{"ball", "x_mm", "y_mm", "z_mm"};
  Table first = Table::withColumns("first", std::array<std::string_view, 5>{"phi_rad", "ball", "x_mm", "y_mm", "z_mm"});
  Table second = Table::withColumns("second", kBall);
  Table third = Table::withColumns("plate", kBall);
  third.name = "third";
  for (double ball = 0.0; ball < 5.0; ++ball) {
    const Vector3d q{120 * std::cos(1.2 * ball), 120 * std::sin(1.2 * ball), ball == 2.0 ? 60.0 : 40.0};
    third.append({ball, q.x(), q.y(), q.z()});
    const Vector3d p2 = blurred(q + Vector3d{3, 4, 5}, random);
    second.append({ball, p2.x(), p2.y(), p2.z()});
    for (const double phi : {0.0, 1.5, 3.0, 4.5}) {
      const Vector3d p1 = blurred(AngleAxisd{phi, Vector3d::UnitZ()} * q + Vector3d{3, 4, 5}, random);
      first.append({phi, ball, p1.x(), p1.y(), p1.z()});
    }
  }
  setup.dataset.tables = {std::move(first), std::move(second), std::move(third)};
  return setup;
}

std::vector<Setup> setups(std::mt19937_64& random) {
  return {spindle("spindle-offset-2x2", "", Follows::xy, "offset_C_minus_A_mm", random),
          spindle("c-axis-alignment", "z_mm", Follows::no, "C_tilt_rad", random),
          spindle("a-axis-alignment", "tip_length_mm", Follows::no, "A_tilt_rad", random),
          turned("centreline", "C_rad", 1.0, random),
          turned("centreline-limited-access", "C_rad_clockwise_from_plus_y", -1.0, random),
          tilting("table-pivot", random),
          tilting("table-pivot-3d", random),
          swivelling("swivel-error", random),
          swivelling("head-pivot", random),
          swivelling("head-pivot-3d", random),
          roundFeature("sphere-fit", random),
          roundFeature("boss-fit", random),
          roundFeature("bore-fit", random),
          faces("web-fit", random),
          faces("pocket-fit", random),
          faces("corner-fit", random),
          toolSetter(random),
          rotaryAxis(random)};
}

Result answerOf(const Dataset& dataset) {
  auto solved = solve(dataset);
  EXPECT_TRUE(solved.ok()) << dataset.method << ": " << solved.error().reason;
  return std::move(solved).value();
}

// Moves columns and keys that are positions in the machine.
Dataset moved(Dataset dataset, const Vector3d& by) {
  constexpr std::array<std::string_view, 3> kAxes{"x_mm", "y_mm", "z_mm"};
  for (auto& table : dataset.tables) {
    if (table.name == "third") continue;  // the plate's own frame
    for (std::size_t k = 0; k < 3; ++k) {
      for (auto& column : table.columns) {
        if (column.name != kAxes[k] || (k == 2 && dataset.method == "c-axis-alignment")) continue;
        for (double& value : column.values) value += by[static_cast<Eigen::Index>(k)];
      }
    }
  }
  for (const char* key : {"ball_mm", "axis_point_mm"}) {
    const auto entry = dataset.config.find(key);
    if (entry == dataset.config.end()) continue;
    auto& place = std::get<std::vector<double>>(entry->second);
    for (std::size_t k = 0; k < 3; ++k) place[k] += by[static_cast<Eigen::Index>(k)];
  }
  return dataset;
}

double shiftOf(Follows follows, const Vector3d& by, std::size_t component) {
  const auto k = static_cast<Eigen::Index>(component);
  if (follows == Follows::no) return 0.0;
  if (follows == Follows::yz) return by[k + 1];
  return by[k];
}

TEST(Invariance, MovingTheSetUpMovesPlacesAndNothingElse) {
  std::mt19937_64 random{1};
  const Vector3d by{123.0, -77.0, 31.0};
  for (const auto& setup : setups(random)) {
    const Result before = answerOf(setup.dataset);
    const Result after = answerOf(moved(setup.dataset, by));
    for (std::size_t e = 0; e < before.estimates.size(); ++e) {
      const auto follows = setup.follows.find(before.estimates[e].key);
      ASSERT_NE(follows, setup.follows.end())
          << before.method << ", " << before.estimates[e].key << ": say how it follows";
      for (std::size_t k = 0; k < before.estimates[e].values.size(); ++k) {
        EXPECT_NEAR(after.estimates[e].values[k], before.estimates[e].values[k] + shiftOf(follows->second, by, k), 1e-8)
            << before.method << ", " << before.estimates[e].key;
        EXPECT_NEAR(after.estimates[e].sd[k], before.estimates[e].sd[k], 1e-9) << before.method;
      }
    }
  }
}

RC_GTEST_PROP(Invariance, TheOrderOfReadingsDoesNotMatter, ()) {
  std::mt19937_64 random{*rc::gen::arbitrary<std::uint64_t>()};
  for (auto& setup : setups(random)) {
    const Result before = answerOf(setup.dataset);
    for (auto& table : setup.dataset.tables) {
      if (table.name == "queries" || table.name == "faces") continue;  // they give the order of the answer
      std::vector<std::size_t> order(table.rows());
      for (std::size_t k = 0; k < order.size(); ++k) order[k] = k;
      std::ranges::shuffle(order, random);
      for (auto& column : table.columns) {
        const auto values = column.values;
        for (std::size_t k = 0; k < order.size(); ++k) column.values[k] = values[order[k]];
      }
    }
    const Result after = answerOf(setup.dataset);
    for (std::size_t e = 0; e < before.estimates.size(); ++e) {
      for (std::size_t k = 0; k < before.estimates[e].values.size(); ++k) {
        RC_ASSERT(std::abs(after.estimates[e].values[k] - before.estimates[e].values[k]) < 1e-9);
      }
    }
  }
}

TEST(Invariance, TheUnitOfLengthDoesNotMatter) {
  std::mt19937_64 random{2};
  constexpr double kFactor = 3.7;
  for (auto& setup : setups(random)) {
    const bool six = setup.dataset.method == "rotary-axis-errors";  // one matrix of lengths and angles
    const Result before = answerOf(setup.dataset);
    for (auto& table : setup.dataset.tables) {
      for (auto& column : table.columns) {
        if (!column.name.ends_with("_mm")) continue;
        for (double& value : column.values) value *= kFactor;
      }
    }
    for (auto& [key, value] : setup.dataset.config) {
      if (!key.ends_with("_mm")) continue;
      if (auto* number = std::get_if<double>(&value)) *number *= kFactor;
      if (auto* list = std::get_if<std::vector<double>>(&value)) {
        for (double& entry : *list) entry *= kFactor;
      }
    }
    const Result after = answerOf(setup.dataset);
    for (std::size_t e = 0; e < before.estimates.size(); ++e) {
      const bool length = before.estimates[e].key.ends_with("_mm");
      for (std::size_t k = 0; k < before.estimates[e].values.size(); ++k) {
        const bool translation = six && before.estimates[e].key == "six_errors" && k % 6 < 3;
        const double factor = length || translation ? kFactor : 1.0;
        EXPECT_NEAR(after.estimates[e].values[k], factor * before.estimates[e].values[k], 1e-8) << before.method;
        EXPECT_NEAR(after.estimates[e].sd[k], factor * before.estimates[e].sd[k], 1e-9) << before.method;
      }
    }
  }
}

// About Z, which is where C and the spindle turn: answers in the plane turn along.
TEST(Invariance, TurningTheSetUpTurnsTheAnswer) {
  std::mt19937_64 random{3};
  const Eigen::Rotation2Dd turn{0.8};
  for (auto& setup : setups(random)) {
    const std::string& method = setup.dataset.method;
    const bool plane = method == "spindle-offset-2x2" || method == "c-axis-alignment" || method == "a-axis-alignment" ||
                       method == "centreline" || method == "sphere-fit" || method == "boss-fit";
    if (!plane) continue;
    const Result before = answerOf(setup.dataset);
    Table& table = setup.dataset.tables[0];
    auto& x = columnNamed(setup.dataset, table.name, "x_mm");
    auto& y = columnNamed(setup.dataset, table.name, "y_mm");
    for (std::size_t k = 0; k < x.size(); ++k) {
      const Vector2d at = turn * Vector2d{x[k], y[k]};
      x[k] = at.x();
      y[k] = at.y();
    }
    const auto& values = before.estimates[0].values;
    const auto after = answerOf(setup.dataset).estimates[0].values;
    const Vector2d expected = turn * Vector2d{values[0], values[1]};
    EXPECT_NEAR(after[0], expected.x(), 1e-9) << method;
    EXPECT_NEAR(after[1], expected.y(), 1e-9) << method;
  }
}

}  // namespace
}  // namespace probebox::metrology
