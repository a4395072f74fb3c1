// A spindle and a C axis whose angles stand in each other's columns: the ball's offset comes out as that of the stylus.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tuple>
#include <utility>
#include <vector>

#include "host-tests/metrology/cases.hpp"
#include "host-tests/metrology/mill_turn.hpp"

namespace probebox::metrology {
namespace {

TEST(FarStylus, IsRefusedWhereTheAnglesAreExchanged) {
  Machine machine;
  machine.ball = {19.1, 11.4, 80.0};
  machine.stylus = {0.05, -0.02};
  for (const auto& [method, lever, lengths] :
       {std::tuple{"spindle-offset-2x2", "", std::vector{0.0}}, std::tuple{"spindle-offset-four", "", std::vector{0.0}},
        std::tuple{"a-axis-alignment", "tip_length_mm", std::vector{100.0, 150.0}}}) {
    auto rows = grid(lengths, kOpposed, kOpposed);
    for (auto& row : rows) row.at = machine.reading(row.spindle, row.c, row.lever).head<2>();
    EXPECT_EQ(refusalOf(ballDataset(method, lever, rows, 1e-3)), "") << method;
    for (auto& row : rows) std::swap(row.spindle, row.c);
    const auto solved = solve(ballDataset(method, lever, rows, 1e-3));
    ASSERT_FALSE(solved) << method;
    EXPECT_EQ(solved.error().name, "implausible");
    EXPECT_THAT(solved.error().reason, testing::AllOf(testing::HasSubstr("A_rad"), testing::HasSubstr("C_rad"),
                                                      testing::HasSubstr("exchanged")));
  }
}

}  // namespace
}  // namespace probebox::metrology
