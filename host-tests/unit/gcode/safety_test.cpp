// Rules of a machinist, over the programs of every method in every dialect, as the test's own interpreter reads them.
#include <algorithm>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <numbers>
#include <set>

#include "interpreter.hpp"
#include "programs.hpp"

namespace probebox::gcode {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

bool swivels(const procedure::Plan& plan) {
  return std::ranges::any_of(std::span{plan.steps}.first(plan.step_count),
                             [](const auto& step) { return step.b_moves == procedure::BMoves::head; });
}

bool takesNothingElse(const procedure::Plan& plan) {
  return std::ranges::all_of(std::span{plan.steps}.first(plan.step_count),
                             [](const auto& step) { return step.touch.tool == 0; });
}

struct Program {
  std::string_view dialect;
  std::string what;
  procedure::Plan plan;
  Interpreted read;
};

// Every program, those with the probe in the spindle too; written and read once.
const std::vector<Program>& everyProgram() {
  static const auto all = [] {
    std::vector<Program> programs;
    for (const auto name : dialectNames()) {
      const Dialect& dialect = *dialectNamed(name);
      for (const auto& c : dialect.isLathe() ? casesOfLathe() : allCases()) {
        const auto plan = planOf(c);
        if (swivels(plan) && !dialect.hasTipControl()) continue;
        for (const std::uint32_t probe_tool : {7U, 0U}) {
          if (probe_tool == 0 && (swivels(plan) || !takesNothingElse(plan))) continue;
          Setting with = setting(dialect.isLathe());
          with.probe_tool = probe_tool;
          programs.push_back(
              {name,
               std::string{name} + " " + std::string{c.method->name()} + (probe_tool == 0 ? " in the spindle" : ""),
               plan, interpret(written(c, dialect, Marks::lines, with), machineOf(dialect))});
        }
      }
    }
    return programs;
  }();
  return all;
}

TEST(Safety, KnowsEveryMethodThatHasAProgram) {
  std::set<std::string_view> known;
  for (const auto& c : allCases()) known.insert(c.method->name());
  for (const auto name : procedure::methodNames()) {
    const auto* method = procedure::methodNamed(name);
    EXPECT_EQ(known.contains(name), method->calibrates && method->loops.next == nullptr) << name;
  }
}

// No move of Z without a length offset, no rapid of a linear axis but Z up in machine coordinates, no G49 alone, no
// rapid under tip control, no tool before Z is up, no probe that turns, units and absolute positions set.
void expectNoDanger(const Interpreted& read) {
  EXPECT_THAT(read.dangers, IsEmpty());
  EXPECT_THAT(read.unknown, IsEmpty());
  EXPECT_TRUE(read.ended);
}

void expectDryRunToBeTheRunLifted(const Interpreted& read) {
  const Part &dry = read.parts[1], &run = read.parts.back();
  if (read.parts.size() != 3) return;  // plates that are put into another mount stop the run
  ASSERT_EQ(dry.moves.size(), run.moves.size());
  ASSERT_EQ(dry.turns.size(), run.turns.size());
  EXPECT_EQ(dry.retracts, run.retracts);
  EXPECT_EQ(dry.tools, run.tools);
  EXPECT_THAT(dry.marks, IsEmpty());
  double lowest_mm = kSafe_mm;
  for (const auto& move : run.moves) lowest_mm = std::min(lowest_mm, move.placed ? move.at_mm[2] : kSafe_mm);
  const double lift_mm = kSafe_mm - lowest_mm;
  for (std::size_t i = 0; i < dry.moves.size(); ++i) {
    if (dry.moves[i].at_machine_height) continue;
    EXPECT_NEAR(dry.moves[i].at_mm[2], run.moves[i].at_mm[2] + lift_mm, 2 * kRounding_mm) << i;
    if (i < 2) continue;  // from where the operator has left it
    for (std::size_t axis = 0; axis < 2; ++axis)
      EXPECT_NEAR(dry.moves[i].at_mm[axis], run.moves[i].at_mm[axis], 2 * kRounding_mm) << i;
    EXPECT_EQ(dry.moves[i].angles_deg, run.moves[i].angles_deg) << i;
  }
  for (std::size_t i = 0; i < dry.turns.size(); ++i) {
    EXPECT_EQ(dry.turns[i].after, run.turns[i].after);
    EXPECT_EQ(dry.turns[i].angles_deg, run.turns[i].angles_deg);
    EXPECT_GE(run.turns[i].at_z_mm, kSafe_mm - kRounding_mm) << "nothing turns below the safe height";
  }
}

// From the end of a step to the begin of the next one, but for the moves that put a stylus onto a scan and off it.
void expectGuardOnMovesThatAreToMeetNothing(std::string_view name, const procedure::Plan& plan,
                                            const Interpreted& read) {
  const bool can = !swivels(plan) || name == "siemens";
  const Part& run = read.parts.back();
  std::set<std::size_t> open{0, 1};
  for (const std::size_t after : run.retracts) open.insert({after, after + 1, after + 2});
  for (std::size_t i = 0; i < run.marks.size(); i += 2) {
    const std::size_t scans = plan.steps[i / 2].kind == procedure::Kind::scan ? 1 : 0;
    const bool first = run.marks[i].after < scans;
    for (std::size_t move = first ? 0 : run.marks[i].after - scans; move < run.marks[i + 1].after + scans; ++move) {
      EXPECT_FALSE(run.moves[move].guarded) << "a measurement that the control stops";
      open.insert(move);
    }
  }
  if (read.parts.size() != 3) return;
  for (std::size_t i = 0; i < run.moves.size(); ++i) {
    if (open.contains(i)) continue;
    EXPECT_EQ(run.moves[i].guarded, can) << i;
  }
}

bool pressesTheProbe(const procedure::Step& step) {
  const bool touches = step.kind == procedure::Kind::touch || step.kind == procedure::Kind::in_out;
  return touches && !(step.feature == procedure::Feature::tool_setter && step.touch.tool != 0);
}

// A place that is off is found by the probe at a slow feed, and pressed from there.
void expectSurfacesToBeSought(std::string_view name, const procedure::Plan& plan, const Interpreted& read) {
  const bool can = !swivels(plan) || name == "siemens";
  const auto touches = std::ranges::count_if(std::span{plan.steps}.first(plan.step_count),
                                             [](const auto& step) { return pressesTheProbe(step); });
  std::size_t seeks = 0;
  for (const auto& part : read.parts) seeks += part.seeks;
  EXPECT_EQ(seeks, can ? static_cast<std::size_t>(touches) : 0U);
  EXPECT_EQ(read.parts[1].seeks, 0U) << "nothing is touched in the dry run";
}

TEST(Safety, OrientsTheSpindleWhereTheMethodDoesNot) {
  Setting fixed = setting();
  fixed.orients = false;
  for (const auto name : dialectsOf(false)) {
    EXPECT_EQ(interpret(written(cases()[0], *dialectNamed(name))).orientations, 2) << name << ": dry run and run";
    EXPECT_EQ(interpret(written(cases()[0], *dialectNamed(name), Marks::lines, fixed)).orientations, 0) << name;
    EXPECT_EQ(interpret(written(cases()[8], *dialectNamed(name))).orientations, 0) << name << ": a rest reads no probe";
  }
}

TEST(Safety, RefusesAHeadThatSwivelsUnguarded) {
  const auto blocks = unroll(planOf(headCase(procedure::kHeadPivot, {})), setting());
  ASSERT_TRUE(blocks);
  Setting watched = setting();
  watched.guard = false;
  for (const auto* dialect : {&fanuc(), &haas()}) {
    EXPECT_TRUE(whySwivelsUnguarded(*blocks, setting(), *dialect)) << dialect->name();
    EXPECT_FALSE(whySwivelsUnguarded(*blocks, watched, *dialect)) << dialect->name();
  }
  EXPECT_FALSE(whySwivelsUnguarded(*blocks, setting(), siemens()));
  EXPECT_FALSE(whySwivelsUnguarded(*unroll(planOf(cases()[0]), setting()), setting(), fanuc()));
}

TEST(Safety, SaysWhatItLeavesBehind) {
  for (const auto name : dialectsOf(false))
    EXPECT_THAT(written(cases()[0], *dialectNamed(name)), HasSubstr("LEAVES BEHIND")) << name;
}

TEST(Safety, GuardsNothingWhereTheControlCannot) {
  Setting blind = setting();
  blind.guard = false;
  for (const auto name : dialectsOf(false)) {
    const auto text = written(cases()[0], *dialectNamed(name), Marks::lines, blind);
    const auto read = interpret(text);
    EXPECT_THAT(read.dangers, IsEmpty());
    for (const auto& part : read.parts) {
      for (const auto& move : part.moves) EXPECT_FALSE(move.guarded) << name;
    }
    EXPECT_THAT(text, HasSubstr("NOTHING STOPS")) << name;
  }
}

TEST(Safety, SaysThatTheProbeIsToBeSwitchedOn) {
  for (const auto name : dialectsOf(false))
    EXPECT_THAT(written(cases()[0], *dialectNamed(name)), HasSubstr("SWITCHED ON")) << name;
}

void expectFeedsWithinTheLimit(const Interpreted& read) {
  for (const auto& part : read.parts) {
    for (const auto& move : part.moves) {
      EXPECT_GT(move.feed_mm_min, 0);
      EXPECT_LE(move.feed_mm_min, setting().most_mm_min);
    }
  }
}

// Nearest to a point on the moves that are to meet nothing.
double nearestTo_mm(const Blocks& blocks, const Eigen::Vector3d& point) {
  double nearest_mm = 1e9;
  std::optional<Eigen::Vector3d> here;
  for (const auto& block : blocks) {
    const auto* move = std::get_if<Move>(&block);
    if (move == nullptr) continue;
    if (here && move->way != Way::measure && move->axes == Move::Axes::xyz) {
      const Eigen::Vector3d way = move->to_mm - *here;
      const double share = std::clamp((point - *here).dot(way) / std::max(way.squaredNorm(), 1e-9), 0.0, 1.0);
      nearest_mm = std::min(nearest_mm, (*here + share * way - point).norm());
    }
    here = move->to_mm;
  }
  return nearest_mm;
}

// The last side of a head at 135 degrees is one that looks down.
TEST(Safety, GoesRoundTheSphereOnItsWayUpFromBelow) {
  auto below = headCase(procedure::kHeadPivot, {});
  below.options.b_angles_rad = {-2.36, 0, 2.36};
  Setting large = setting();
  large.ball_diameter_mm = 50;
  const auto blocks = unroll(planOf(below), large);
  ASSERT_TRUE(blocks) << blocks.error().what;
  const double begins_mm = (50.0 + 6) / 2 + 0.6;
  EXPECT_GE(nearestTo_mm(*blocks, large.at_mm), begins_mm - 0.01);
}

// At a tilt of 90 degrees they stand one above the other.
TEST(Safety, RefusesAWayThroughAnotherBall) {
  ProcedureOptions upright;
  upright.axis = procedure::kAxisB;
  upright.b_count = 3;
  upright.b_angles_rad = {-std::numbers::pi / 2, 0, std::numbers::pi / 2};
  upright.b_axis = {1, 0, 0};
  const Case tilted{&procedure::kRotaryAxisErrors, upright};
  Setting plate = setting();
  plate.balls_mm = {{60, 0, 0}, {-30, 52, 10}, {-30, -52, 20}};
  const auto refused = unroll(planOf(tilted), plate);
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().what,
              testing::AllOf(HasSubstr("step 5"), HasSubstr("B -90"), HasSubstr("C 0"), HasSubstr("ball 3")));
  plate.balls_mm = {{60, 0, 0}, {-20, 52, 10}, {20, -52, 20}};
  EXPECT_TRUE(unroll(planOf(tilted), plate));
}

