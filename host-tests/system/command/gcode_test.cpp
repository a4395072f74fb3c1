#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "in_process.hpp"
#include "runtime_directory.hpp"

// gcode: what it refuses, and what its options do to a program.
namespace probebox::command {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

Finished gcode(const std::string& method, const std::string& dialect, const std::vector<std::string>& more) {
  std::vector<std::string> arguments{"gcode", method, "--dialect", dialect, "-o", "-", "--safe-z", "80"};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return probebox(arguments);
}

Finished delay(const std::string& dialect, const std::vector<std::string>& more) {
  std::vector<std::string> all{"--sphere", "25", "--stylus", "6"};
  all.insert(all.end(), more.begin(), more.end());
  return gcode("delay-multi-speed", dialect, all);
}

TEST(GcodeCommand, RefusesByNameWhatTheMethodDoesNotUse) {
  struct Useless {
    std::string option, value;
  };
  for (const auto& [option, value] :
       {Useless{"--ball", "1,2,3"}, Useless{"--gap", "5"}, Useless{"--setter", "16"}, Useless{"--tilts", "0,10"},
        Useless{"--b-axis", "Y"}, Useless{"--table-axis", "0,0,0"}, Useless{"--c-axis", "0,0,0"},
        Useless{"--head-tool", "5"}, Useless{"--tool-diameter", "10"}}) {
    const auto refused = delay("haas", {option, value});
    EXPECT_NE(refused.status, 0) << option;
    EXPECT_THAT(refused.err, AllOf(HasSubstr(option), HasSubstr("not use"))) << option;
  }
  EXPECT_THAT(delay("haas", {"--probe-tools", "1,2"}).err, HasSubstr("--probe-tools"));
  EXPECT_THAT(delay("siemens", {"--number", "5"}).err, AllOf(HasSubstr("--number"), HasSubstr("fanuc and")));
  EXPECT_THAT(delay("haas", {"--words", "B=A"}).err, HasSubstr("turn B"));
}

TEST(GcodeCommand, LeavesTheStandardOutputToAPictureThatGoesThere) {
  const RuntimeDirectory directory;
  std::vector<std::string> words{"gcode",     "delay-multi-speed",
                                 "--dialect", "haas",
                                 "-o",        directory.file("delay.nc"),
                                 "--picture", "-",
                                 "--safe-z",  "80",
                                 "--sphere",  "25",
                                 "--stylus",  "6",
                                 "--force"};
  for (int k = 0; k < 2; ++k) {
    const auto drawn = probebox(words);
    EXPECT_EQ(drawn.status, 0) << drawn.err;
    EXPECT_THAT(drawn.out, AllOf(testing::StartsWith("<svg"), testing::EndsWith("</svg>\n")));
    EXPECT_THAT(drawn.err, HasSubstr("delay.nc"));
    words.emplace_back("--json");
  }
}

TEST(GcodeCommand, RefusesToGoThroughTheSphere) {
  const auto refused = delay("haas", {"--overtravel", "20"});
  EXPECT_NE(refused.status, 0);
  EXPECT_THAT(refused.err, AllOf(HasSubstr("20.000 mm"), HasSubstr("--deflection-limit")));
  EXPECT_EQ(delay("haas", {"--overtravel", "1.5", "--deflection-limit", "2"}).status, 0);
}

TEST(GcodeCommand, RefusesLengthsAndFeedsOfNoMachine) {
  const auto refused = [](const Finished& done, const std::string& option) {
    EXPECT_EQ(done.status, 2) << option;
    EXPECT_EQ(done.out, "") << option;
    EXPECT_THAT(done.err, AllOf(HasSubstr(option), HasSubstr("not a"))) << option;
  };
  for (const std::string option : {"--traverse", "--most-feed"}) {
    refused(delay("fanuc", {option, "0.9"}), option);
    refused(delay("fanuc", {option, "1e301"}), option);
  }
  for (const std::string option :
       {"--sphere", "--stylus", "--gap", "--setter", "--tool-diameter", "--deflection-limit"}) {
    for (const std::string value : {"0.0001", "1e12", "1e308"})
      refused(gcode("delay-multi-speed", "fanuc", {option, value}), option);
  }
  EXPECT_THAT(delay("fanuc", {"--traverse", "1"}).out, HasSubstr("F1.000"));
}

TEST(GcodeCommand, RefusesAScanThatOutlastsTheMaskOfLinuxCnc) {
  const auto scan = [](const std::string& dialect, const std::string& speed) {
    return probebox({"gcode", "delay-stepped-scan", "--dialect", dialect, "-o", "-", "--safe-z", "200", "--sphere",
                     "200", "--stylus", "6", "--speed", speed});
  };
  EXPECT_THAT(scan("linuxcnc", "5").err, AllOf(HasSubstr("exact stop"), HasSubstr("greater --speed")));
  EXPECT_EQ(scan("linuxcnc", "20").status, 0);
  EXPECT_EQ(scan("fanuc", "5").status, 0);
}

TEST(GcodeCommand, WritesForALatheWhatNeedsNoY) {
  EXPECT_THAT(
      delay("fanuc-lathe", {"--probe-tools", "7", "--at", "60,0,10"}).out,
      AllOf(HasSubstr("\nT0707\n"), HasSubstr("\nG1 X120.000 F"), Not(HasSubstr(" Y0")), Not(HasSubstr("M19"))));
  EXPECT_THAT(delay("siemens-lathe", {"--probe-tools", "7", "--at", "60,0,10"}).out,
              AllOf(HasSubstr("\nDIAMOF\n"), HasSubstr("\nG1 X60.000 F"), Not(HasSubstr("SPOS"))));
  const auto refused = gcode("delay-known-sphere", "fanuc-lathe", {"--sphere", "25", "--stylus", "6"});
  EXPECT_NE(refused.status, 0);
  EXPECT_THAT(refused.err, HasSubstr("without Y"));
  EXPECT_THAT(delay("fanuc-lathe", {"--at", "60,1,10"}).err, HasSubstr("--at"));
  EXPECT_THAT(delay("fanuc-lathe", {"--machine-z", "5"}).err, HasSubstr("--machine-z"));
  EXPECT_EQ(delay("siemens-lathe", {"--machine-z", "5"}).status, 0);
  EXPECT_THAT(delay("fanuc-lathe", {"--probe-tools", "101"}).err, HasSubstr("up to 99"));
}

TEST(GcodeCommand, WritesTheLoopForTheAxesOfTheControl) {
  const auto loop = [](const std::string& dialect, const std::string& axes) {
    return probebox({"gcode", "--loop", "--dialect", dialect, "-o", "-", "--axes", axes});
  };
  for (const char* axes : {"XZC", "XYZZ", "xyz", "XYZU", "ZYX"}) EXPECT_EQ(loop("fanuc", axes).status, 2) << axes;
  EXPECT_EQ(loop("fanuc", "XYZBC").status, 0);
  EXPECT_EQ(loop("fanuc-lathe", "XZC").status, 0);
  for (const char* axes : {"XYC", "XZZ", "XZU"}) EXPECT_EQ(loop("siemens-lathe", axes).status, 2) << axes;
}

TEST(GcodeCommand, CallsTheToolThatCarriesTheProbe) {
  EXPECT_THAT(delay("fanuc", {"--probe-tools", "7", "--number", "1234", "--machine-z", "-5"}).out,
              AllOf(HasSubstr("\nO1234 "), HasSubstr("\nG0 G90 G49 G53 Z-5.000\nT7 M6\n"), HasSubstr("\nG1 G43 H7 Z"),
                    Not(HasSubstr("#4008"))));
  EXPECT_THAT(delay("fanuc", {}).out, AllOf(HasSubstr("#4008NE43"), Not(HasSubstr(" M6"))));
  EXPECT_THAT(delay("fanuc", {"--no-skip"}).out, Not(HasSubstr("\nG31")));
}

// ISO 841: what turns about X is A, whatever the box calls it.
TEST(GcodeCommand, NamesTheAxesOfTheControl) {
  const auto pivot = [](const std::vector<std::string>& more) {
    std::vector<std::string> all{"--sphere", "12",       "--stylus",     "6",       "--ball", "30,0,0",
                                 "--tilts",  "-30,0,30", "--table-axis", "0,0,-100"};
    all.insert(all.end(), more.begin(), more.end());
    return gcode("table-pivot", "siemens", all);
  };
  EXPECT_THAT(pivot({}).out, AllOf(HasSubstr(" A30.000"), Not(HasSubstr("G0 B"))));
  EXPECT_THAT(pivot({"--b-axis", "Y"}).out, AllOf(HasSubstr(" B30.000"), Not(HasSubstr("G0 A"))));
  EXPECT_THAT(pivot({"--words", "B=B1="}).out, HasSubstr(" B1=30.000"));
  EXPECT_THAT(pivot({"--words", "B=C"}).err, HasSubstr("both"));
  EXPECT_THAT(pivot({"--words", "B=X"}).err, HasSubstr("a word"));
}

TEST(GcodeCommand, SaysWhatASelftestIs) {
  EXPECT_THAT(gcode("selftest", "fanuc", {}).err, AllOf(HasSubstr("by hand"), Not(HasSubstr("forecast"))));
}

TEST(GcodeCommand, AsksAScrewCalibrationForNoSphere) {
  const auto written = gcode("screw-calibration", "haas", {"--axis", "X"});
  EXPECT_EQ(written.status, 0) << written.err;
  EXPECT_THAT(written.out, AllOf(HasSubstr("MAY TRAVEL"), Not(HasSubstr("SPHERE"))));
}

}  // namespace
}  // namespace probebox::command
