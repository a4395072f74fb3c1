// Columns of the tables of every method, and what follows from their roles.
#include <algorithm>
#include <array>
#include <gtest/gtest.h>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

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

struct OwnRange {
  std::string_view name;
  double least, most;
};

// Columns and keys that cannot be as large, or as small, as others of their unit; and stamps, which reach any epoch.
constexpr OwnRange kOwnRanges[]{{"t_s", -1e10, 1e10},
                                {"contact_s", -1e10, 1e10},
                                {"release_s", -1e10, 1e10},
                                {"measured_at_s", -1e10, 1e10},
                                {"c", -1e10, 1e10},  // a channel of the probe has no temperature
                                {"K", -10, 10},
                                {"T_um", -500, 500},
                                {"screw_length_mm", 10, 1e5},
                                {"ux_mm", -20, 20},
                                {"uy_mm", -20, 20},
                                {"uz_mm", -20, 20},
                                {"stylus_ball_radius_mm", 0.01, 50},
                                {"effective_ball_radius_mm", 0.05, 500},
                                {"B_deg", -720, 720},
                                {"tilt_deg", -720, 720},
                                {"B_rad", -13, 13},
                                {"C_tilt_rad", -0.1, 0.1},
                                {"sd_C_tilt_rad", -0.1, 0.1},
                                {"sigma_C_rad", -0.1, 0.1},
                                {"sigma_angle_rad", -0.1, 0.1},
                                {"sigma_contact_rad", -0.1, 0.1},
                                {"previous_tau_s", -1, 1},
                                {"previous_tau_axis_s", -1, 1},
                                {"previous_tau_joint_s", -1, 1}};

// Plausible ranges of this column or key in every method that describes it, with the place.
std::vector<std::pair<std::string, PlausibleRange>> rangesOf(std::string_view name) {
  std::vector<std::pair<std::string, PlausibleRange>> ranges;
  const auto has = [name](const auto& described, auto member) {
    return std::ranges::find(described, name, member) != described.end();
  };
  for (const Method* method : allMethods()) {
    const std::string where = std::string{method->name} + ", " + std::string{name};
    if (has(method->keys, &MethodKey::name) || has(method->known, &KnownQuantity::sd_key))
      ranges.emplace_back(where, plausibleRange(*method, name));
    for (const auto& table : method->tables) {
      if (has(table.columns, &MethodColumn::name))
        ranges.emplace_back(where + " of " + std::string{table.name}, plausibleRange(*method, table.name, name));
    }
  }
  return ranges;
}

TEST(PlausibleRanges, AreNarrowerThanThoseOfTheUnitInEveryMethodWhereTheNameSaysSo) {
  for (const auto& own : kOwnRanges) {
    const auto ranges = rangesOf(own.name);
    EXPECT_FALSE(ranges.empty()) << own.name;
    for (const auto& [where, range] : ranges) {
      EXPECT_EQ(range.least, own.least) << where;
      EXPECT_EQ(range.most, own.most) << where;
    }
  }
}

TEST(PlausibleRanges, OfOthersAreThoseOfTheUnit) {
  EXPECT_EQ(plausibleRange(*methodNamed("tool-setter"), "readings", "x_mm").most, 1e5);
  EXPECT_EQ(plausibleRange(*methodNamed("screw-calibration"), "gain_cal", "ext_um").most, 5e3);
  EXPECT_EQ(plausibleRange(*methodNamed("delay-contour"), "search_window_s").most, 1e3) << "a duration, no stamp";
}

// Such as the edges of a switch.
TEST(PlausibleRanges, OfTimesInATableForTheRecordAreThoseOfStamps) {
  EXPECT_EQ(plausibleRange(*methodNamed("centreline"), "edges", "contact_s").most, 1e10);
}

}  // namespace
}  // namespace probebox::metrology