// The ball of the stylus passes below the other one, which its stem would meet.
TEST(Safety, RefusesAWayBelowAnotherBall) {
  ProcedureOptions few;
  few.angles = 2;
  few.balls = 3;
  const Case level{&procedure::kRotaryAxisErrors, few};
  Setting plate = setting();
  plate.balls_mm = {{60, 0, 0}, {85, 0, 60}, {-60, 0, 0}};
  const auto refused = unroll(planOf(level), plate);
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().what, HasSubstr("ball 2"));
  plate.balls_mm[1] = {120, 0, 60};
  EXPECT_TRUE(unroll(planOf(level), plate));
}

void expectStopsToSayWhy(std::string_view name, const Interpreted& read) {
  ASSERT_GE(read.messages.size(), 2U);
  const std::size_t most = name.starts_with("fanuc") || name == "haas" ? 26 : 100;
  for (const auto& message : read.messages) EXPECT_LE(message.size(), most) << message;
}

// In one test, as each program is written and read once.
TEST(Safety, HoldsInEveryProgram) {
  for (const auto& [dialect, what, plan, read] : everyProgram()) {
    SCOPED_TRACE(what);
    expectNoDanger(read);
    expectDryRunToBeTheRunLifted(read);
    expectGuardOnMovesThatAreToMeetNothing(dialect, plan, read);
    expectSurfacesToBeSought(dialect, plan, read);
    expectFeedsWithinTheLimit(read);
    expectStopsToSayWhy(dialect, read);
  }
}

