// Columns of the tables of every method, and what follows from their roles.
#include <algorithm>
#include <array>
#include <gtest/gtest.h>
#include <set>
#include <string>
#include <string_view>

#include "firmware/metrology/checks/plausible.hpp"
#include "firmware/metrology/methods.hpp"

namespace probebox::metrology {
namespace {

// The unit that a column of the role has; empty: any.
bool hasUnitOfRole(const MethodColumn& column) {
  switch (column.role) {
    case ColumnRole::stamp:
      return column.name.ends_with("_s");
    case ColumnRole::coordinate:
    case ColumnRole::set_coordinate:
      return column.name.ends_with("_mm");
    case ColumnRole::angle:
    case ColumnRole::rotation:
    case ColumnRole::contact_angle:
      return isInRadians(column.name) || isInDegrees(column.name);
    case ColumnRole::sensor:
    case ColumnRole::face:
      return column.name.ends_with("_um");
    default:
      return true;
  }
}

TEST(Columns, OfEveryMethodHaveARoleThatTheirUnitFits) {
  for (const Method* method : allMethods()) {
    for (const auto& table : method->tables) {
      std::set<std::string_view> names;
      for (const auto& column : table.columns) {
        const auto where = std::string{method->name} + ", " + std::string{table.name} + ", " + std::string{column.name};
        EXPECT_NE(column.role, ColumnRole::none) << where;
        EXPECT_TRUE(hasUnitOfRole(column)) << where;
        EXPECT_TRUE(names.insert(column.name).second) << where << " is there twice";
      }
    }
  }
}

TEST(Columns, OfTablesWithReadingsHaveSomethingThatIsRead) {
  constexpr std::array kRead{ColumnRole::coordinate, ColumnRole::set_coordinate, ColumnRole::sensor,
                             ColumnRole::contact_angle, ColumnRole::deflection};
  for (const Method* method : allMethods()) {
    for (const auto& table : method->tables) {
      const auto isRead = [&](const MethodColumn& column) {
        return std::ranges::find(kRead, column.role) != kRead.end();
      };
      EXPECT_TRUE(!table.readings || std::ranges::any_of(table.columns, isRead)) << method->name << ", " << table.name;
    }
  }
}

TEST(Columns, OfATableThatTheMethodDoesNotDescribeAreWhatItsOtherTablesHave) {
  const auto& centreline = *methodNamed("centreline");
  EXPECT_EQ(columnOf(centreline, "readings", "x_mm").role, ColumnRole::coordinate);
  EXPECT_EQ(columnOf(centreline, "holds", "x_mm").role, ColumnRole::coordinate);
  EXPECT_EQ(columnOf(centreline, "readings", "z_mm").role, ColumnRole::none);
  const auto& screw = *methodNamed("screw-calibration");
  EXPECT_EQ(columnOf(screw, "gain_cal", "x_mm").role, ColumnRole::set_coordinate);
  EXPECT_EQ(columnOf(screw, "gain_cal", "sensor_um").role, ColumnRole::none);
}

TEST(PlausibleRanges, AreThoseOfTheUnitAndNarrowerWhereTheMethodSaysSo) {
  const auto& setter = *methodNamed("tool-setter");
  EXPECT_EQ(plausibleRange(setter, "readings", "x_mm").most, 1e5);
  EXPECT_EQ(plausibleRange(setter, "readings", "B_deg").most, 720);
  EXPECT_EQ(plausibleRange(setter, "C_tilt_rad").most, 0.1);
  EXPECT_EQ(plausibleRange(setter, "sd_C_tilt_rad").least, -0.1);
  EXPECT_EQ(plausibleRange(setter, "stylus_ball_radius_mm").least, 0.01);
  EXPECT_EQ(plausibleRange(*methodNamed("screw-compensation"), "sector_table", "T_um").most, 500);
  EXPECT_EQ(plausibleRange(*methodNamed("screw-compensation"), "K").most, 10);
}

TEST(PlausibleRanges, OfStampsReachAnyEpochAndThoseOfDurationsDoNot) {
  const auto& touches = *methodNamed("delay-multi-speed");
  EXPECT_EQ(plausibleRange(touches, "machine", "t_s").most, 1e10);
  EXPECT_EQ(plausibleRange(touches, "previous_tau_s").most, 1);
  // A table for the record, such as the edges of a switch.
  EXPECT_EQ(plausibleRange(*methodNamed("centreline"), "edges", "contact_s").most, 1e10);
  // A channel of the probe has no temperature.
  EXPECT_EQ(plausibleRange(touches, "probe", "c").most, 1e10);
}

}  // namespace
}  // namespace probebox::metrology
