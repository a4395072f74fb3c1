#include "tools/gcode/loop/loop.hpp"

#include <algorithm>
#include <cmath>
#include <gmock/gmock.h>
#include <initializer_list>
#include <map>
#include <memory>
#include <set>
#include <span>
#include <sstream>
#include <stdexcept>

#include "kit.hpp"
#include "text_program.hpp"

// The loop programs of Fanuc and Siemens, run as texts against an emulated box and its machine.
namespace probebox::scenario {
namespace {

namespace address = modbus::address;

constexpr double kSafeZ_mm = -100;  // as probebox_places.ngc has it, for tools that are no longer than the probe
// Values of probebox_run.
enum Came { kDone = 0, kBeyond = 2, kRefused = 3, kNotAccepted = 4, kSilent = 6 };

struct Asked {
  double method{}, axis{}, tool{};
  Came came{kDone};
  double read_by{}, mounts{}, contacts{};

  std::vector<double> asked() const { return {method, axis, tool, read_by, mounts, contacts}; }
};
// Touches with and without a dwell, jogs, sweeps, a rest (whose screws still warm up), touches of the setter with a
// cutting tool, the head swivelled, C turned, holds.
constexpr std::array kRuns =
    std::to_array<Asked>({{4}, {6}, {9}, {10, 1}, {25, 1, 0, kRefused}, {20, 0, 4}, {17}, {8}, {22}});

// Scans by arcs and by chords, touches by the shank, C turned until the ball touches, a plate in two mounts. All but
// the scans need the delay.
constexpr Asked kDelay{.method = 4}, kStepped{.method = 26}, kContour{.method = 27}, kShank{.method = 17, .read_by = 2},
    kContacts{.method = 23, .contacts = 1}, kMounts{.method = 15, .axis = 5, .mounts = 2};
// The table tilted, C at 0 and half a turn; and a plate on it.
constexpr Asked kTablePivot{.method = 16}, kPlateOnB{.method = 15, .axis = 5};

// One control, one machine, one box. table: the axis of the control that tilts the table.
class Session {
 public:
  explicit Session(double dry, char table = 0) : control{1, table}, dry_{dry}, table_{table} {}
  virtual ~Session() = default;
  // The value of probebox_run.
  virtual double run(const Asked& run) = 0;
  std::string why() {
    auto& box = control.registers();
    std::ostringstream text;
    text << "refusal of the run " << box.value(address::calibration_refusal) << ", of the wish "
         << box.value(address::wish_refusal) << ", state " << box.value(address::step_state) << ", step "
         << box.value(address::step_number) << ", fault " << box.value(address::step_fault);
    return text.str();
  }
  // A person turns the plate as the control's message says, and counts what that was.
  void standByThePlate() {
    control.at_stop = [this] {
      const auto at = control.said.find("MOUNT ");
      if (at == std::string::npos) return;
      mounted.push_back(control.said[at + 6] - '0');
      control.mountBalls(static_cast<std::size_t>(mounted.back()));
    };
  }
  std::vector<int> mounted;
  Control control;