TEST(Safety, PressesTheProbeNoFurtherThanItMayBe) {
  ProcedureOptions deep;
  deep.overtravel_mm = 1.5;
  const auto refused = unroll(planOf({&procedure::kDelayMultiSpeed, deep}), setting());
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().what, testing::AllOf(HasSubstr("1.500 mm"), HasSubstr("--deflection-limit")));
  Setting robust = setting();
  robust.deflection_limit_mm = 1.5;
  EXPECT_TRUE(unroll(planOf({&procedure::kDelayMultiSpeed, deep}), robust));
}

// The way out ends beyond the clearance: 0.6 + 1.5 mm off the plate.
TEST(Safety, KeepsTheStylusOffTheOppositePlate) {
  const auto whyNot = [](double gap_mm, const ProcedureOptions& options = {}) {
    Setting with = setting();
    with.gap_mm = gap_mm;
    const auto blocks = unroll(planOf({&procedure::kDelayPlates, options}), with);
    return blocks ? std::string{} : blocks.error().what;
  };
  EXPECT_THAT(whyNot(5), testing::AllOf(HasSubstr("5 mm"), HasSubstr("6 mm"), HasSubstr("wider gap"),
                                        Not(HasSubstr("--clearance"))));
  EXPECT_THAT(whyNot(7), HasSubstr("2.1 mm"));
  EXPECT_THAT(whyNot(8), testing::AllOf(HasSubstr("(--clearance)"), HasSubstr("0.5 mm")));
  EXPECT_THAT(whyNot(8.2), IsEmpty());
  ProcedureOptions close;
  close.clearance_mm = 0.4;
  EXPECT_THAT(whyNot(8, close), IsEmpty());
}

