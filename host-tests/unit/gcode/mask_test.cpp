#include "tools/gcode/mask.hpp"

#include <algorithm>
#include <cmath>
#include <gmock/gmock.h>
#include <map>
#include <regex>
#include <sstream>

#include "programs.hpp"

// LinuxCNC aborts a move in which an unmasked probe trips, and masks it for a while only.
namespace probebox::gcode {
namespace {

using testing::HasSubstr;

// Longest time, s, that moves and pauses take behind an M64 P0 until the next one or the M65 P0 of the end; the mask of
// LinuxCNC begins anew only where it was off before, with the axes at rest.
double longestMask(const std::string& text) {
  static const std::regex kWord{R"(([XYZIJFP])(-?[\d.]+))"};
  std::istringstream lines{text};
  std::map<char, double> now;
  std::string before;
  double longest_s = 0, masked_s = 0;
  bool masked = false;
  for (std::string line; std::getline(lines, line);) {
    if (line == "M64 P0") {
      EXPECT_FALSE(masked);
      masked = true;
      masked_s = 0;
    } else if (line == "M65 P0") {
      EXPECT_EQ(before, "M66 P0 L0") << "the axes stand";
      masked = false;
    } else if (line.starts_with("G")) {
      auto to = now;
      for (std::sregex_iterator word{line.begin(), line.end(), kWord}, end; word != end; ++word)
        to[(*word)[1].str()[0]] = std::stod((*word)[2]);
      const double way_mm = std::hypot(to['X'] - now['X'], to['Y'] - now['Y'], to['Z'] - now['Z']);
      const double radius_mm = std::hypot(to['I'], to['J']);
      const bool moves = line.starts_with("G1 ") || line.starts_with("G2 ") || line.starts_with("G3 ");
      const bool arc = moves && !line.starts_with("G1 ");
      const double along_mm = arc ? 2 * radius_mm * std::asin(way_mm / 2 / radius_mm) : way_mm;
      if (moves) masked_s += along_mm / (to['F'] / 60);
      if (line.starts_with("G4 ")) masked_s += to['P'];
      now = to;
      if (masked) longest_s = std::max(longest_s, masked_s);
    }
    before = line;
  }
  EXPECT_FALSE(masked);
  return longest_s;
}

// 20 s at most (tools/linuxcnc/probebox_requests.hal): in contact an unmasked probe aborts the program.
TEST(Mask, RenewsTheMaskOfTheProbeWhereAScanOutlastsIt) {
  Setting large = setting();
  large.ball_diameter_mm = 50;
  ProcedureOptions slow;
  slow.reach_mm = 28;
  slow.speed_count = 1;
  slow.speeds_mm_s[0] = 5;
  for (const auto* method : {&procedure::kDelaySteppedScan, &procedure::kDelayContour}) {
    const auto text = written({method, slow}, linuxcnc(), Marks::lines, large);
    EXPECT_GT(longestMask(text), 5) << method->name();
    EXPECT_LT(longestMask(text), 18) << method->name();
  }
}

TEST(Mask, RefusesAStepThatOutlastsTheMaskOfTheProbe) {
  Setting large = setting();
  large.ball_diameter_mm = 200;
  large.safe_z_mm = 200;
  ProcedureOptions slow;
  slow.reach_mm = 103;
  slow.speed_count = 1;
  slow.speeds_mm_s[0] = 5;
  const auto plan = planOf({&procedure::kDelaySteppedScan, slow});
  const auto blocks = unroll(plan, large);
  ASSERT_TRUE(blocks) << blocks.error().what;
  const auto refused = whyMaskedTooLong(*blocks, large, linuxcnc());
  ASSERT_TRUE(refused);
  EXPECT_THAT(refused->what, testing::AllOf(HasSubstr("29.0 s"), HasSubstr("--speed")));
  EXPECT_FALSE(whyMaskedTooLong(*blocks, large, fanuc())) << "nothing there aborts a step";
  large.guard = false;
  EXPECT_FALSE(whyMaskedTooLong(*blocks, large, linuxcnc())) << "the probe is not wired to it";
  for (const auto& c : allCases())
    EXPECT_FALSE(whyMaskedTooLong(*unroll(planOf(c), setting()), setting(), linuxcnc())) << c.method->name();
}

}  // namespace
}  // namespace probebox::gcode
