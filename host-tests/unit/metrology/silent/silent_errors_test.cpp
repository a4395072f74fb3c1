// Ordinary errors of machine and probe in cases of all methods: few answers are wrong without a word, warnings name the
// error, and cases without errors are left alone. bin/silent-errors counts the same by method and error.
#include <algorithm>
#include <cctype>
#include <gtest/gtest.h>
#include <string>
#include <vector>

#include "host-tests/silent/count.hpp"
#include "host-tests/support/runs.hpp"

namespace probebox::metrology::silent {
namespace {

// Of the cases with a warning: one error of a few methods has no name yet, see docs/reliability.md.
constexpr double kLeastNamed = 0.4;
constexpr double kMostSilent = 0.02;

std::vector<World> worlds() {
  std::vector<World> all;
  for (const auto of : {worldsOfTouches(), worldsOfPlaces()}) all.insert(all.end(), of.begin(), of.end());
  return all;
}

class ErrorsIn : public testing::TestWithParam<World> {};

TEST_P(ErrorsIn, AreSeldomSilent) {
  if (GetParam().is_long && !runsAreComplete()) GTEST_SKIP() << "seen with tools/test --all";
  const std::uint64_t cases = runsAreComplete() ? 24 : 5;
  Cell all, clean;
  for (const auto& error : errorKinds()) {
    const Cell cell = count(GetParam(), error, cases);
    (error.err == Err::none ? clean : all).add(cell);
    EXPECT_LE(cell.silent, cases / 2) << error.name;
  }
  ASSERT_GT(all.cases, 3 * cases);
  EXPECT_LE(static_cast<double>(all.silent), std::max(2.0, kMostSilent * static_cast<double>(all.cases)));
  EXPECT_LE(clean.told, runsAreComplete() ? 2U : 1U) << "of " << clean.cases << " without an error";
  if (!runsAreComplete()) return;
  EXPECT_GE(static_cast<double>(all.named), kLeastNamed * static_cast<double>(all.told));
}

INSTANTIATE_TEST_SUITE_P(Methods, ErrorsIn, testing::ValuesIn(worlds()), [](const auto& each) {
  std::string name{each.param.name};
  std::erase_if(name, [](unsigned char c) { return std::isalnum(c) == 0; });
  return name;
});

}  // namespace
}  // namespace probebox::metrology::silent
