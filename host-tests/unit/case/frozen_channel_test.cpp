// Channels that say the same in every row, as where a cable is off, a converter hangs, or a program wrote one reading
// into all; and a tip that does not follow.
#include <algorithm>
#include <cmath>
#include <gmock/gmock.h>
#include <string>
#include <vector>

#include "firmware/metrology/solve.hpp"
#include "reported_case.hpp"

namespace probebox::casefolder {
namespace {

using metrology::Table;
using testing::AllOf;
using testing::HasSubstr;

TEST(FrozenChannel, IsRefusedByNameWithItsPlaceAndTheRemedy) {
  const auto frozen = [](const std::string& name, const std::string& table, const std::string& what, double value) {
    const auto solved = metrology::solve(changed(name, table, what, [=](double& reading) { reading = value; }));
    return solved ? "" : solved.error().name + ": " + solved.error().reason;
  };
  EXPECT_THAT(frozen("screw-calibration", "sector_cal", "sensor_um", 31.41592),
              AllOf(HasSubstr("frozen-channel: "), HasSubstr("'sensor_um'"), HasSubstr("'sector_cal'"),
                    HasSubstr("measure again")));
  EXPECT_THAT(frozen("screw-calibration", "sector_cal", "sensor_um", 31), HasSubstr("frozen-channel"));
  EXPECT_THAT(frozen("spindle-offset-2x2", "readings", "x_mm", 19.31855437),
              AllOf(HasSubstr("frozen-channel: "), HasSubstr("all 4")));
  EXPECT_THAT(frozen("c-axis-alignment", "readings", "y_mm", 19.31855437), HasSubstr("frozen-channel"));
  EXPECT_THAT(frozen("periodic-check", "centres", "y_mm", 1.382864618), HasSubstr("frozen-channel"));
  EXPECT_THAT(frozen("tool-setter", "readings", "z_mm", -193.7679019), HasSubstr("frozen-channel"));
  // 10 um are coarser than the noise: equal by chance.
  EXPECT_EQ(frozen("swivel-error", "readings", "y_mm", 0.38).find("frozen-channel"), std::string::npos);
}

// 0 has no digits of its own; what a factor has made of a column is none either.
TEST(FrozenChannel, ReadsZeroThroughout) {
  const auto frozen = [](const std::string& name, const std::string& table, const std::string& what, double factor) {
    const auto solved = metrology::solve(changed(name, table, what, [=](double& value) { value *= factor; }));
    return solved ? "" : solved.error().name;
  };
  for (const double factor : {0.0, 1e-310}) {
    EXPECT_EQ(frozen("spindle-offset-2x2", "readings", "x_mm", factor), "frozen-channel");
    EXPECT_EQ(frozen("c-axis-alignment", "readings", "y_mm", factor), "frozen-channel");
    EXPECT_EQ(frozen("a-axis-alignment", "readings", "x_mm", factor), "frozen-channel");
    EXPECT_EQ(frozen("table-pivot", "readings", "z_mm", factor), "frozen-channel");
    EXPECT_EQ(frozen("swivel-error", "readings", "x_mm", factor), "frozen-channel");
    EXPECT_EQ(frozen("periodic-check", "centres", "y_mm", factor), "frozen-channel");
    EXPECT_EQ(frozen("screw-calibration", "sector_cal", "sensor_um", factor), "frozen-channel");
  }
  // A plane in which readings are, and the height of a ball.
  EXPECT_EQ(frozen("bore-fit", "points", "z_mm", 0), "");
  EXPECT_EQ(frozen("head-pivot", "readings", "y_mm", 0), "");
  EXPECT_EQ(frozen("table-pivot", "readings", "x_mm", 0), "");
  EXPECT_EQ(frozen("tool-assembly", "readings", "W0_x_mm", 0), "");
}

// As recorded with a cable off or a converter that hangs, in one touch or scan or in all. The columns of a table may
// have any order.
TEST(FrozenChannel, OfTheProbeIsRefusedByEveryMethodOfDelays) {
  std::size_t tried = 0;
  for (const auto& name : caseNames()) {
    const auto good = reportedCase(name);
    if (!name.starts_with("delay-") || good.table("probe") == nullptr) continue;
    for (const char* const channel : {"a", "b", "c"}) {
      for (const bool everywhere : {true, false}) {
        auto dataset = good;
        auto& probe = *std::ranges::find(dataset.tables, "probe", &Table::name);
        const auto numbers = probe.columns.front();
        auto& values = std::ranges::find(probe.columns, channel, &metrology::Column::name)->values;
        const double stuck = values.back();
        for (std::size_t row = 0; row < values.size(); ++row)
          if (everywhere || numbers.values[row] == numbers.values.back()) values[row] = stuck;
        for (const bool time_first : {false, true}) {
          if (time_first) std::swap(probe.columns[0], probe.columns[1]);
          const auto solved = metrology::solve(dataset);
          ASSERT_FALSE(solved) << name << " " << channel << (time_first ? ", t_s first" : "");
          EXPECT_EQ(solved.error().name, "frozen-channel") << name << ": " << solved.error().reason;
          EXPECT_THAT(solved.error().reason,
                      HasSubstr(std::string{"channel '"} + channel + "' in " + numbers.name + " "));
          ++tried;
        }
      }
    }
  }
  EXPECT_GE(tried, 9U * 12U);
}

// Converters of 2 um show no noise of 0.4 um where nothing moves; a probe of two channels is recorded with zeros.
TEST(FrozenChannel, IsNotAChannelWithoutNoiseNorOneThatAProbeDoesNotHave) {
  const auto refused = [](double step_mm, double stuck) {
    auto dataset = reportedCase("delay-in-out");
    auto& probe = *std::ranges::find(dataset.tables, "probe", &Table::name);
    for (auto& column : probe.columns) {
      if (column.name == "c") std::ranges::fill(column.values, stuck);
      if (column.name != "a" && column.name != "b") continue;
      for (auto& value : column.values) value = step_mm * std::round(value / step_mm);
    }
    const auto solved = metrology::solve(dataset);
    return solved ? std::string{} : solved.error().name;
  };
  EXPECT_EQ(refused(1e-5, 0.007), "frozen-channel");
  EXPECT_NE(refused(2e-3, 0.002), "frozen-channel");
  EXPECT_EQ(refused(1e-5, 0), "");
}

// A screw at rest shows a sensor no face.
TEST(FrozenChannel, IsNotASensorOfAScrewThatStands) {
  auto dataset = changed("screw-reference", "at_rest", "sensor_um", [](double& reading) { reading = 12.3; });
  dataset.config["resolution_um"] = 0.1;
  const auto solved = metrology::solve(dataset);
  EXPECT_TRUE(solved) << solved.error().reason;
}

// Off the normal a tip may slide, and does not follow a part of the motion then. A gain of its own would explain it.
TEST(SlidingTip, IsRefusedThoughEveryTouchIsStraight) {
  auto dataset = reportedCase("delay-non-normal");
  EXPECT_TRUE(metrology::solve(dataset));
  auto& probe = *std::ranges::find(dataset.tables, "probe", &Table::name);
  const auto touches = *probe.column("touch");
  for (auto& column : probe.columns) {
    if (column.name == "touch" || column.name == "t_s") continue;
    for (std::size_t row = 0; row < touches.size(); ++row)
      if (touches[row] == 1) column.values[row] *= 0.8;
  }
  const auto solved = metrology::solve(dataset);
  ASSERT_FALSE(solved);
  EXPECT_EQ(solved.error().name, "tip-slip");
}

}  // namespace
}  // namespace probebox::casefolder
