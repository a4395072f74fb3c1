#include "board/describe/keys.hpp"

#include <algorithm>
#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <set>
#include <string>
#include <string_view>
#include <type_traits>

#include "board/describe/cell.hpp"
#include "board/describe/parse.hpp"

// The lists of keys themselves: a slip in one of them would be a rule that no file can keep.
namespace probebox::board {
namespace {

// True if the value is one of its enumeration: the compiler writes others as a number.
template <auto value>
constexpr bool isNamed() {
  constexpr std::string_view function{__PRETTY_FUNCTION__}, before{"value = "};
  const char first = function.at(function.find(before) + before.size());
  return first != '(' && first != '-' && (first < '0' || first > '9');
}

// True if a type that a key names the values of has this many of them.
template <class T, std::size_t count>
constexpr bool hasValues() {
  if constexpr (std::is_same_v<T, bool>)
    return count == 2;
  else
    return isNamed<static_cast<T>(count - 1)>() && !isNamed<static_cast<T>(count)>();
}

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
  template <class T, std::size_t N>
  void operator()(std::string_view key, const T&, OneOf<N> of, std::string_view meaning) const {
    named(key, meaning);
    static_assert(hasValues<T, N>(), "each value has a name");
    EXPECT_EQ((std::set<std::string>{of.names.begin(), of.names.end()}.size()), N) << key;
  }
};

// keys: calls its argument for each line of a list.
void expectGoodLinesOf(auto keys) {
  std::set<std::string, std::less<>> seen;
  keys(LineCheck{seen});
  EXPECT_FALSE(seen.empty());
}

template <class... Lists>
void expectGoodLines() {
  (expectGoodLinesOf([list = Lists{}](auto key) mutable { Lists::keys(list, key); }), ...);
}

TEST(Keys, HaveRangesThatTheirUnitsAllowAndAMeaning) {
  expectGoodLines<WorldDelays, WorldClock, WorldEncoders, WorldAxes, WorldWave, WorldLinearAxes, WorldProbe,
                  WorldVibration, WorldTouchTrigger, WorldSphere, WorldPlates, WorldCylinder, WorldCube, WorldMount,
                  WorldPartSpindle, WorldTiltingTable, WorldSwivelHead, WorldShank, WorldSensorHead, WorldProbeSpindle,
                  WorldRotary, WorldScrew, WorldToolSetter, WorldCycle, WorldFault, WorldOutsideControl, World>();
  expectGoodLines<AxisDescription, AccuracyDescription, ReferenceDescription, SecondaryAxisDescription,
                  ScrewDescription, PeriodicCheckDescription, RimBallDescription, BallPlateDescription, HeadDescription,
                  CentrelineDescription, SwivelDescription, RotaryTableDescription, ToolDescription, HolderDescription,
                  ToolSetterDescription, ProbeShankDescription, SensorHeadDescription, PlatesDescription,
                  CylinderDescription, CubeDescription, ProbeDistance>();
  expectGoodLines<Access, StreamSettings, CalibratedSphere, Certificate, ProbeSwitch, UsbIdentity, Cell, CellTool>();
}

TEST(Keys, OfAPartOfASectionHaveRangesAndAMeaningToo) {
  WorldFault fault{.kind = FaultKind::clock_jumps};
  expectGoodLinesOf([&](auto key) { WorldFault::keys(fault, key); });
  WorldTool tool;
  expectGoodLinesOf([&](auto key) { WorldTool::cutterKeys(tool, key); });
  expectGoodLinesOf([&](auto key) { WorldTool::sensorHeadKeys(tool, key); });
  expectGoodLinesOf([&](auto key) { WorldTool::stylusKeys(tool.offset_mm, tool.length_mm, key); });
  WorldLinearAxes linear;
  expectGoodLinesOf([&](auto key) { WorldLinearAxes::scaleKey(linear.scale[0], key); });
  ReferenceDescription reference;
  expectGoodLinesOf([&](auto key) { ReferenceDescription::markKeys(reference, key); });
  RotaryAxisDescription rotary;
  expectGoodLinesOf([&](auto key) { RotaryAxisDescription::encoderKeys(rotary, key); });
  RotaryTableDescription table;
  expectGoodLinesOf([&](auto key) { RotaryTableDescription::tipKeys(table, key); });
  Probe probe;
  expectGoodLinesOf([&](auto key) {
    Probe::channelKeys(probe, key);
    Probe::limitKey(probe, key);
  });
  expectGoodLinesOf([&](auto key) { Probe::stylusKeys(probe, key); });
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