// The upper plate is in the way from above.
TEST(Safety, LeavesPlatesAcrossZToTheStepsOfTheBox) {
  ProcedureOptions across_z;
  across_z.axis = 3;
  across_z.faces = procedure::facesAcross(2);
  const auto refused = unroll(planOf({&procedure::kDelayPlates, across_z}), setting());
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().what, HasSubstr("across Z"));
}

TEST(Safety, AsksWithWhichToolAProgramTakesTheProbeAgain) {
  Setting unnamed = setting();
  unnamed.probe_tool = 0;
  for (const auto& c : {cases()[5], headCase(procedure::kHeadPivot, {})}) {
    const auto refused = unroll(planOf(c), unnamed);
    ASSERT_FALSE(refused) << c.method->name();
    EXPECT_THAT(refused.error().what, HasSubstr("--probe-tools"));
  }
}

// A length of zero would swivel the head about the spindle's nose, and the tip into the part.
TEST(Safety, KeepsTheTipInPlaceByTheLengthOfTheToolInTheSpindle) {
  const auto pivot = headCase(procedure::kHeadPivot, {});
  EXPECT_THAT(written(pivot, fanuc()), testing::AllOf(HasSubstr("\nG1 G43.4 H7 Z90.000 F"), Not(HasSubstr("H0"))));
  EXPECT_THAT(written(pivot, haas()), HasSubstr("\nG1 G234 H7 Z90.000 F"));
  EXPECT_THAT(written(pivot, siemens()), HasSubstr("\nTRAORI\nG1 Z90.000 F"));
  EXPECT_THAT(written(headCase(procedure::kSwivelError, {3, 4}), fanuc()), HasSubstr("G1 G43.4 H4 Z"));
}

