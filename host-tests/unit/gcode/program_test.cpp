// Programs are read back by an interpreter of the test's own and compared with the plan that they were made from.
#include "tools/gcode/program.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <numbers>
#include <sstream>

#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/plan/plan.hpp"
#include "interpreter.hpp"
#include "programs.hpp"
#include "tools/gcode/picture.hpp"
#include "tools/gcode/unroll.hpp"

namespace probebox::gcode {
namespace {

using Eigen::Vector3d;
using procedure::Feature;
using procedure::Kind;

Vector3d vectorOf(const std::array<double, 3>& v) {
  return {v[0], v[1], v[2]};
}

// Centre of what a step touches, worked out here.
Vector3d centreOf(const procedure::Step& step, const Setting& given = setting()) {
  if (!given.has_y) {
    Setting other = given;
    other.has_y = true;
    const Vector3d centre = centreOf(step, other);
    return {centre.x(), 0, centre.z()};
  }
  if (step.feature != Feature::part_ball) return given.at_mm;
  const auto& angles = step.touch.rotary_angles_rad;
  const Eigen::Rotation2Dd about_c{angles[2]};
  Vector3d ball = given.balls_mm[step.touch.ball - 1U];
  ball.head<2>() = given.c_axis_mm.head<2>() + about_c * (ball.head<2>() - given.c_axis_mm.head<2>());
  if (step.b_moves != procedure::BMoves::table) return ball;
  const double below = given.table_axis_mm->z(), s = std::sin(angles[1]), c = std::cos(angles[1]);
  const double y = ball.y(), z = ball.z() - below;
  return {ball.x(), c * y - s * z, below + s * y + c * z};
}

Vector3d surfaceOf(const procedure::Step& step, const Setting& given) {
  const Vector3d centre = centreOf(step, given);
  const Vector3d n = vectorOf(step.touch.outward_normal);
  if (step.feature == Feature::plates) return centre - 10 * n;
  if (step.feature == Feature::cylinder) return centre - 12 * n;
  if (step.feature == Feature::cube) return centre + Vector3d{13 * n.x(), 15 * n.y(), 12 * n.z()};
  if (step.feature != Feature::tool_setter) return centre + 15.5 * n;
  const bool tool = step.touch.tool != 0;
  const double beside = 8 + (tool ? 5 : 3), above = 8 + (tool ? 0 : 3);
  return centre + Vector3d{beside * n.x(), beside * n.y(), above * n.z()};
}

void expectAt(const Reached& reached, const Vector3d& where) {
  EXPECT_LT((vectorOf(reached.at_mm) - where).cwiseAbs().maxCoeff(), kRounding_mm)
      << vectorOf(reached.at_mm).transpose() << " is not " << where.transpose();
}

// Between begin and end: in to the overtravel, a dwell unless it goes in and out, and back to where the retract ends.
void expectTouch(const Part& run, const procedure::Step& step, const SentMark& begin, const SentMark& end,
                 const Setting& given) {
  const Vector3d surface = surfaceOf(step, given), retract = vectorOf(step.touch.retract_direction);
  ASSERT_EQ(end.after, begin.after + 2);
  expectAt(run.moves[begin.after - 1], surface + step.clearance_mm * retract);
  expectAt(run.moves[begin.after], surface - step.overtravel_mm * retract);
  expectAt(run.moves[begin.after + 1], surface + (step.clearance_mm + procedure::kRunOut_mm) * retract);
  const bool dwells = std::ranges::find(run.dwells, begin.after + 1) != run.dwells.end();
  EXPECT_EQ(dwells, step.kind == Kind::touch);
  for (const std::size_t move : {begin.after, begin.after + 1})
    EXPECT_NEAR(run.moves[move].feed_mm_min, 60 * step.touch.retract_speed_mm_s, 0.01);
}

void expectSweep(const Part& run, const procedure::Step& step, const SentMark& begin, const SentMark& end) {
  ASSERT_EQ(end.after, begin.after + 1);
  const Vector3d from = vectorOf(run.moves[begin.after - 1].at_mm);
  expectAt(run.moves[begin.after], from + step.touch.travel_mm * vectorOf(step.touch.outward_normal));
}

// In contact from the first mark to the second: every way ends at its angle and depth, arcs are about the middle of the
// ball and turn the way that they should.
void expectScan(const Part& run, const procedure::Step& step, const SentMark& begin, const SentMark& end) {
  const ScanPath& path = step.touch.scan;
  const Vector3d centre = centreOf(step);
  ASSERT_EQ(end.after, begin.after + waysOf(path));
  double angle_rad = path.start_rad;
  const auto at = [&](double depth_mm) {
    return Vector3d{centre + (15.5 - depth_mm) * Vector3d{std::cos(angle_rad), std::sin(angle_rad), 0}};
  };
  expectAt(run.moves[begin.after - 1], at(path.depths_mm[0]));
  for (std::size_t i = 0; i < waysOf(path); ++i) {
    const ScanWay way = wayOf(path, i);
    const Reached& move = run.moves[begin.after + i];
    angle_rad += way.turn_rad;
    expectAt(move, at(way.to_depth_mm));
    EXPECT_NEAR(move.feed_mm_min, 60 * step.touch.retract_speed_mm_s, 0.01);
    EXPECT_EQ(move.arc, !way.is_arc ? 0 : path.sense > 0 ? 3 : 2);
    if (!way.is_arc) continue;
    EXPECT_NEAR(move.centre_mm[0], centre.x(), 2 * kRounding_mm);
    EXPECT_NEAR(move.centre_mm[1], centre.y(), 2 * kRounding_mm);
  }
  expectAt(run.moves[end.after], at(-step.clearance_mm));
}

// One part that goes on with another.
void append(Part& run, const Part& more) {
  const std::size_t before = run.moves.size();
  for (auto mark : more.marks) {
    mark.after += before;
    run.marks.push_back(mark);
  }
  for (const std::size_t after : more.dwells) run.dwells.push_back(before + after);
  run.moves.insert(run.moves.end(), more.moves.begin(), more.moves.end());
}

void expectSteps(const Part& run, const procedure::Plan& plan, const Setting& given) {
  ASSERT_EQ(run.marks.size(), 2 * plan.step_count);
  for (std::size_t i = 0; i < plan.step_count; ++i) {
    const auto &begin = run.marks[2 * i], &end = run.marks[2 * i + 1];
    const auto& step = plan.steps[i];
    EXPECT_TRUE(begin.begin && !end.begin && begin.step == i && end.step == i);
    EXPECT_NEAR(begin.speed_mm_s, step.touch.retract_speed_mm_s, 1e-3);
    for (std::size_t axis = 0; axis < 3 && step.turns; ++axis) {
      const double wanted_deg = step.touch.rotary_angles_rad[axis] * 180 / std::numbers::pi;
      EXPECT_NEAR(begin.angles_deg[axis], wanted_deg, 1e-3);
      EXPECT_NEAR(run.moves[begin.after].angles_deg[axis], wanted_deg, 1e-3);
    }
    if (step.kind == Kind::sweep) {
      expectSweep(run, step, begin, end);
    } else if (step.kind == Kind::rest) {
      EXPECT_EQ(begin.after, end.after) << "it stands still";
    } else if (step.kind == Kind::scan) {
      expectScan(run, step, begin, end);
    } else {
      expectTouch(run, step, begin, end, given);
    }
  }
}

TEST(Program, ReachesWhatThePlanAsksForInEveryDialect) {
  for (const auto name : dialectNames()) {
    const Dialect& dialect = *dialectNamed(name);
    for (const auto& c : dialect.isLathe() ? casesOfLathe() : cases()) {
      SCOPED_TRACE(std::string{name} + " " + std::string{c.method->name()});
      const auto read = interpret(written(c, dialect), machineOf(dialect));
      EXPECT_THAT(read.unknown, testing::IsEmpty());
      EXPECT_TRUE(read.ended);
      // What is clamped further out stops the run once more.
      ASSERT_GE(read.parts.size(), 3U);
      Part run = read.parts[2];
      for (std::size_t part = 3; part < read.parts.size(); ++part) append(run, read.parts[part]);
      expectSteps(run, planOf(c), setting(dialect.isLathe()));
    }
  }
}

// Arcs are drawn round: many points of one red line lie on the circle of the arc, and none is its chord.
TEST(Picture, ShowsTheArcsOfAScan) {
  const auto blocks = unroll(planOf(cases()[9]), setting());
  ASSERT_TRUE(blocks);
  std::istringstream lines{picture(*blocks, setting(), "scan")};
  std::ptrdiff_t most = 0;
  for (std::string line; std::getline(lines, line);) {
    if (line.find("#c02020") != std::string::npos) most = std::max(most, std::ranges::count(line, ','));
  }
  EXPECT_GT(most, 20) << "80 degrees in steps of 3";
}

TEST(Program, MovesNothingBeforeTheOperatorStartsIt) {
  for (const auto name : dialectNames()) {
    const Dialect& dialect = *dialectNamed(name);
    const auto read =
        interpret(written((dialect.isLathe() ? casesOfLathe() : cases())[0], dialect), machineOf(dialect));
    EXPECT_TRUE(read.parts[0].moves.empty() && read.parts[0].retracts.empty()) << name;
  }
}

double distanceToSegment(const Vector3d& point, const Vector3d& a, const Vector3d& b) {
  const double length = (b - a).squaredNorm();
  const double share = length == 0 ? 0 : std::clamp((point - a).dot(b - a) / length, 0.0, 1.0);
  return (a + share * (b - a) - point).norm();
}

// Between steps nothing comes nearer to the ball than the clearance of a step.
TEST(Program, TraversesAroundWhatItTouches) {
  for (const auto& c : {cases()[0], cases()[3], cases()[4], cases()[6]}) {
    SCOPED_TRACE(c.method->name());
    const auto plan = planOf(c);
    const auto read = interpret(written(c, siemens()));
    const Part& run = read.parts[2];
    for (std::size_t i = 1; i < plan.step_count; ++i) {
      const std::size_t from = run.marks[2 * i - 1].after - 1, to = run.marks[2 * i].after - 1;
      for (std::size_t move = from; move < to; ++move) {
        const bool turned = run.moves[move].angles_deg != run.moves[move + 1].angles_deg;
        const Vector3d a = vectorOf(run.moves[move].at_mm), b = vectorOf(run.moves[move + 1].at_mm);
        const bool before = run.moves[move + 1].angles_deg == run.moves[from].angles_deg;
        const Vector3d centre = centreOf(plan.steps[before || turned ? i - 1 : i]);
        EXPECT_GT(distanceToSegment(centre, a, b), 15.5 + 0.25) << "before step " << i;
      }
    }
  }
}

TEST(Program, StopsForAPersonWhereTheControlPrintsNothing) {
  const auto plan = planOf(cases()[0]);
  const auto read = interpret(written(cases()[0], haas(), Marks::stops));
  EXPECT_EQ(read.parts.size(), 3 + 2 * plan.step_count);
  for (const auto& part : read.parts) EXPECT_TRUE(part.marks.empty());
}

TEST(Program, SaysWhetherItsDialectWasRunOnAControl) {
  for (const auto name : dialectNames()) {
    const std::string text = written(cases()[0], *dialectNamed(name));
    EXPECT_THAT(text, testing::HasSubstr(name == "linuxcnc" ? "RS274" : "NOT RUN ON A CONTROL"));
    EXPECT_THAT(text, testing::HasSubstr("ONLY ADVISES"));
    std::istringstream lines{text};
    for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 96U) << line;
  }
}

// Between holds at one ball nothing rises to the safe height.
TEST(Program, StaysAtTheBallBetweenHolds) {
  const auto plan = planOf(headCalibration());
  const auto read = interpret(written(headCalibration(), fanuc()));
  ASSERT_EQ(read.parts.size(), 3U);
  const Part& run = read.parts[2];
  ASSERT_EQ(run.marks.size(), 2 * plan.step_count);
  for (std::size_t i = run.marks.front().after; i < run.marks.back().after; ++i)
    EXPECT_LT(run.moves[i].at_mm[2], setting().at_mm.z() + 3) << i;
}

TEST(Unroll, RefusesASafeHeightThatAStepReaches) {
  Setting low = setting();
  low.safe_z_mm = low.at_mm.z() + 1;  // holds are up to 2 mm above the ball's middle
  const auto blocks = unroll(planOf(headCalibration()), low);
  ASSERT_FALSE(blocks);
  EXPECT_THAT(blocks.error().what, testing::AllOf(testing::HasSubstr("--safe-z"), testing::HasSubstr("5 mm")));
}

TEST(Dialect, PutsNothingIntoATextThatWouldEndIt) {
  EXPECT_EQ(plain("a (b) \"c\" [d]; e%"), "A  B   C   D   E ");
}

TEST(Unroll, RefusesByNameWhatTheProgramWouldHaveToKnow) {
  const auto whyNot = [](const Case& c, const Setting& with) {
    const auto blocks = unroll(planOf(c), with);
    return blocks ? std::string{} : blocks.error().what;
  };
  Setting no_height = setting(), no_sphere = setting(), low = setting(), slow = setting(), no_ball = setting();
  no_height.safe_z_mm.reset();
  no_sphere.ball_diameter_mm.reset();
  low.safe_z_mm = 20;
  slow.most_mm_min = 1000;
  no_ball.balls_mm.clear();
  EXPECT_THAT(whyNot(cases()[0], no_height), testing::HasSubstr("--safe-z"));
  EXPECT_THAT(whyNot(cases()[0], no_sphere), testing::HasSubstr("--sphere"));
  EXPECT_THAT(whyNot(cases()[0], low), testing::HasSubstr("larger"));
  EXPECT_THAT(whyNot(cases()[0], slow), testing::HasSubstr("--most-feed"));
  EXPECT_THAT(whyNot(cases()[4], no_ball), testing::HasSubstr("--ball"));
  EXPECT_THAT(whyNot({&procedure::kCentrelineBySteps, {}}, setting()), testing::HasSubstr("its steps"));
}

}  // namespace
}  // namespace probebox::gcode
