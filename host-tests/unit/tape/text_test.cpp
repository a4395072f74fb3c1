#include "firmware/tape/text.hpp"

#include <cstdio>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sstream>

namespace probebox::tape {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

published::Snapshot valid() {
  published::Snapshot s;
  s.valid = true;
  s.correction_mm = {-0.0125, 0, 1.5};
  s.sequence = 42;
  s.age_ms = 349;
  return s;
}

published::Snapshot withCentreline() {
  auto s = valid();
  s.centreline.result.result_id = 7;
  s.centreline.has_z = true;
  s.centreline.here_mm = {240.1234, -3.5};
  s.centreline.result.sd_centre_mm = {0.0004, 0.0005};
  s.delay.calibrated = true;
  s.delay.result_id = 9;
  s.delay.tau_s = {0.004, 0.00401, 0.00399};
  s.delay.sd_s = {1e-6, 2e-6, 3e-6};
  return s;
}

std::vector<std::string> linesOf(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in{text};
  for (std::string line; std::getline(in, line);) {
    EXPECT_TRUE(line.ends_with('\r')) << line;
    lines.push_back(line.substr(0, line.size() - 1));
  }
  return lines;
}

// As NMEA 0183 sums its sentences.
bool sumIsRight(const std::string& line) {
  const auto star = line.rfind('*');
  unsigned sum = 0;
  for (std::size_t i = 0; i < star; ++i) sum ^= static_cast<unsigned char>(line[i]);
  return std::stoul(line.substr(star + 1), nullptr, 16) == sum;
}

TEST(Record, HasTheCorrectionWithItsStateAndASumThatANmeaReaderChecks) {
  const auto lines = linesOf(record(valid()));
  ASSERT_EQ(lines.size(), 1U);
  EXPECT_TRUE(lines[0].starts_with("X-0.0125 Y+0.0000 Z+1.5000 S1 N42 A3*")) << lines[0];
  EXPECT_TRUE(sumIsRight(lines[0]));
}

TEST(Record, HasNoMinusBeforeAZero) {
  auto s = valid();
  s.correction_mm = {-0.00004, -0.00006, -0.0};
  EXPECT_THAT(record(s), testing::StartsWith("X+0.0000 Y-0.0001 Z+0.0000 "));
  EXPECT_THAT(tape(s, Ask::corrections, {}), HasSubstr("X0.0000 Y-0.0001 Z0.0000"));
  EXPECT_THAT(tape(s, Ask::corrections, {.dialect = Dialect::macro}), HasSubstr("#502=0.0000\r\n#503=-0.0001"));
}

TEST(Record, SaturatesTheAgeAsTheRegisterDoes) {
  auto old = valid();
  old.age_ms = 1'000'000'000;
  EXPECT_THAT(record(old), HasSubstr("A65535*"));
}

TEST(Record, HasTheStatusBitsOfRegister2) {
  auto s = valid();
  s.degraded = s.referenced = s.clock_locked = true;
  EXPECT_EQ(statusOf(s), 1 + 2 + 32 + 128);
}

TEST(Record, IsKnownAsTheBoxsOwnWhenItComesBack) {
  std::string line = record(valid());
  line.resize(line.size() - 2);
  EXPECT_TRUE(isSentByTheBox(line));
  EXPECT_TRUE(isSentByTheBox("OK"));
  EXPECT_TRUE(isSentByTheBox("ERR bad-number: no number"));
  line[1] = line[1] == '-' ? '+' : '-';
  EXPECT_FALSE(isSentByTheBox(line)) << "damaged";
  for (const char* said : {"", "X1.5", "X  1.5000*Y  2.0000", "X*", "*", "ERR", "OKAY", "STATUS"})
    EXPECT_FALSE(isSentByTheBox(said)) << said;
}

TEST(Tape, WritesCorrectionsInTheWordsOfTheDialect) {
  EXPECT_THAT(linesOf(tape(valid(), Ask::corrections, {})),
              ElementsAre("%", "G21", "G90 G10 L2 P0 X-0.0125 Y0.0000 Z1.5000", "%"));
  EXPECT_THAT(linesOf(tape(valid(), Ask::corrections, {.dialect = Dialect::macro})),
              ElementsAre("%", "#500=1", "#501=42", "#502=-0.0125", "#503=0.0000", "#504=1.5000", "%"));
  EXPECT_THAT(linesOf(tape(valid(), Ask::corrections, {.dialect = Dialect::nv, .first = 10})),
              ElementsAre("%", "N10 V1", "N11 V42", "N12 V-0.0125", "N13 V0.0000", "N14 V1.5000", "%"));
}

TEST(Tape, ChangesNothingInTheControlWithoutAValidValue) {
  auto s = withCentreline();
  s.valid = false;
  s.centreline.result.result_id = 0;
  s.delay = {};
  EXPECT_THAT(linesOf(tape(s, Ask::all, {})),
              ElementsAre("%", "(NO VALID CORRECTION)", "(NO CENTRELINE IN FORCE)", "(NO DELAY IN FORCE)", "%"));
  const auto macro = tape(s, Ask::all, {.dialect = Dialect::macro});
  EXPECT_THAT(macro, HasSubstr("#500=0"));
  EXPECT_THAT(macro, testing::Not(HasSubstr("#502")));
}

TEST(Tape, WritesNoCentrelineAtAZThatIsNotKnown) {
  auto s = withCentreline();
  s.centreline.has_z = false;
  s.centreline.here_mm = {};
  for (const auto dialect : {Dialect::g10, Dialect::macro})
    EXPECT_THAT(linesOf(tape(s, Ask::centreline, {.dialect = dialect})), ElementsAre("%", "(Z IS NOT KNOWN)", "%"));
}

TEST(Tape, WritesTheCentrelineAndTheDelay) {
  const Form macro{.dialect = Dialect::macro};
  EXPECT_THAT(linesOf(tape(withCentreline(), Ask::centreline, macro)),
              ElementsAre("%", "#505=240.1234", "#506=-3.5000", "#507=0.0000000", "#508=0.0000000", "#509=0.00040",
                          "#510=0.00050", "%"));
  EXPECT_THAT(tape(withCentreline(), Ask::centreline, {}), HasSubstr("G21\r\nG90 G10 L2 P1 X240.1234 Y-3.5000\r\n"));
  EXPECT_THAT(
      tape(withCentreline(), Ask::delay, macro),
      HasSubstr("#511=4.00000\r\n#512=4.01000\r\n#513=3.99000\r\n#514=0.00100\r\n#515=0.00200\r\n#516=0.00300\r\n"));
}

}  // namespace
}  // namespace probebox::tape
