#include "firmware/tape/report.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <numbers>
#include <rapidcheck.h>

namespace probebox::tape {
namespace {

Said saidBy(std::string_view line) {
  const auto report = understood(line);
  EXPECT_TRUE(report) << line << ": " << report.error().what;
  if (!report || !std::holds_alternative<Said>(*report)) return {};
  return std::get<Said>(*report);
}

std::string refusalOf(std::string_view line) {
  const auto report = understood(line);
  return report ? "taken" : report.error().name;
}

// As a Fanuc prints them, with leading spaces, and as text.
TEST(Report, UnderstandsAMarkerHoweverTheControlPadsIt) {
  for (const char* line : {"BEGIN3 A0.000 B0.000 C90.000 T1 F15.000",
                           "BEGIN   3*A    0.000*B-   0.000*C   90.000*T   1*F  15.000", "begin3a0b0c90.t1f15"}) {
    const auto said = saidBy(line);
    ASSERT_EQ(said.size(), 1U) << line;
    const auto& marker = std::get<Marker>(said[0]);
    EXPECT_EQ(marker.step, 3U);
    EXPECT_EQ(marker.phase, MarkerPhase::begin);
    EXPECT_NEAR(marker.rotary_angles_rad[2], std::numbers::pi / 2, 1e-12);
    EXPECT_EQ(marker.tool, 1U);
    EXPECT_EQ(marker.nominal_speed_mm_s, 15);
    EXPECT_TRUE(marker.at_rest);
  }
}

TEST(Report, TellsTheEndOfAStepFromItsAbandonment) {
  EXPECT_EQ(std::get<Marker>(saidBy("END7").at(0)).phase, MarkerPhase::end);
  EXPECT_EQ(std::get<Marker>(saidBy("ABANDON7").at(0)).phase, MarkerPhase::abandon);
}

TEST(Report, UnderstandsHomingsPosesAndCuts) {
  const auto homed = saidBy("HOME X120.5 Z-3");
  ASSERT_EQ(homed.size(), 2U);
  EXPECT_EQ(std::get<AxisHomed>(homed[0]).axis, Axis::x);
  EXPECT_EQ(std::get<AxisHomed>(homed[0]).position_mm, 120.5);
  EXPECT_EQ(std::get<AxisHomed>(homed[1]).axis, Axis::z);
  EXPECT_EQ(std::get<AxisHomed>(homed[1]).position_mm, -3);
  const auto pose = std::get<PoseTold>(saidBy("POSE B30. T4 L120.").at(0));
  EXPECT_EQ(pose.axes, 2);
  EXPECT_NEAR(pose.angles_rad[1], std::numbers::pi / 6, 1e-12);
  EXPECT_TRUE(pose.has_tool);
  EXPECT_EQ(pose.tool_length_mm, 120);
  EXPECT_TRUE(std::get<CutInhibit>(saidBy("CUT1").at(0)).active);
  EXPECT_FALSE(std::get<CutInhibit>(saidBy("CUT 0").at(0)).active);
}

TEST(Report, TakesPositionsAndRequests) {
  const auto report = understood("X   12.3450Y-  3.2000");
  ASSERT_TRUE(report);
  const auto& at = std::get<Positions>(*report).at_mm;
  EXPECT_EQ(at[0], 12.345);
  EXPECT_EQ(at[1], -3.2);
  EXPECT_FALSE(at[2]);
  EXPECT_EQ(std::get<Ask>(*understood("CENTRELINE")), Ask::centreline);
  EXPECT_EQ(std::get<Ask>(*understood("status")), Ask::status);
}

TEST(Report, RefusesByName) {
  EXPECT_EQ(refusalOf("HELLO"), "unknown-line");
  EXPECT_EQ(refusalOf(""), "unknown-line");
  EXPECT_EQ(refusalOf("BEGIN"), "missing-number");
  EXPECT_EQ(refusalOf("BEGIN3 X1"), "unknown-word");
  EXPECT_EQ(refusalOf("BEGIN3 C1 C2"), "repeated-word");
  EXPECT_EQ(refusalOf("BEGIN3.5"), "out-of-range");
  EXPECT_EQ(refusalOf("BEGIN-1"), "out-of-range");
  EXPECT_EQ(refusalOf("BEGIN3 C3601"), "out-of-range");
  EXPECT_EQ(refusalOf("BEGIN3 C"), "bad-number");
  EXPECT_EQ(refusalOf("BEGIN3 C1.2.3"), "bad-number");
  EXPECT_EQ(refusalOf("BEGIN3 C--1"), "bad-number");
  EXPECT_EQ(refusalOf("BEGIN3 Cnan"), "bad-number");
  EXPECT_EQ(refusalOf("BEGIN3 C1e5"), "unknown-word");
  EXPECT_EQ(refusalOf("HOME"), "missing-word");
  EXPECT_EQ(refusalOf("HOME X1e9999"), "unknown-word");
  EXPECT_EQ(refusalOf("HOME X999999"), "out-of-range");
  EXPECT_EQ(refusalOf("POSE L120."), "missing-word");
  EXPECT_EQ(refusalOf("CUT2"), "out-of-range");
  EXPECT_EQ(refusalOf("CUT"), "out-of-range");
  EXPECT_EQ(refusalOf("X1 F3"), "unknown-word");
  EXPECT_EQ(refusalOf("STATUS1"), "bad-character");
  EXPECT_EQ(refusalOf("X\xC3\xA4"), "bad-character");
}

// Whatever a line brings, it is taken within its limits or refused by a name.
TEST(Report, NeverTakesNoise) {
  rc::check([] {
    const auto line = *rc::gen::container<std::string>(rc::gen::oneOf(
        rc::gen::element('B', 'E', 'G', 'I', 'N', 'X', 'H', 'O', 'M', '1', '9', '.', '-', '+', ' ', '*', 'C', 'T'),
        rc::gen::arbitrary<char>()));
    const auto report = understood(line);
    if (!report) return RC_ASSERT(!report.error().name.empty() && !report.error().what.empty());
    if (const auto* said = std::get_if<Said>(&*report)) RC_ASSERT(!said->empty());
  });
}

}  // namespace
}  // namespace probebox::tape