TEST(Safety, EndsTipControlWithTheHeadUpright) {
  const auto text = written(headCase(procedure::kSwivelError, {3, 4}), fanuc());
  EXPECT_THAT(text, HasSubstr("\nG1 B0.000 F600.000\nG0 G90 G49 G53 Z0.000\nT4 M6\n"));
  EXPECT_THAT(text, HasSubstr("\nG1 B0.000 F600.000\nG0 G90 G49 G53 Z0.000\nT3 M6\n"))
      << "to read the first stop again";
  EXPECT_THAT(text, HasSubstr("\nG0 G90 G49 G53 Z0.000\nPCLOS\n"));
  EXPECT_EQ(text.substr(text.rfind("#3=")).find("#3=0.000"), 0U) << "which ends upright";
  EXPECT_THAT(written(headCase(procedure::kHeadPivot, {}), siemens()),
              HasSubstr("\nTRAFOOF\nG0 SUPA Z0.000 D0\nEXTCLOSE"));
}

// A is the spindle's: on a mill with a trunnion named A it would turn the table.
TEST(Safety, OrientsTheSpindleByItsOwnWord) {
  const Case aligned{&procedure::kAAxisAlignment, {}};
  for (const auto name : dialectsOf(false)) {
    const auto text = written(aligned, *dialectNamed(name));
    EXPECT_GE(interpret(text).orientations, 4) << name;
    EXPECT_THAT(text, HasSubstr(name == "siemens" ? "\nSPOS=180.000\n" : "\nM19 R180.000")) << name;
    EXPECT_THAT(text, HasSubstr("ORIENTATION")) << name;
  }
  Setting named = setting();
  named.words = {"C", "A", "C2="};
  const auto text = written(aligned, siemens(), Marks::lines, named);
  EXPECT_THAT(text, testing::AllOf(HasSubstr("\nG0 C180.000 C2="), Not(HasSubstr("SPOS="))));
}

// What a sentence says, however the comment is broken into lines.
std::string inOneLine(std::string text) {
  for (const std::string between : {")\n(", "\n; "}) {
    for (auto at = text.find(between); at != std::string::npos; at = text.find(between, at))
      text.replace(at, between.size(), " ");
  }
  return text;
}

// Builders' macros leave G91 or another offset behind.
TEST(Safety, RestatesTheModesAfterEachToolChange) {
  const auto textOf = [](const Dialect& dialect) { return written(cases()[5], dialect); };
  EXPECT_THAT(textOf(fanuc()), HasSubstr("\nT4 M6\nG17 G21 G40 G80\nG54 G90 G94 G61\nG1 X"));
  EXPECT_THAT(textOf(haas()), HasSubstr("\nT4 M6\nG17 G21 G40 G80\nG50\nG69\nG54 G90 G94 G61\nG1 X"));
  EXPECT_THAT(textOf(siemens()), HasSubstr("\nT4\nM6\nG17 G710 G40\nG54 G90 G94 G60\nTRANS\nG1 X"));
  EXPECT_THAT(textOf(linuxcnc()), HasSubstr("\nT4 M6\nG17 G21 G40 G54 G80 G90 G91.1 G94 G61.1\nG1 X"));
}

