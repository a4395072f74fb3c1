// Doubts about the gain of a screw: tables of true errors that it does not explain.
#include "firmware/metrology/screw/gain_check.hpp"

#include <algorithm>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <string_view>
#include <vector>

#include "host-tests/metrology/cases.hpp"

namespace probebox::metrology {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

constexpr auto kNotAlone = "do not follow K alone";
constexpr auto kOutside = "outside 0.3 to 3";

struct Heated {
  double length_mm{820}, offset_mm{60}, k{0.95}, noise_um{0.3};
  std::vector<double> extensions_um{12, 24, 36, 48};
  std::vector<double> places_mm{0, 200, 430, 700};
};

Table gainTable(const Heated& heated, std::mt19937_64& random) {
  Table table = Table::withColumns("gain_cal", std::vector<std::string_view>{"x_mm", "ext_um", "error_um"});
  for (const double ext_um : heated.extensions_um) {
    for (const double x_mm : heated.places_mm) {
      const double error_um = heated.k * (x_mm + heated.offset_mm) / heated.length_mm * ext_um;
      table.append({x_mm, ext_um, error_um + gauss(random, heated.noise_um)});
    }
  }
  return table;
}

std::vector<double>& columnIn(Table& table, std::string_view name) {
  return std::ranges::find(table.columns, name, &Column::name)->values;
}

std::vector<std::string> doubtsOf(const Table& table, const Heated& heated) {
  ScrewModel screw;
  screw.length_mm = heated.length_mm;
  screw.offset_mm = heated.offset_mm;
  const auto rows = static_cast<Eigen::Index>(table.rows());
  Eigen::MatrixXd design{rows, 1};
  Eigen::VectorXd errors{rows};
  for (Eigen::Index k = 0; k < rows; ++k) {
    const auto row = static_cast<std::size_t>(k);
    design(k, 0) = leverOf(screw, (*table.column("x_mm"))[row]) * (*table.column("ext_um"))[row];
    errors[k] = (*table.column("error_um"))[row];
  }
  const auto fit = linearLeastSquares(design, errors);
  return gainDoubts(table, screw, fit.value());
}

TEST(GainCheck, DoubtsOneHonestTableInAThousand) {
  std::mt19937_64 random{41};
  const std::vector<Heated> kinds{{}, {.places_mm = {300}}, {.extensions_um = {10, 60}, .places_mm = {0, 700}}};
  for (const Heated& kind : kinds) {
    int doubted = 0;
    constexpr int kTrials = 10000;
    for (int trial = 0; trial < kTrials; ++trial) {
      Heated heated = kind;
      heated.k = uniform(random, 0.6, 1.4);
      doubted += doubtsOf(gainTable(heated, random), heated).empty() ? 0 : 1;
    }
    EXPECT_LT(doubted, 25) << "10 expected";
  }
}

TEST(GainCheck, DoubtsExtensionsOfOneGroupInAnotherUnit) {
  std::mt19937_64 random{42};
  const Heated heated;
  Table table = gainTable(heated, random);
  EXPECT_THAT(doubtsOf(table, heated), IsEmpty());
  for (std::size_t row = 12; row < 16; ++row) columnIn(table, "ext_um")[row] *= 10;
  EXPECT_THAT(doubtsOf(table, heated), AllOf(Contains(HasSubstr(kNotAlone)), Contains(HasSubstr(kOutside))));
}

TEST(GainCheck, DoubtsColumnsThatAreExchanged) {
  std::mt19937_64 random{43};
  const Heated heated;
  for (const auto* other : {"error_um", "x_mm"}) {
    Table table = gainTable(heated, random);
    std::swap(columnIn(table, "ext_um"), columnIn(table, other));
    EXPECT_THAT(doubtsOf(table, heated), Contains(HasSubstr(kNotAlone))) << other;
  }
}

TEST(GainCheck, DoubtsFewErrorsThatShareOne) {
  std::mt19937_64 random{46};
  constexpr std::size_t kRows = 7;
  int doubted = 0;
  constexpr int kTrials = 100;
  for (int trial = 0; trial < kTrials; ++trial) {
    const Heated heated{.extensions_um = {15, 48}};
    Table table = gainTable(heated, random);
    for (auto& column : table.columns) column.values.resize(kRows);
    EXPECT_THAT(doubtsOf(table, heated), IsEmpty());
    for (double& error_um : columnIn(table, "error_um")) error_um += 10;
    doubted += doubtsOf(table, heated).empty() ? 0 : 1;
  }
  EXPECT_GT(doubted, 90);
}

TEST(GainCheck, DoubtsAGainThatNoScrewHas) {
  std::mt19937_64 random{44};
  for (const double k : {0.29, -0.29, 3.1, -3.1}) {
    const Heated heated{.k = k, .noise_um = 0.01};
    EXPECT_THAT(doubtsOf(gainTable(heated, random), heated), Contains(HasSubstr(kOutside))) << k;
  }
  for (const double k : {0.31, -0.31, 2.9, -2.9}) {
    const Heated heated{.k = k, .noise_um = 0.01};
    EXPECT_THAT(doubtsOf(gainTable(heated, random), heated), Not(Contains(HasSubstr(kOutside)))) << k;
  }
}

TEST(GainCheck, HasNoDoubtAboutExactErrors) {
  std::mt19937_64 random{45};
  const Heated heated{.noise_um = 0};
  EXPECT_THAT(doubtsOf(gainTable(heated, random), heated), IsEmpty());
}

}  // namespace
}  // namespace probebox::metrology
