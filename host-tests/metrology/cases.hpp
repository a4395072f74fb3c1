#pragma once
#include <Eigen/Core>
#include <cmath>
#include <functional>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <initializer_list>
#include <random>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "firmware/metrology/solve.hpp"
#include "host-tests/metrology/exact_machine.hpp"
#include "host-tests/metrology/moments.hpp"

// Shared by the tests of methods: making datasets, and judging answers against a truth.
namespace probebox::metrology {

inline double uniform(std::mt19937_64& random, double low, double high) {
  return std::uniform_real_distribution<double>{low, high}(random);
}

inline double gauss(std::mt19937_64& random, double sigma) {
  return sigma * std::normal_distribution<double>{0.0, 1.0}(random);
}

inline Eigen::Vector3d anywhere(std::mt19937_64& random, double size) {
  return {uniform(random, -size, size), uniform(random, -size, size), uniform(random, -size, size)};
}

inline Table& addTable(Dataset& dataset, std::string name, std::initializer_list<std::string_view> columns) {
  dataset.tables.push_back(Table::withColumns(std::move(name), columns));
  return dataset.tables.back();
}

inline Table& tableNamed(Dataset& dataset, std::string_view name) {
  for (auto& table : dataset.tables) {
    if (table.name == name) return table;
  }
  throw std::out_of_range{std::string{name}};
}

inline std::vector<double>& columnNamed(Dataset& dataset, std::string_view table, std::string_view name) {
  for (auto& column : tableNamed(dataset, table).columns) {
    if (column.name == name) return column.values;
  }
  throw std::out_of_range{std::string{name}};
}

// Keeps the rows for which `which` says so.
inline void keepRows(Table& table, const std::function<bool(std::size_t)>& which) {
  std::vector<std::size_t> rows;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    if (which(row)) rows.push_back(row);
  }
  for (auto& column : table.columns) {
    std::vector<double> kept;
    for (const auto row : rows) kept.push_back(column.values[row]);
    column.values = std::move(kept);
  }
}

inline std::string refusalOf(const Dataset& dataset) {
  const auto solved = solve(dataset);
  return solved.ok() ? "" : solved.error().name;
}

inline double tauOf(const Dataset& dataset) {
  const auto solved = solve(dataset);
  EXPECT_TRUE(solved.ok()) << solved.error().reason;
  return solved.ok() ? solved->find("tau_s")->value() : std::nan("");
}

// Over many trials: errors against the stated sd, and against the smallest sd that the data allow.
struct Judgement {
  Moments pulls;
  double bound_squares{};
  double bound_count{};

  void add(double error, double sd, double bound) {
    pulls.add(error, sd);
    bound_squares += error * error / (bound * bound);
    bound_count += 1.0;
  }
  double efficiency() const { return bound_count / bound_squares; }
};

// Expects an unbiased, efficient estimate whose stated sd agrees with its errors.
inline void expectHonest(const Judgement& judgement, double least_efficiency = 0.9) {
  EXPECT_THAT(judgement.efficiency(), testing::AllOf(testing::Gt(least_efficiency), testing::Lt(1.15)));
  expectHonest(judgement.pulls);
  EXPECT_LT(std::abs(judgement.pulls.bias()), 4.0);
}

}  // namespace probebox::metrology