 protected:
  double tableWord() const { return table_ == 0 ? 0 : table_ - 'A' + 1; }
  double dry_;
  char table_;
};

// Where an integrator finds the balls of the emulated part, in all mounts, and its axes: a sensor head has to come near
// them. Numbers of tables, and names.
std::map<int, double> placesOfBalls() {
  std::map<int, double> places;
  const auto config = worldOfTheLoop();
  const auto& part = config.part_spindle;
  for (std::size_t ball = 0; ball < part.ball_count; ++ball) {
    for (std::size_t mount = 0; mount <= part.further_mount_count; ++mount) {
      const auto& as_described = part.balls_mm[ball];
      const auto at = mount == 0 ? as_described : part.further_mounts[mount - 1].place(as_described);
      const auto number = 1001 + 10 * (static_cast<int>(ball) + 1) + 3 * static_cast<int>(mount);
      for (std::size_t axis = 0; axis < 3; ++axis)
        places[number + static_cast<int>(axis)] = part.point_mm[axis] + at[axis];
    }
  }
  return places;
}
std::map<std::string, double> placesOfAxes() {
  const auto config = worldOfTheLoop();
  const auto &part = config.part_spindle.point_mm, &table = config.tilting_table.point_mm;
  return {{"_pb_axis_x", part[0]}, {"_pb_axis_y", part[1]}, {"_pb_table_y", table[1]}, {"_pb_table_z", table[2]}};
}

class OfTheKit final : public Session {
 public:
  explicit OfTheKit(double dry, char table = 0) : Session{dry, table} {}
  double run(const Asked& run) override {
    kit.call("begin", {});
    kit.variables["_pb_dry"] = dry_;
    kit.variables["_pb_table_word"] = tableWord();
    if (table_ != 0) {
      for (const auto& [number, mm] : placesOfBalls()) kit.setTable(number, mm);
      for (const auto& [name, mm] : placesOfAxes()) kit.variables[name] = mm;
    }
    kit.call("ask", {1, 7});
    kit.call("stand", {1, 0, 0, 0});
    const double came = kit.call("run", run.asked());
    kit.call("stand", {control.tool() * 1.0, control.position('A'), control.position('B'), control.position('C')});
    return came;
  }
  Kit kit{control};
};

class OfAText final : public Session {
 public:
  OfAText(const std::string& dialect, double dry, char table = 0) : Session{dry, table} {
    const auto text = gcode::loop::loopProgram(dialect, "XYZABC");
    EXPECT_TRUE(text) << (text ? "" : text.error().what);
    if (dialect == "fanuc") {
      program = std::make_unique<FanucProgram>(control, *text);
    } else {
      program = std::make_unique<SiemensProgram>(control, *text);
    }
    program->set("_pb_dry", dry_);
    program->set("_pb_table_word", tableWord());
    if (table == 0) return;
    for (const auto& [number, mm] : placesOfBalls()) program->setTable(number, mm);
    for (const auto& [name, mm] : placesOfAxes()) program->set(name, mm);
  }
  double run(const Asked& run) override {
    try {
      program->call(run.asked());
      EXPECT_EQ(program->get("main/came"), 0);
      alarm.clear();
    } catch (const Alarm& stopped) {
      alarm = stopped.what();
      EXPECT_NE(program->get("main/came"), 0) << alarm;
    }
    return program->get("main/came");
  }
  std::unique_ptr<TextProgram> program;
  std::string alarm;
};

// A Fanuc calls the tool that is in the spindle once more, since it cannot know.
std::vector<Commanded> withoutIdleChanges(const std::vector<Commanded>& all) {
  std::vector<Commanded> rest;
  double tool = 1;
  for (const auto& one : all) {
    if (one.is == Commanded::Is::tool && one.to[0] == tool) continue;
    if (one.is == Commanded::Is::tool) tool = one.to[0];
    rest.push_back(one);
  }
  return rest;
}

void expectSame(const std::vector<Commanded>& of_kit, const std::vector<Commanded>& of_text, std::size_t from,
                double within = 1e-6) {
  ASSERT_EQ(of_kit.size(), of_text.size());
  for (std::size_t i = from; i < of_kit.size(); ++i) {
    const auto &one = of_kit[i], &other = of_text[i];
    ASSERT_EQ(one.is, other.is) << i;
    for (std::size_t axis = 0; axis < 3; ++axis) ASSERT_NEAR(one.to[axis], other.to[axis], within) << i;
    ASSERT_NEAR(one.feed, other.feed, 1e-6) << i;
    ASSERT_EQ(one.guarded, other.guarded) << i;
    ASSERT_EQ(one.clockwise, other.clockwise) << i;
    for (std::size_t axis = 0; axis < 2; ++axis) ASSERT_NEAR(one.centre[axis], other.centre[axis], 1e-6) << i;
  }
}

class LoopProgram : public testing::TestWithParam<std::string> {
 protected:
  // Nothing was touched, the run is over, and the machine stands at the safe height.
  static void expectUntouched(OfAText& text) {
    EXPECT_EQ(text.control.contacts(), 0U);
    EXPECT_EQ(text.control.crashes(), 0U);
    EXPECT_GE(text.control.lowest_mm, kSafeZ_mm - 1e-6);
    EXPECT_EQ(text.control.registers().value(address::step_state), 6) << "aborted";
  }
};

TEST_P(LoopProgram, MakesTheMovesOfTheKitsOwnLoop) {
  OfTheKit kit{0};
  OfAText text{GetParam(), 0};
  for (const auto& run : kRuns) {
    const auto from = withoutIdleChanges(kit.control.commanded()).size();
    ASSERT_EQ(kit.run(run), run.came) << "method " << run.method << ", " << kit.why();
    ASSERT_EQ(text.run(run), run.came) << "method " << run.method << ", " << text.why() << text.alarm;
    EXPECT_EQ(text.control.registers().value(address::calibration_method), run.method);
    if (run.came == kDone) {
      EXPECT_GT(withoutIdleChanges(kit.control.commanded()).size(), from) << "method " << run.method;
    }
    expectSame(withoutIdleChanges(kit.control.commanded()), withoutIdleChanges(text.control.commanded()), from);
    if (HasFatalFailure()) FAIL() << "method " << run.method;
  }
  EXPECT_EQ(text.control.crashes(), 0U);
  EXPECT_EQ(text.control.plc().refusedWrites(), 0U);
}

// With the delay in force, as far as the run needs it.
void expectTheKitsMoves(const std::string& dialect, const std::vector<Asked>& runs, char table,
                        const std::function<void(OfAText&)>& then) {
  OfTheKit kit{0, table};
  OfAText text{dialect, 0, table};
  kit.standByThePlate();
  text.standByThePlate();
  for (const auto& run : runs) {
    const auto from = withoutIdleChanges(kit.control.commanded()).size();
    ASSERT_EQ(kit.run(run), run.came) << "method " << run.method << ", " << kit.why();
    ASSERT_EQ(text.run(run), run.came) << "method " << run.method << ", " << text.why() << text.alarm;
    EXPECT_EQ(text.control.registers().value(address::calibration_method), run.method);
    // Behind its contacts that goes where they were, which noise has a part in.
    expectSame(withoutIdleChanges(kit.control.commanded()), withoutIdleChanges(text.control.commanded()), from,
               run.contacts != 0 ? 0.02 : 1e-6);
    ASSERT_FALSE(testing::Test::HasFatalFailure()) << "method " << run.method;
  }
  EXPECT_EQ(text.control.crashes(), 0U);
  EXPECT_EQ(kit.control.crashes(), 0U);
  EXPECT_EQ(text.control.plc().refusedWrites(), 0U);
  EXPECT_EQ(kit.mounted, text.mounted);
  then(text);
}

std::size_t countOf(const Control& control, Commanded::Is what) {
  return static_cast<std::size_t>(std::ranges::count(control.commanded(), what, &Commanded::is));
}

TEST_P(LoopProgram, ScansInContactAllTheWay) {
  for (const auto& run : {kStepped, kContour}) {
    expectTheKitsMoves(GetParam(), {run}, 0, [&](OfAText& text) {
      const bool arcs = run.method == kStepped.method;
      EXPECT_EQ(countOf(text.control, Commanded::Is::arc), arcs ? 6U * 7U : 0U) << "three speeds, two senses";
      EXPECT_EQ(text.control.contacts(), 6U) << "one a scan";
      auto& box = text.control.registers();
      const double truth_ms = 1e3 * text.control.scenario().truth().tau_s[0];
      const double sd_ms = box.value(address::delay_sd_f32);
      EXPECT_GT(sd_ms, 0);
      EXPECT_LT(sd_ms, 0.01);
      EXPECT_LT(std::abs(box.value(address::delay_f32) - truth_ms), 4 * sd_ms);
    });
  }
}

TEST_P(LoopProgram, TouchesByTheShank) {
  expectTheKitsMoves(GetParam(), {kDelay, kShank}, 0, [](OfAText& text) {
    const auto& stylus = text.control.scenario().machine().stylus();
    std::size_t by_shank = 0;
    for (std::uint64_t i = 0; i < stylus.contactCount(); ++i) {
      const auto* contact = stylus.contact(i);
      by_shank += contact != nullptr && contact->lever == worldOfTheLoop().probe_spindle.shank->lever ? 1U : 0U;
    }
    EXPECT_GT(by_shank, 10U);
  });
}

TEST_P(LoopProgram, TurnsCUntilTheBallTouches) {
  expectTheKitsMoves(GetParam(), {kDelay, kContacts}, 0, [](OfAText& text) {
    EXPECT_EQ(countOf(text.control, Commanded::Is::turn_until_touched), 2U);
    auto& box = text.control.registers();
    // Where C is at the ball's height, less the offset of the stylus: machine.toml says the same. Screws are warm.
    EXPECT_NEAR(box.value(address::centreline_here), 330.17, 0.03);
    EXPECT_NEAR(box.value(static_cast<std::uint16_t>(address::centreline_here + 2)), 199.942, 0.03);
  });
}

TEST(LoopKit, HasThePlatePutIntoEachMount) {
  OfTheKit kit{0, 'B'};
  kit.standByThePlate();
  for (const auto& run : {kDelay, kMounts}) ASSERT_EQ(kit.run(run), kDone) << run.method << ": " << kit.why();
  EXPECT_THAT(kit.run(kMounts), testing::AnyOf(kDone, kNotAccepted)) << "screws are warmer; " << kit.why();
  EXPECT_EQ(kit.mounted, (std::vector{2, 1, 2, 1})) << "it is in the first one at the beginning and the end";
  EXPECT_EQ(kit.control.crashes(), 0U);
}

// A step of a text takes longer, and the box records 98 s of a run: it is full before the end of this one.
TEST_P(LoopProgram, HasThePlatePutIntoAnotherMount) {
  OfTheKit kit{0, 'B'};
  OfAText text{GetParam(), 0, 'B'};
  for (Session* session : std::initializer_list<Session*>{&kit, &text}) {
    session->standByThePlate();
    ASSERT_EQ(session->run(kDelay), kDone) << session->why();
  }
  const auto from = withoutIdleChanges(kit.control.commanded()).size();
  ASSERT_EQ(kit.run(kMounts), kDone) << kit.why();
  text.run(kMounts);
  EXPECT_EQ(text.mounted, (std::vector{2, 1}));
  EXPECT_EQ(text.control.crashes(), 0U);
  auto of_kit = withoutIdleChanges(kit.control.commanded()), of_text = withoutIdleChanges(text.control.commanded());
  const auto stop = std::ranges::find(of_kit, Commanded::Is::stop, &Commanded::is);
  ASSERT_NE(stop, of_kit.end());
  constexpr std::size_t kThen = 60;  // moves at balls of the second mount
  const auto until = static_cast<std::size_t>(stop - of_kit.begin()) + kThen;
  ASSERT_GT(of_text.size(), until);
  of_kit.resize(until);
  of_text.resize(until);
  expectSame(of_kit, of_text, from);
}

TEST_P(LoopProgram, KnowsThreeMounts) {
  for (const std::uint16_t mount : {std::uint16_t{3}, std::uint16_t{4}}) {
    OfAText text{GetParam(), 0};
    text.standByThePlate();
    text.control.plc().feign(gcode::loop::placeRead("probebox.step-mount")->word, mount);
    EXPECT_EQ(text.run(kDelay), mount == 3 ? kDone : kBeyond) << text.why() << text.alarm;
    EXPECT_EQ(text.mounted, (mount == 3 ? std::vector{3, 1} : std::vector<int>{}));
  }
}

TEST_P(LoopProgram, GoesToBallsOfATiltedTable) {
  for (const char word : {'A', 'B'}) {
    expectTheKitsMoves(GetParam(), {kDelay, kTablePivot, kPlateOnB}, word, [&](OfAText& text) {
      std::set<double> tilts;
      for (const auto& one : text.control.commanded()) {
        if (one.is == Commanded::Is::turn) tilts.insert(one.to.at(static_cast<std::size_t>(word - 'A')));
      }
      EXPECT_THAT(tilts, testing::Contains(testing::DoubleNear(-90, 1e-9)));
    });
  }
}

TEST_P(LoopProgram, TiltsNoTableOfWhichThePlacesSayNothing) {
  OfAText text{GetParam(), 0, 'B'};
  ASSERT_EQ(text.run(kDelay), kDone) << text.why() << text.alarm;
  text.program->set("_pb_table_word", 0);
  EXPECT_EQ(text.run(kTablePivot), kBeyond) << text.why() << text.alarm;
  text.program->set("_pb_table_word", 2);
  EXPECT_EQ(text.run({17}), kBeyond) << "B is no head; " << text.why() << text.alarm;
}

TEST_P(LoopProgram, GoesTheWayOfEveryKindAboveEverything) {
  for (const auto& [run, table] : std::initializer_list<std::pair<Asked, char>>{
           {kStepped, 0}, {kContour, 0}, {kShank, 0}, {kContacts, 0}, {kMounts, 'B'}, {kTablePivot, 'B'}}) {
    OfAText text{GetParam(), 0, table};
    if (run.method > 25) {
      text.program->set("_pb_dry", 2);
    } else {
      ASSERT_EQ(text.run(kDelay), kDone) << text.why() << text.alarm;
      text.program->set("_pb_dry", 2);
    }
    auto& control = text.control;
    text.standByThePlate();
    const auto contacts = control.contacts();
    const auto from = control.commanded().size();
    control.lowest_mm = 1e9;
    EXPECT_EQ(text.run(run), kDone) << run.method << ": " << text.why() << text.alarm;
    EXPECT_EQ(control.registers().value(address::step_state), 6) << "aborted";
    EXPECT_GE(control.lowest_mm, kSafeZ_mm - 1e-6) << run.method;
    EXPECT_EQ(control.contacts(), contacts) << run.method;
    EXPECT_EQ(control.crashes(), 0U) << run.method;
    EXPECT_TRUE(text.mounted.empty()) << "nobody has to move the plate for it";
    for (const auto& one : std::span{control.commanded()}.subspan(from)) {
      EXPECT_NE(one.is, Commanded::Is::arc) << "nothing stops it where the probe touches";
      EXPECT_TRUE(one.is != Commanded::Is::move || one.guarded);
    }
  }
}

TEST_P(LoopProgram, GoesItsWholeWayAboveEverythingFirst) {
  OfAText text{GetParam(), 1};
  auto& control = text.control;
  std::size_t dry_end = 0;
  control.at_stop = [&] {
    EXPECT_EQ(control.contacts(), 0U);
    EXPECT_GE(control.lowest_mm, kSafeZ_mm - 1e-6);
    EXPECT_EQ(control.registers().value(address::step_number), 0);
    EXPECT_EQ(control.registers().value(address::step_state), 1);
    dry_end = control.commanded().size();
  };
  ASSERT_EQ(text.run({4}), kDone) << text.why() << text.alarm;
  ASSERT_NE(dry_end, 0U);
  EXPECT_LT(control.lowest_mm, kSafeZ_mm - 20) << "then it measures";
  const auto& all = control.commanded();
  const auto dry = std::span{all}.first(dry_end);
  for (std::size_t i = dry_end; i < all.size(); ++i) {
    if (all[i].is != Commanded::Is::move) continue;
    const bool was_there = std::ranges::any_of(dry, [&](const Commanded& one) {
      return one.is == Commanded::Is::move && std::abs(one.to[0] - all[i].to[0]) < 1e-6 &&
             std::abs(one.to[1] - all[i].to[1]) < 1e-6;
    });
    EXPECT_TRUE(was_there) << "the dry run left out " << all[i].to[0] << " " << all[i].to[1];
  }
}

TEST_P(LoopProgram, EndsBehindADryRunThatIsAllThatWasAskedFor) {
  OfAText text{GetParam(), 2};
  EXPECT_EQ(text.run({4}), kDone) << text.why() << text.alarm;
  expectUntouched(text);
}

TEST_P(LoopProgram, RefusesAStepBeyondItsLimits) {
  for (const auto& [limit, most] : {std::pair{"_pb_most_feed", 200.0}, std::pair{"_pb_most_way", 0.3}}) {
    OfAText text{GetParam(), 0};
    text.program->set(limit, most);
    EXPECT_EQ(text.run({4}), kBeyond) << limit << text.why() << text.alarm;
    expectUntouched(text);
  }
}

TEST_P(LoopProgram, RefusesAKindThatItDoesNotKnow) {
  OfAText text{GetParam(), 0};
  text.control.plc().feign(gcode::loop::placeRead("probebox.step-kind")->word, 8);
  EXPECT_EQ(text.run({4}), kBeyond) << text.why() << text.alarm;
  expectUntouched(text);
}

TEST_P(LoopProgram, RisesAndStopsWhereTheBoxFallsSilentDuringATouch) {
  OfAText text{GetParam(), 0};
  auto& control = text.control;
  control.at_move = [&] { control.plc().setLine(control.contacts() == 0); };
  EXPECT_EQ(text.run({4}), kSilent) << text.why() << text.alarm;
  EXPECT_EQ(control.contacts(), 1U) << "no other touch";
  EXPECT_GE(control.position('Z'), kSafeZ_mm - 1e-6);
  EXPECT_EQ(control.crashes(), 0U);
}

TEST_P(LoopProgram, StopsWhereTheProbeTouchesOnTheWay) {
  OfAText text{GetParam(), 0};
  text.program->set("_pb_sphere_x", 120 - 14);
  EXPECT_THROW(text.program->call({4}), Alarm) << text.why();
  ASSERT_FALSE(text.control.commanded().empty());
  EXPECT_TRUE(text.control.commanded().back().guarded);
  EXPECT_THAT(text.program->last, testing::AnyOf(testing::HasSubstr("PROBE TOUCHED"), testing::HasSubstr("SETAL")));
  EXPECT_EQ(text.control.contacts(), 1U);
}

// The first move of a call is up or nothing, wherever the machine stands and whatever the caller has active.
TEST_P(LoopProgram, BeginsStraightUpAndNeverDown) {
  for (const double height_mm : {-60.0, -130.0}) {
    OfAText text{GetParam(), 2};
    auto& control = text.control;
    control.move({150, 60, height_mm}, 6000, false);
    control.wait(1);
    std::vector<std::array<double, 3>> stood;
    control.at_move = [&] { stood.push_back({control.position('X'), control.position('Y'), control.position('Z')}); };
    const auto from = control.commanded().size();
    EXPECT_EQ(text.run({4}), kDone) << text.why() << text.alarm;
    ASSERT_FALSE(stood.empty());
    const auto first = std::ranges::find(control.commanded().begin() + static_cast<std::ptrdiff_t>(from),
                                         control.commanded().end(), Commanded::Is::move, &Commanded::is);
    ASSERT_NE(first, control.commanded().end());
    if (height_mm < kSafeZ_mm) {
      EXPECT_NEAR(first->to[0], 150, 1e-6);
      EXPECT_NEAR(first->to[1], 60, 1e-6);
      EXPECT_NEAR(first->to[2], kSafeZ_mm, 1e-6);
    } else {
      EXPECT_NEAR(first->to[2], height_mm, 1e-6) << "above the safe height it has nothing to rise to";
    }
  }
}

TEST_P(LoopProgram, EndsBeforeAMoveWhereTheLengthOfTheToolIsNotKnown) {
  OfAText text{GetParam(), 0};
  OfTheKit kit{0};
  for (const unsigned tool : {3U, 150U}) {
    text.control.putIntoSpindle(tool);
    kit.control.putIntoSpindle(tool);
    EXPECT_THROW(text.program->call({4}), Alarm) << tool;
    EXPECT_THROW(kit.run({4}), Alarm) << tool;
  }
  EXPECT_TRUE(text.control.commanded().empty());
  EXPECT_TRUE(kit.control.commanded().empty());
}

// Many a changer moves the axes.
TEST_P(LoopProgram, GoesOnFromWhereAToolChangeHasLeftTheMachine) {
  OfAText text{GetParam(), 0};
  auto& control = text.control;
  text.control.takeTool(2);
  const auto from = control.commanded().size();
  control.at_tool = [&] { control.shove({10, 20, -30}); };
  EXPECT_EQ(text.run({4}), kDone) << text.why() << text.alarm;
  const auto& all = control.commanded();
  const auto change = std::ranges::find(all.begin() + static_cast<std::ptrdiff_t>(from), all.end(), Commanded::Is::tool,
                                        &Commanded::is);
  ASSERT_NE(change, all.end());
  const auto next = std::ranges::find(change, all.end(), Commanded::Is::move, &Commanded::is);
  ASSERT_NE(next, all.end());
  EXPECT_NEAR(next->to[2], -30, 1e-6) << "X and Y move at the height of the change";
}

TEST_P(LoopProgram, TellsNoPlaceToTheBoxWhereItsAxesAreAbsolute) {
  OfAText text{GetParam(), 2};
  text.program->set("_pb_home", 0);
  const auto homed = text.control.registers().value(address::home_commit);
  EXPECT_EQ(text.run({4}), kDone) << text.why() << text.alarm;
  EXPECT_EQ(text.control.registers().value(address::home_commit), homed);
}

class FanucLoop : public testing::Test {
 protected:
  static void expectGivenBack(const FanucProgram& program) {
    const FanucProgram& before = *untouched().program_;
    for (const int group : {4002, 4003, 4005, 4014, 4015})
      EXPECT_EQ(program.modal.at(group), before.modal.at(group)) << group;
    EXPECT_EQ(program.offsets, before.offsets);
  }
  static FanucProgram& programOf(OfAText& text) { return dynamic_cast<FanucProgram&>(*text.program); }

