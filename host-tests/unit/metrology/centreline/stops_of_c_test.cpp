// What a stop of C is off moves the ball along one direction only, and all that is read at that stop alike.
#include <algorithm>
#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <string>
#include <vector>

#include "firmware/metrology/centreline/ball_readings.hpp"
#include "host-tests/metrology/cases.hpp"
#include "host-tests/metrology/fisher.hpp"
#include "host-tests/metrology/mill_turn.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Vector2d;
using Eigen::VectorXd;

// Readings as a function of the unknowns and of what every stop of C is off, rad.
using ObserveStops = std::function<VectorXd(const VectorXd& unknowns, const VectorXd& off)>;

// The least covariance of the unknowns where each stop is off by sigma_c.
Eigen::MatrixXd boundWithStops(const ObserveStops& observe, const VectorXd& unknowns, Eigen::Index stops, double sigma,
                               double sigma_c) {
  VectorXd all{unknowns.size() + stops};
  all << unknowns, VectorXd::Zero(stops);
  const auto observeAll = [&](const VectorXd& p) {
    const VectorXd off = p.tail(stops);
    const VectorXd readings = observe(p.head(unknowns.size()), off);
    VectorXd values{readings.size() + stops};
    values << readings, off * sigma / sigma_c;
    return values;
  };
  return smallestCovariance(observeAll, all, sigma).topLeftCorner(unknowns.size(), unknowns.size());
}

VectorXd drawn(std::mt19937_64& random, Eigen::Index count, double sigma) {
  VectorXd values{count};
  for (double& value : values) value = gauss(random, sigma);
  return values;
}

// Angles at which the ball moves between a third and three sd of a reading.
double sigmaOfStop(std::mt19937_64& random, const Machine& machine, double sigma) {
  return sigma / machine.ball.head<2>().norm() * std::pow(3.0, uniform(random, -1, 1));
}

// The stop of every row, where C stands until it has another angle.
std::vector<double> stopsInOrder(const std::vector<Row>& rows) {
  std::vector<double> stops;
  for (std::size_t k = 0; k < rows.size(); ++k)
    stops.push_back(k == 0 ? 0 : stops.back() + (rows[k].c != rows[k - 1].c ? 1 : 0));
  return stops;
}

Eigen::Index count(const std::vector<double>& stops) {
  return 1 + static_cast<Eigen::Index>(std::ranges::max(stops));
}

double offAt(const VectorXd& off, double stop) {
  return off[static_cast<Eigen::Index>(stop)];
}

TEST(StopsOfC, LeaveWhatSpindleOffset2x2States) {
  std::mt19937_64 random{71};
  Judgement across, offset, stylus;
  for (int trial = 0; trial < 800; ++trial) {
    Machine machine = randomMachine(random, 0.0);
    if (trial % 2 == 0) machine.ball.y() = 0;  // every stop moves Y alone
    const double sigma = uniform(random, 2e-4, 5e-3), sigma_c = sigmaOfStop(random, machine, sigma);
    // C turns for every reading, or once.
    auto rows = grid({0.0}, kOpposed, kOpposed);
    if (trial % 4 < 2) std::ranges::stable_sort(rows, {}, &Row::spindle);
    const auto stops = stopsInOrder(rows);
    const auto observe = [&](const VectorXd& p, const VectorXd& off) {
      Machine at = machine;
      at.c_point.head<2>() = p.head<2>();
      at.ball.head<2>() = p.segment<2>(2);
      at.stylus = p.segment<2>(4);
      auto read = rows;
      for (std::size_t k = 0; k < rows.size(); ++k)
        read[k].at = at.reading(rows[k].spindle, rows[k].c + offAt(off, stops[k]), 0).head<2>();
      return stacked(read);
    };
    const VectorXd truth =
        (VectorXd{6} << machine.c_point.head<2>(), machine.ball.head<2>(), machine.stylus).finished();
    const auto bound = boundWithStops(observe, truth, count(stops), sigma, sigma_c);
    const VectorXd read = observe(truth, drawn(random, count(stops), sigma_c));
    for (std::size_t k = 0; k < rows.size(); ++k) rows[k].at = read.segment<2>(static_cast<Eigen::Index>(2 * k));
    blur(rows, sigma, random);
    Dataset dataset = ballDataset("spindle-offset-2x2", "", rows, sigma);
    dataset.config["sigma_C_rad"] = sigma_c;
    if (trial % 3 == 0) {  // in any order, where the stops are numbered
      dataset.tables.front().columns.push_back({std::string{kStop}, stops});
      for (auto& column : dataset.tables.front().columns) std::ranges::reverse(column.values);
    }
    const auto solved = solve(dataset);
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    const auto judge = [&](Judgement& judgement, const char* key, Eigen::Index first, std::size_t k) {
      const Eigen::Index at = first + static_cast<Eigen::Index>(k);
      judgement.add(solved->find(key)->values[k] - truth[at], solved->find(key)->sd[k], std::sqrt(bound(at, at)));
    };
    if (trial % 2 == 0) judge(across, "offset_C_minus_A_mm", 0, 0);
    for (const std::size_t k : {0U, 1U}) {
      judge(offset, "offset_C_minus_A_mm", 0, k);
      judge(stylus, "stylus_offset_mm", 4, k);
    }
  }
  expectHonest(across);
  expectHonest(offset);
  expectHonest(stylus);
}

