#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <string>

#include "board/describe/parse.hpp"
#include "board/describe/sim_files.hpp"
#include "machine_with.hpp"
#include "problems.hpp"

// Slips that are TOML, of the right type, and still no description: each is refused by file, line, key and remedy.
namespace probebox::board {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

// A file of the emulated board with one text exchanged for another.
std::string simWith(const char* file, std::string_view from, std::string_view to) {
  return exchanged(std::string{simFile(file)}, from, to);
}

std::string simBoxProblem(std::string_view from, std::string_view to) {
  return problemOf(parseBox(simWith("box.toml", from, to), "box.toml"));
}
std::string simMachineProblem(std::string_view from, std::string_view to) {
  return problemOf(parseMachine(simWith("machine.toml", from, to), "machine.toml"));
}

TEST(Refused, AToolOrHolderWithoutANumber) {
  const std::string tool = "[[tool]]\nnumber = 7\nlength_mm = 100\n", nameless = "[[tool]]\nlength_mm = 100\n";
  EXPECT_EQ(machineProblem(nameless), "machine.toml:26: missing key 'tool.number': add it to [tool]");
  EXPECT_EQ(machineProblem(tool + nameless + nameless),
            "machine.toml:29: missing key 'tool.number': add it to [tool]\n"
            "machine.toml:31: missing key 'tool.number': add it to [tool]");
  EXPECT_THAT(machineProblem("[[holder]]\nlength_mm = 50\n[[holder]]\nlength_mm = 50\n"),
              testing::AllOf(HasSubstr("missing"), HasSubstr("'holder.number'")));
  const auto world = parseWorld(std::string{simFile("world.toml")} + "[[tool]]\nlength_mm = 10\nradius_mm = 1\n" +
                                    "[[tool]]\nlength_mm = 10\nradius_mm = 1\n",
                                "world.toml");
  EXPECT_THAT(problemOf(world), testing::AllOf(HasSubstr("missing"), HasSubstr("'tool.number'")));
}

TEST(Refused, WholeNumbersThatADoubleDoesNotHold) {
  for (const char* const number : {"9007199254740993", "9223372036854775807", "-9223372036854775808"}) {
    EXPECT_THAT(simBoxProblem("period_ns = 1_000_000", std::string{"period_ns = "} + number),
                AllOf(HasSubstr("box.toml:12: 'sync.period_ns' = "), HasSubstr("100000 to 10000000")));
    EXPECT_THAT(simMachineProblem("travel_min_mm = -50", std::string{"travel_min_mm = "} + number),
                AllOf(HasSubstr("machine.toml:12: 'axis.X.travel_min_mm' = "), HasSubstr("-50000 to 50000")));
  }
}

TEST(Refused, AGainThatLeavesAScrewUncorrectedOrMultipliesIt) {
  for (const char* const gain : {"0", "1e-308", "-0.05"})
    EXPECT_THAT(simMachineProblem("gain = -1.0   ", std::string{"gain = "} + gain),
                AllOf(testing::ContainsRegex("machine.toml:[0-9]+: 'screw.X.gain' = "), HasSubstr("the screw")));
  EXPECT_THAT(simMachineProblem("gain = -1.0   ", "gain = -86"), HasSubstr("-10 to 10"));
  EXPECT_TRUE(parseMachine(simWith("machine.toml", "gain = -1.0   ", "gain = 0.86"), "machine.toml"));
}

TEST(Refused, CountsTooCoarseForAnAxis) {
  EXPECT_THAT(simMachineProblem("counts_per_mm = 1_000_000      #", "counts_per_mm = 0.001 #"),
              HasSubstr("'axis.X.counts_per_mm' = 0.001"));
  EXPECT_THAT(simMachineProblem("counts_per_deg = 100_000", "counts_per_deg = 0.001"),
              testing::AllOf(HasSubstr("'rotary_axis.C.counts_per_deg' = 0.001"), HasSubstr("0.1")));
}

TEST(Refused, TwoBallsOfAPlateInOnePlace) {
  EXPECT_THAT(simMachineProblem("at_mm = [-15, -26, 60]", "at_mm = [-15, 26.0005, 100]"),
              testing::ContainsRegex("machine.toml:[0-9]+: 'ball_plate.ball.at_mm'"));
}

TEST(Refused, AToolThatEndsInsideOfItsHolder) {
  EXPECT_THAT(simMachineProblem("length_mm = 62 ", "length_mm = 120 "),
              testing::AllOf(HasSubstr("'tool.length_mm' = 120"), HasSubstr("[[holder]]"), HasSubstr("120 mm")));
}

TEST(Refused, RangesInMoreDigitsThanAPersonReads) {
  EXPECT_EQ(
      simMachineProblem("correction_rate_mm_s = 0.05    #", "correction_rate_mm_s = 1e-300 #"),
      "machine.toml:20: 'axis.X.correction_rate_mm_s' = 1e-300 is out of its range: give a value from 0.000001 to "
      "1000");
}

TEST(Refused, DevicesThatThereAreNot) {
  EXPECT_THAT(simBoxProblem("drift = \"sim\"", "drift = \"anything\""),
              AllOf(HasSubstr("box.toml:69: 'devices.drift' = \"anything\""), HasSubstr("\"none\", \"sim\"")));
  EXPECT_THAT(simBoxProblem("encoders = \"sim\"", "encoders = \"simm\""),
              testing::AllOf(HasSubstr("'devices.encoders' = \"simm\""), HasSubstr("\"sim\"?")));
  EXPECT_THAT(
      simBoxProblem("probe = \"sim\"", "probe = \"usb:RX-1\""),
      AllOf(HasSubstr("box.toml:68: 'devices.probe' = \"usb:RX-1\""), HasSubstr("\"sim\""), HasSubstr("\"sim\"")));
  EXPECT_THAT(
      simBoxProblem("encoders = \"sim\"\nencoder_rate_hz = 1000   # how often all axes are latched\nprobe = \"sim\"",
                    "encoders = \"none\"\nencoder_rate_hz = 1000\nprobe = \"none\""),
      HasSubstr("'devices.drift' = \"sim\""));
}

TEST(Refused, TwoLinesWhereThereIsOne) {
  EXPECT_THAT(
      simBoxProblem("axis = \"Z\"", "axis = \"Y\""),
      AllOf(HasSubstr("box.toml:38: 'index.axis' = \"Y\""), HasSubstr("[[index]]"), Not(HasSubstr("index.name"))));
  EXPECT_THAT(simBoxProblem("name = \"tool setter\"", "name = \"probe trigger\""),
              HasSubstr("box.toml:22: 'trigger.name' = \"probe trigger\""));
  std::string many;
  for (int k = 0; k < 20; ++k) many += "[[skip]]\nchip = \"c\"\nline = " + std::to_string(100 + k) + "\n";
  EXPECT_THAT(simBoxProblem("[loop_back]", many + "[loop_back]"),
              testing::AllOf(HasSubstr("'skip'"), HasSubstr("21 times"), HasSubstr("16 [[skip]]")));
}

TEST(Refused, PositionsThatTheMachineDoesNotReach) {
  EXPECT_THAT(simMachineProblem("index_mm = 150 ", "index_mm = 451 "),
              AllOf(HasSubstr("machine.toml:17: 'axis.X.index_mm'"), HasSubstr("X = 451"), HasSubstr("-50 to 450 mm"),
                    HasSubstr("[axis.X]")));
  EXPECT_THAT(simMachineProblem("ball_centre_z_mm = -160", "ball_centre_z_mm = 160"), HasSubstr("Z = 160"));
  EXPECT_THAT(simMachineProblem("ball_mm = [120, 80, -150]", "ball_mm = [1200, 80, 150]"),
              AllOf(HasSubstr("'swivel_head.ball_mm'"), HasSubstr("X = 1200"), HasSubstr("'swivel_head.ball_mm'"),
                    HasSubstr("Z = 150")));
  EXPECT_THAT(simMachineProblem("accepted_mm = [120, 200, -315]", "accepted_mm = [120, 200, -50]"),
              AllOf(HasSubstr("'tool_setter.accepted_mm'"), HasSubstr("Z = 100"), Not(HasSubstr("X ="))))
      << "the probe's tip is 150 mm below the reference that places are counted from";
  EXPECT_THAT(simMachineProblem("assumed_x_mm = 330", "assumed_x_mm = 3300"),
              testing::AllOf(HasSubstr("'centreline.assumed_x_mm'"), HasSubstr("X = 3300")));
  EXPECT_TRUE(parseMachine(simWith("machine.toml", "assumed_x_mm = 330", "assumed_x_mm = 700"), "machine.toml"))
      << "a large chuck turns about a point that the stylus does not reach";
}

TEST(Refused, ScrewsThatEndBeforeTheirAxis) {
  EXPECT_THAT(simMachineProblem("length_mm = 820", "length_mm = 1"),
              testing::AllOf(HasSubstr("'screw.X.length_mm' = 1"), HasSubstr("50000")));
  EXPECT_THAT(simMachineProblem("length_mm = 820", "length_mm = 600"),
              testing::AllOf(HasSubstr("'screw.X.length_mm' = 600"), HasSubstr("610 mm")));
  EXPECT_THAT(simMachineProblem("offset_mm = 160", "offset_mm = -160"),
              testing::AllOf(HasSubstr("'screw.X.offset_mm' = -160"), HasSubstr("210 mm")));
  EXPECT_THAT(simMachineProblem("offset_mm = 120", "offset_mm = -120"), HasSubstr("'screw.Z.offset_mm' = -120"))
      << "the bearing is at the high end";
}

TEST(Refused, NamesThatAPersonCannotRead) {
  EXPECT_THAT(simMachineProblem("\"emulated three-axis mill\"", "\"mill\\u001b[2J\""),
              testing::AllOf(HasSubstr("machine.toml:4: 'machine.name' = \"mill?[2J\""), HasSubstr("U+001B")));
  EXPECT_THAT(simMachineProblem("\"emulated three-axis mill\"", "\"\\u202Ellim\""), HasSubstr("direction"));
  EXPECT_THAT(simMachineProblem("\"emulated three-axis mill\"", "\"" + std::string(20'000, 'a') + "\""),
              testing::AllOf(HasSubstr("'machine.name'"), HasSubstr("20000"), HasSubstr("100")));
  EXPECT_THAT(simMachineProblem("\"emulated three-axis mill\"", "\"  \""), HasSubstr("is empty"));
  EXPECT_TRUE(
      parseMachine(simWith("machine.toml", "emulated three-axis mill", "Fr\u00e4se \u2116 5, \u5317\u4eac"), "m"));
}

TEST(Refused, MountingsThatAreMisspelt) {
  EXPECT_THAT(simMachineProblem("mounting = \"spindle\"", "mounting = \"spindel\""),
              testing::AllOf(HasSubstr("machine.toml:5: 'machine.mounting' = \"spindel\""), HasSubstr("\"spindle\"?")));
  EXPECT_THAT(simMachineProblem("mounting = \"spindle\"", "mounting = \"Turret\""), HasSubstr("\"turret\"?"));
  for (const char* const own : {"turret 3", "spindle 2", "the long adapter"})
    EXPECT_TRUE(
        parseMachine(simWith("machine.toml", "mounting = \"spindle\"", "mounting = \"" + std::string{own} + "\""), "m"))
        << own;
}

TEST(Refused, SourcesThatNothingFeeds) {
  EXPECT_THAT(simMachineProblem("sources = [\"screw\"] ", "sources = [\"swivle\"] "),
              testing::AllOf(HasSubstr("\"swivle\""), HasSubstr("\"swivel\"?")));
  EXPECT_THAT(simMachineProblem("sources = [\"screw\"] ", "sources = [\"screw\", \"swivel\", \"screw\"] "),
              AllOf(HasSubstr("\"swivel\""), HasSubstr("[swivel]"), HasSubstr("\"screw\" twice")));
  const auto bare = machineWith("", "sources = [\"screw\", \"rotary\", \"centreline\"]\n");
  EXPECT_THAT(problemOf(bare),
              AllOf(HasSubstr("machine.toml:5: 'corrections.sources'"), HasSubstr("\"screw\""), HasSubstr("[screw.X]"),
                    HasSubstr("\"rotary\""), HasSubstr("[rotary_table]"), Not(HasSubstr("\"centreline\""))));
}

TEST(Refused, AddressesThatAreThereTwice) {
  const auto service =
      parseService("links = [\"usb\",\n  \"usb\"]\ncnc = [\"modbus:/dev/a\",\n\"modbus:/dev/a\"]\n", "s.toml");
  EXPECT_EQ(problemOf(service),
            "s.toml:2: 'links' has \"usb\" twice: remove one of them\n"
            "s.toml:4: 'cnc' has \"modbus:/dev/a\" twice: remove one of them");
  EXPECT_EQ(parseService("links = [\"usb\",\n  \"tcp::1\"]\n", "s.toml")->link_places.at(1), "s.toml:2: 'links'");
}

TEST(Refused, AxesInSmallLettersByTheirOwnName) {
  EXPECT_THAT(machineProblem("[axis.x]\nsense = 1\n"), AllOf(HasSubstr("'axis.x'"), HasSubstr("write 'X'")));
  EXPECT_THAT(machineProblem("[screw.z]\npitch_mm = 10\n"), AllOf(HasSubstr("'screw.z'"), HasSubstr("write 'Z'")));
}

TEST(Refused, AllProblemsOfAFileAtOnceInTheOrderOfItsLines) {
  const std::string twice = "[machine]\nname = 5\nmounting = \"\"\n[corrections]\nhold_s = \"5\"\n";
  const auto machine = parseMachine(twice, "m.toml");
  EXPECT_EQ(problemOf(machine),
            "m.toml:1: missing key 'axis': add it\n"
            "m.toml:2: 'machine.name' is a whole number: write a text in double quotes\n"
            "m.toml:3: 'machine.mounting' is empty: write a text, or remove it\n"
            "m.toml:5: 'corrections.hold_s' is a text: write a number");
  std::string many;
  for (int k = 0; k < 500; ++k) many += "a" + std::to_string(k) + " = 1\n";
  EXPECT_THAT(problemOf(parseProbe(many, "p.toml")), HasSubstr("\np.toml: and 402"));
}

}  // namespace
}  // namespace probebox::board