 private:
  struct Untouched {
    OfAText text{"fanuc", 0};
    FanucProgram* program_ = &programOf(text);
  };
  static const Untouched& untouched() {
    static const Untouched one;
    return one;
  }
};

TEST_F(FanucLoop, GivesTheStateOfTheControlBack) {
  OfAText text{"fanuc", 2};
  EXPECT_EQ(text.run({4}), kDone) << text.alarm;
  expectGivenBack(programOf(text));
  text.program->set("_pb_most_way", 0.3);
  EXPECT_EQ(text.run({4}), kBeyond);
  expectGivenBack(programOf(text));
}

TEST_F(FanucLoop, GivesItBackWhereTheProbeHasTouched) {
  OfAText text{"fanuc", 0};
  text.program->set("_pb_sphere_x", 120 - 14);
  EXPECT_THROW(text.program->call({4}), Alarm);
  expectGivenBack(programOf(text));
}

TEST_F(FanucLoop, KeepsTheValuesOfG59OverAReset) {
  OfAText text{"fanuc", 2};
  text.control.at_stop = [] { throw std::runtime_error{"reset"}; };
  text.program->set("_pb_dry", 1);
  EXPECT_THROW(text.program->call({4}), std::runtime_error);
  EXPECT_EQ(programOf(text).offsets.at(59)[0], 0);
  text.program->set("_pb_dry", 2);
  text.run({4});
  EXPECT_EQ(programOf(text).offsets.at(59)[0], 7);
}

TEST_F(FanucLoop, RefusesWhatWouldBendTheWay) {
  for (const auto& [group, code] :
       {std::pair{4011, 51.0}, {4016, 68.0}, {4022, 51.1}, {4006, 20.0}, {4007, 41.0}, {4008, 43.4}}) {
    OfAText text{"fanuc", 0};
    programOf(text).modal[group] = code;
    EXPECT_THROW(text.program->call({4}), Alarm) << group;
    EXPECT_THAT(text.program->last, testing::HasSubstr("CA")) << group;
    EXPECT_TRUE(text.control.commanded().empty()) << group;
  }
  OfAText text{"fanuc", 0};
  programOf(text).local = {0, 5, 0};
  EXPECT_THROW(text.program->call({4}), Alarm);
  EXPECT_THAT(text.program->last, testing::HasSubstr("CANCEL G52 G92"));
  EXPECT_TRUE(text.control.commanded().empty());
}

TEST_F(FanucLoop, ChangesTheToolAlthoughTheCallSaysThatItIsThere) {
  for (const bool builders : {false, true}) {
    OfAText text{"fanuc", 2};
    text.control.move({20, 20, -120}, 6000, false);
    text.control.wait(1);
    text.control.takeTool(2);
    programOf(text).commanded_tool = 1;  // it waits in the changer
    if (builders) text.program->set("_pb_spindle_at", FanucProgram::kToolOfTheBuilder);
    EXPECT_EQ(text.run({4}), kDone) << text.alarm;
    const auto& all = text.control.commanded();
    ASSERT_GT(all.size(), 4U);
    EXPECT_EQ(all[3].is, Commanded::Is::tool);
    EXPECT_EQ(all[3].to[0], 1);
    EXPECT_EQ(all[2].is, Commanded::Is::move);
    EXPECT_GE(all[2].to[2], builders ? -50 : kSafeZ_mm) << "tool 2 is 50 mm longer than the probe";
  }
}

TEST(SiemensLoop, GivesTheStateOfTheControlBack) {
  OfAText text{"siemens", 2};
  auto& program = dynamic_cast<SiemensProgram&>(*text.program);
  const auto before = program.modes;
  EXPECT_EQ(text.run({4}), kDone) << text.alarm;
  EXPECT_EQ(program.modes, before);
}

TEST(SiemensLoop, HasNoLengthActiveBehindAnotherTool) {
  OfAText text{"siemens", 2};
  text.control.takeTool(2);
  EXPECT_EQ(text.run({4}), kDone) << text.alarm;
  EXPECT_EQ(dynamic_cast<SiemensProgram&>(*text.program).modes.at('D'), 0);
}

TEST(SiemensLoop, RefusesATransformation) {
  OfAText text{"siemens", 0};
  dynamic_cast<SiemensProgram&>(*text.program).transformation = 1;
  EXPECT_THROW(text.program->call({4}), Alarm);
  EXPECT_TRUE(text.control.commanded().empty());
}

INSTANTIATE_TEST_SUITE_P(Of, LoopProgram, testing::Values("fanuc", "siemens"),
                         [](const auto& given) { return given.param; });

}  // namespace
}  // namespace probebox::scenario