TEST(StopsOfC, CancelInTheSlopeOfBallsThatAreReadAtOneStop) {
  std::mt19937_64 random{72};
  Moments slope, centre;
  for (int trial = 0; trial < 600; ++trial) {
    Machine machine = randomMachine(random, 4e-4);
    machine.spindle_tilt.setZero();
    const double sigma = uniform(random, 2e-4, 3e-3), sigma_c = sigmaOfStop(random, machine, sigma);
    auto rows = grid({80.0, 140.0, 200.0}, kOpposed, kOpposed);
    const VectorXd off = drawn(random, 2, sigma_c);
    std::vector<double> stops;
    for (auto& row : rows) {  // one holder, with a ball at each height
      machine.ball.z() = row.lever;
      stops.push_back(row.c == 0.0 ? 0 : 1);
      row.at = machine.reading(row.spindle, row.c + offAt(off, stops.back()), 100.0).head<2>();
    }
    blur(rows, sigma, random);
    Dataset dataset = ballDataset("c-axis-alignment", "z_mm", rows, sigma);
    dataset.config["sigma_C_rad"] = sigma_c;
    dataset.tables.front().columns.push_back({std::string{kStop}, stops});
    const auto solved = solve(dataset);
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    const Vector2d middle = machine.centreAt(solved->find("mean_z_mm")->value());
    for (const std::size_t k : {0U, 1U}) {
      const auto at = static_cast<Eigen::Index>(k);
      slope.add(solved->find("C_tilt_rad")->values[k] - machine.c_tilt[at], solved->find("C_tilt_rad")->sd[k]);
      centre.add(solved->find("centre_mm")->values[k] - middle[at], solved->find("centre_mm")->sd[k]);
      // Equal arms: all of it goes into the centre.
      EXPECT_NEAR(solved->find("C_tilt_rad")->sd[k], 0.5 * sigma / std::sqrt(2 * 60.0 * 60.0), 1e-3 * sigma / 60);
    }
  }
  expectHonest(slope);
  expectHonest(centre);
}

// A shank at the same stops as the tip, on the same ball or on the second one of its holder.
struct TipAndShank {
  std::vector<Row> tips{grid({180.0}, kOpposed, kOpposed)};
  std::vector<Row> touches;
  std::vector<Vector2d> sides;
  Vector2d second{0, 0};

  TipAndShank() {
    for (const auto& tip : tips) {
      for (const Vector2d& side : {Vector2d{1, 0}, Vector2d{-1, 0}, Vector2d{0, 1}, Vector2d{0, -1}}) {
        touches.push_back({110.0, tip.spindle, tip.c, {}});
        sides.push_back(side);
      }
    }
  }

  // Unknowns: C axis, spindle's direction times 100, ball, tip, the shank's run-out and the radii.
  VectorXd observe(Machine machine, const VectorXd& p, const VectorXd& off) const {
    machine.c_point.head<2>() = p.head<2>();
    machine.spindle_tilt = p.segment<2>(2) / 100.0;
    machine.ball.head<2>() = p.segment<2>(4);
    machine.stylus = p.segment<2>(6);
    VectorXd values{static_cast<Eigen::Index>(2 * tips.size() + touches.size())};
    Eigen::Index row = 0;
    for (const auto& tip : tips) {
      values.segment<2>(row) = machine.reading(tip.spindle, tip.c + offAt(off, stopOf(tip)), tip.lever).head<2>();
      row += 2;
    }
    machine.ball.head<2>() += second;
    machine.stylus = p.segment<2>(8);
    for (std::size_t k = 0; k < touches.size(); ++k) {
      const auto& touch = touches[k];
      const Vector2d at = machine.reading(touch.spindle, touch.c + offAt(off, stopOf(touch)), touch.lever).head<2>();
      values[row++] = sides[k].dot(at) + p[10];
    }
    return values;
  }

  static double stopOf(const Row& row) { return row.c == 0.0 ? 0 : 1; }

