#include "board/describe/keys.hpp"

#include <algorithm>
#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <set>
#include <string>
#include <vector>

#include "board/describe/cell.hpp"
#include "board/describe/parse.hpp"

// The lists of keys themselves: a slip in one of them would be a rule that no file can keep.
namespace probebox::board {
namespace {

// Notes what is wrong with the lines of a list.
struct LineCheck {
  std::set<std::string, std::less<>>& seen;

  void named(std::string_view key, std::string_view meaning) const {
    EXPECT_TRUE(seen.emplace(key).second) << key << " is there twice";
    EXPECT_FALSE(meaning.empty()) << key;
    EXPECT_THAT(std::string{meaning}, testing::Not(testing::EndsWith("."))) << key;
  }
  void operator()(std::string_view key, const auto&, Key of, std::string_view meaning) const {
    named(key, meaning);
    const Range narrowed = overlap(of.range, plausible(key));
    EXPECT_EQ(narrowed.from, of.range.from) << key << " begins outside of what its unit can be";
    EXPECT_EQ(narrowed.to, of.range.to) << key << " ends outside of what its unit can be";
    EXPECT_LT(narrowed.from, narrowed.to) << key;
  }
  void operator()(std::string_view key, const std::string&, Key, std::string_view meaning) const {
    named(key, meaning);
  }
  void operator()(std::string_view key, const auto&, std::string_view meaning) const { named(key, meaning); }
  template <std::size_t N>
  void operator()(std::string_view key, const auto& value, OneOf<N> of, std::string_view meaning) const {
    named(key, meaning);
    EXPECT_LT(static_cast<std::size_t>(value), N) << key;
    EXPECT_EQ((std::set<std::string>{of.names.begin(), of.names.end()}.size()), N) << key;
  }
};

template <class... Lists>
void expectGoodLines() {
  const auto check = []<class List>(List list) {
    std::set<std::string, std::less<>> seen;
    List::keys(list, LineCheck{seen});
    EXPECT_FALSE(seen.empty());
  };
  (check(Lists{}), ...);
}

TEST(Keys, HaveRangesThatTheirUnitsAllowAndAMeaning) {
  expectGoodLines<WorldDelays, WorldClock, WorldEncoders, WorldAxes, WorldWave, WorldLinearAxes, WorldProbe,
                  WorldVibration, WorldTouchTrigger, WorldSphere, WorldPlates, WorldMount, WorldPartSpindle,
                  WorldTiltingTable, WorldSwivelHead, WorldShank, WorldSensorHead, WorldProbeSpindle, WorldRotary,
                  WorldScrew, WorldToolSetter, WorldCycle, WorldFault, WorldOutsideControl, World>();
  expectGoodLines<AxisDescription, ReferenceDescription, SecondaryAxisDescription, ScrewDescription,
                  PeriodicCheckDescription, RimBallDescription, BallPlateDescription, HeadDescription,
                  CentrelineDescription, SwivelDescription, RotaryTableDescription, ToolDescription, HolderDescription,
                  ToolSetterDescription, ProbeShankDescription, SensorHeadDescription>();
  expectGoodLines<Access, StreamSettings, CalibratedSphere, Certificate, ProbeSwitch, UsbIdentity, Cell, CellTool>();
}

TEST(Keys, OfTheWaysToDescribeAToolHaveRangesAndAMeaningToo) {
  std::set<std::string, std::less<>> seen;
  WorldTool tool;
  WorldTool::cutterKeys(tool, LineCheck{seen});
  seen.clear();
  WorldTool::sensorHeadKeys(tool, LineCheck{seen});
}

// The rows of a table: section, key and meaning.
struct Rows {
  const char* section;
  std::vector<std::string>& all;

  void operator()(std::string_view key, const auto&, const auto&, std::string_view meaning) const {
    all.push_back("| `" + std::string{section} + "` | `" + std::string{key} + "` | " + std::string{meaning} + " |");
  }
};

template <class List>
void addRows(const char* section, std::vector<std::string>& all) {
  List list;
  List::keys(list, Rows{section, all});
}

TEST(Keys, OfMachineErrorsMeanWhatThePageOfTheEmulatedMachineSays) {
  std::vector<std::string> rows, found;
  addRows<WorldDelays>("[delays]", rows);
  addRows<WorldEncoders>("[encoders]", rows);
  addRows<WorldAxes>("[axes]", rows);
  addRows<WorldLinearAxes>("[linear_axes]", rows);
  double scale{};
  WorldLinearAxes::scaleKey(scale, Rows{"[linear_axes.EXX]", rows});
  addRows<WorldWave>("[linear_axes.EXX]", rows);
  addRows<WorldScrew>("[screw.X]", rows);
  addRows<WorldVibration>("[[vibration]]", rows);
  addRows<WorldProbe>("[probe]", rows);
  addRows<WorldTouchTrigger>("[touch_trigger]", rows);
  std::ifstream page{PAGE};
  for (std::string line; std::getline(page, line);)
    if (line.starts_with("| `[")) found.push_back(line);
  EXPECT_THAT(found, testing::ElementsAreArray(rows));
}

}  // namespace
}  // namespace probebox::board