// A shift, a modal macro or polar words that an earlier program has left.
TEST(Safety, RefusesWhatAnEarlierProgramHasLeftActive) {
  for (const auto* dialect : {&fanuc(), &haas()}) {
    const auto text = written(cases()[0], *dialect);
    EXPECT_THAT(text, testing::AllOf(HasSubstr("[#4012]EQ66]THEN#3000="), HasSubstr("[#4017]EQ16]THEN#3000="),
                                     HasSubstr("\nG52 X0 Y0 Z0\n"), HasSubstr("ABS[#5021-#5041-#5201-#5221]"),
                                     HasSubstr("ABS[#5022-#5042-#5202-#5222]")));
    EXPECT_LT(text.find("G52 X0 Y0 Z0"), text.find("#5041")) << "G92 alone is left then";
  }
  EXPECT_THAT(written(cases()[0], linuxcnc()), HasSubstr("[#5210 NE 0]"));
}

// G44 takes a length off, and tip control is none without a head that swivels.
TEST(Safety, TakesNoOtherLengthOffsetThanG43) {
  Setting in_spindle = setting();
  in_spindle.probe_tool = 0;
  for (const auto* dialect : {&fanuc(), &haas()}) {
    const auto text = written(cases()[0], *dialect, Marks::lines, in_spindle);
    EXPECT_THAT(text, testing::AllOf(HasSubstr("IF[#4008NE43]THEN#3000=1("), Not(HasSubstr("#4008EQ49"))));
  }
}

// No skip input ends an arc: the head says so, and where they run.
TEST(Safety, SaysThatArcsOfTheDryRunAreNotProtected) {
  for (const auto name : dialectsOf(false)) {
    const auto text = written(cases()[9], *dialectNamed(name));
    EXPECT_THAT(inOneLine(text),
                testing::AllOf(HasSubstr("ARCS OF THE SCAN"), HasSubstr("SKIP INPUT"), HasSubstr("Z 90.000")))
        << name;
    EXPECT_THAT(inOneLine(text), HasSubstr("STRAIGHT MOVE")) << name;
    EXPECT_THAT(inOneLine(written(cases()[0], *dialectNamed(name))), Not(HasSubstr("ARCS OF THE SCAN"))) << name;
    const auto read = interpret(text);
    int arcs = 0;
    for (const auto& move : read.parts[1].moves) {
      if (move.arc == 0) continue;
      ++arcs;
      EXPECT_GE(move.at_mm[2], kSafe_mm - kRounding_mm);
    }
    EXPECT_GT(arcs, 0);
  }
}

TEST(Safety, SaysThatItIsForMachiningCentres) {
  for (const auto name : dialectsOf(false)) {
    const auto text = inOneLine(written(cases()[0], *dialectNamed(name)));
    EXPECT_THAT(text, testing::AllOf(HasSubstr("LATHES"), HasSubstr("TURRET"))) << name;
    EXPECT_EQ(text.find("SYSTEM A") != std::string::npos, name == "fanuc") << name;
    EXPECT_EQ(text.find("DIAMOF") != std::string::npos, name == "siemens") << name;
  }
}

// The head of a lathe's says what it is for, and what it does not see.
TEST(Safety, SaysWhatALatheHasToHave) {
  const auto fanuc = inOneLine(written(casesOfLathe()[0], fanucLathe()));
  EXPECT_THAT(fanuc,
              testing::AllOf(HasSubstr("FOR LATHES"), HasSubstr("SYSTEM A"), HasSubstr("DIAMETERS"),
                             HasSubstr("NOT RUN ON A CONTROL"), HasSubstr("G50"), Not(HasSubstr("SPINDLE, ITS"))));
  const auto siemens = inOneLine(written(casesOfLathe()[0], siemensLathe()));
  EXPECT_THAT(siemens, testing::AllOf(HasSubstr("FOR LATHES"), HasSubstr("DIAMOF"), HasSubstr("NOT RUN ON A CONTROL"),
                                      HasSubstr("MD 20150")));
}