  Dataset dataset(const VectorXd& read, double sigma) const {
    auto seen = tips;
    for (std::size_t k = 0; k < tips.size(); ++k) seen[k].at = read.segment<2>(static_cast<Eigen::Index>(2 * k));
    Dataset all = ballDataset("a-axis-alignment", "tip_length_mm", seen, sigma);
    Table& shank = addTable(all, "shank", {"A_rad", "C_rad", "x_mm", "y_mm", "tip_length_mm", "ux", "uy", "stop"});
    for (std::size_t k = 0; k < touches.size(); ++k) {
      const Vector2d at = sides[k] * read[static_cast<Eigen::Index>(2 * tips.size() + k)];
      shank.append({touches[k].spindle, touches[k].c, at.x(), at.y(), touches[k].lever, sides[k].x(), sides[k].y(),
                    stopOf(touches[k])});
    }
    std::vector<double> stops;
    for (const auto& tip : tips) stops.push_back(stopOf(tip));
    Table& readings = tableNamed(all, "readings");
    readings.columns.push_back({std::string{kStop}, stops});
    if (second.norm() == 0) return all;
    readings.columns.push_back({"ball", std::vector<double>(tips.size(), 1.0)});
    tableNamed(all, "shank").columns.push_back({"ball", std::vector<double>(touches.size(), 2.0)});
    all.config["ball_offset_mm"] = std::vector<double>{second.x(), second.y(), 0};
    return all;
  }
};

TEST(StopsOfC, AreSharedByTipAndShank) {
  std::mt19937_64 random{73};
  Judgement judgement;
  for (int trial = 0; trial < 600; ++trial) {
    Machine machine = randomMachine(random, 3e-4);
    machine.c_tilt.setZero();
    const double sigma = uniform(random, 2e-4, 3e-3), sigma_c = sigmaOfStop(random, machine, sigma);
    TipAndShank both;
    if (trial % 2 == 0) both.second = {uniform(random, -60, 60), uniform(random, -60, 60)};
    VectorXd truth{11};
    truth << machine.c_point.head<2>(), 100.0 * machine.spindle_tilt, machine.ball.head<2>(), machine.stylus, 0.03,
        -0.02, 17.5;
    const auto observe = [&](const VectorXd& p, const VectorXd& off) { return both.observe(machine, p, off); };
    const auto bound = boundWithStops(observe, truth, 2, sigma, sigma_c);
    VectorXd read = observe(truth, drawn(random, 2, sigma_c));
    read += drawn(random, read.size(), sigma);
    Dataset dataset = both.dataset(read, sigma);
    dataset.config["sigma_C_rad"] = sigma_c;
    const auto solved = solve(dataset);
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    for (const std::size_t k : {0U, 1U}) {
      const auto at = static_cast<Eigen::Index>(k);
      judgement.add(solved->find("A_tilt_rad")->values[k] - machine.spindle_tilt[at], solved->find("A_tilt_rad")->sd[k],
                    std::sqrt(bound(at + 2, at + 2)) / 100.0);
    }
  }
  expectHonest(judgement);
}

TEST(StopsOfC, AreAsFarOffWhicheverOfTheirReadingsComesFirst) {
  std::mt19937_64 random{75};
  Dataset dataset{.method = "centreline", .config = {{"sigma_mm", 0.02}, {"sigma_C_rad", 1e-3}}, .tables = {}};
  Table& readings = addTable(dataset, "readings", {"C_rad", "x_mm", "y_mm"});
  for (const double c : {0.0, 2.0, 4.0}) {
    const double off = gauss(random, 1e-3);
    for (int k = 0; k < 3; ++k) {
      readings.append({c, 40 * std::cos(c + off) + gauss(random, 0.02), 40 * std::sin(c + off) + gauss(random, 0.02)});
    }
  }
  const auto centre = [&] {
    const auto solved = solve(dataset);
    EXPECT_TRUE(solved.ok()) << solved.error().reason;
    return solved->find("centre_mm")->values;
  };
  const auto before = centre();
  for (auto& column : tableNamed(dataset, "readings").columns) std::swap(column.values[0], column.values[2]);
  EXPECT_THAT(centre(), testing::Pointwise(testing::DoubleNear(1e-10), before));
}

TEST(StopsOfC, NeedASigmaOfReadings) {
  std::mt19937_64 random{74};
  const Machine machine = randomMachine(random, 0.0);
  auto rows = grid({0.0}, kOpposed, kOpposed);
  for (auto& row : rows) row.at = machine.reading(row.spindle, row.c, 0).head<2>();
  Dataset dataset = ballDataset("spindle-offset-2x2", "", rows, 0.001);
  dataset.config.erase("sigma_mm");
  dataset.config["sigma_C_rad"] = 1e-5;
  const auto solved = solve(dataset);
  ASSERT_TRUE(solved.ok()) << solved.error().reason;
  EXPECT_THAT(solved->warnings,
              testing::Contains(testing::AllOf(testing::HasSubstr("sigma_C_rad"), testing::HasSubstr("not used"))));
}

}  // namespace
}  // namespace probebox::metrology