TEST(Safety, TakesATurretToItsReferencePointAndItsToolWithTheOffset) {
  const auto text = written(casesOfLathe()[0], fanucLathe());
  EXPECT_THAT(text, testing::AllOf(HasSubstr("\nG28 W0\nG28 U0\nT0707\nG18 G21 G40 G80\nG54 G98 G61\nG1 X2.000 F"),
                                   HasSubstr("\nG64\nG99\nM30\n"), Not(HasSubstr("G43")), Not(HasSubstr("M6\n"))));
  EXPECT_THAT(written(casesOfLathe()[0], siemensLathe()),
              HasSubstr("\nG0 SUPA Z0.000 D0\nT7\nD1\nG18 G710 G40\nG54 G90 G94 G60\nTRANS\nDIAMOF\nG1 X1.000 F"));
}

TEST(Safety, RefusesWhatAnEarlierProgramHasLeftActiveOnALathe) {
  EXPECT_THAT(written(casesOfLathe()[0], fanucLathe()),
              testing::AllOf(HasSubstr("[#4012]EQ66]THEN#3000="), HasSubstr("[#4004EQ68]THEN#3000="),
                             HasSubstr("[#4017]EQ68]THEN#3000="), HasSubstr("[#4021-12.1]LT0.05]THEN#3000="),
                             HasSubstr("\nG52 X0 Z0\n"), Not(HasSubstr("#4016"))));
}

TEST(Safety, StopsForTheBallThatIsClampedFurtherOut) {
  const auto messages = interpret(written({&procedure::kCentrelineX, {}}, haas(), Marks::stops)).messages;
  EXPECT_THAT(messages, testing::Contains(HasSubstr("BALL FURTHER OUT")));
  EXPECT_THAT(messages, testing::Not(testing::Contains(HasSubstr("PLATE"))));
}

// Its screen cuts them.
TEST(Safety, TellsMessagesOfAHaasApartByTheirFirst15Characters) {
  std::vector<std::string> texts{written(cases()[0], haas(), Marks::stops)};
  for (const auto& c : allCases()) texts.push_back(written(c, haas(), Marks::stops));
  for (const auto& text : texts) {
    const auto messages = interpret(text).messages;
    std::set<std::string> first, whole;
    for (const auto& message : messages) {
      first.insert(message.substr(0, 15));
      whole.insert(message);
    }
    EXPECT_EQ(first.size(), whole.size());
    EXPECT_GT(whole.size(), 2U);
  }
}

TEST(Safety, SetsAndRestoresTheModesThatItDependsOn) {
  const auto textOf = [](const Dialect& dialect) { return written(cases()[9], dialect); };
  EXPECT_THAT(textOf(siemens()), testing::AllOf(HasSubstr("\nG17 G710 G40\n"), HasSubstr("\nTRANS\n")));
  EXPECT_THAT(textOf(linuxcnc()),
              testing::AllOf(HasSubstr(" G91.1 "), HasSubstr("\nG64\nM2\n"), HasSubstr("#5230 NE 0")));
  EXPECT_THAT(textOf(fanuc()), testing::AllOf(HasSubstr("\nO1000 "), HasSubstr("[#4016]EQ68"), HasSubstr("[#4011]EQ51"),
                                              Not(HasSubstr("#10"))));
  EXPECT_THAT(textOf(haas()), testing::AllOf(HasSubstr("\nO01000 "), HasSubstr("\nG50\nG69\n"),
                                             HasSubstr("SETTING 263"), Not(HasSubstr("#10"))));
}

}  // namespace
}  // namespace probebox::gcode
