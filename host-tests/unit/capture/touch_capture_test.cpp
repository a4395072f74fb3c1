#include "firmware/capture/touch_capture.hpp"

#include <cmath>
#include <gtest/gtest.h>

#include "firmware/capture/touch_dataset.hpp"
#include "firmware/capture/turn_until_contact.hpp"
#include "locked_clock.hpp"

namespace probebox::capture {
namespace {

constexpr Nanoseconds kPeriod{1'000'000};
constexpr TouchRequest kTouch{
    .step = 3, .outward_normal = {1, 0, 0}, .retract_direction = {1, 0, 0}, .retract_speed_mm_s = 20};

void latchAll(TouchCapture& capture, std::int64_t at_ns, std::array<std::int64_t, 3> counts) {
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis) {
    capture.push(Count{.axis = static_cast<Axis>(axis), .sequence = 0, .counts = counts[axis], .at = monoTime(at_ns)});
  }
}

void sampleProbe(TouchCapture& capture, std::int64_t at_ns, bool clipped = false) {
  capture.push(
      Deflection{.sequence = 0, .channels_nm = {1000, -2000, 3000}, .clipped = clipped, .at = monoTime(at_ns)});
}

// Ten rows of each stream.
void recordTouch(TouchCapture& capture, const TouchRequest& request = kTouch) {
  capture.begin(request);
  for (std::int64_t i = 0; i < 10; ++i) {
    latchAll(capture, 2'000'000 * i, {i, 10 * i, -i});
    sampleProbe(capture, 1'000'000 * i + 500'000);
  }
}

TEST(TouchCapture, KeepsEveryRowBetweenBeginAndEndAndNoneOutside) {
  TouchCapture capture{Capacity{}};
  latchAll(capture, 1, {1, 1, 1});
  sampleProbe(capture, 1);
  recordTouch(capture);
  EXPECT_EQ(capture.end(kLocked), TouchFault::none);
  latchAll(capture, 99, {1, 1, 1});
  ASSERT_EQ(capture.recording().touches().size(), 1U);
  const Touch& touch = capture.recording().touches().front();
  EXPECT_EQ(capture.recording().machineRows(touch).size(), 10U);
  EXPECT_EQ(capture.recording().probeRows(touch).size(), 10U);
  EXPECT_EQ(touch.request.step, 3U);
}

TEST(TouchCapture, JoinsOnlyAxesThatWereLatchedTogetherAndCountsTheRest) {
  TouchCapture capture{Capacity{}};
  recordTouch(capture);
  capture.push(Count{.axis = Axis::x, .sequence = 0, .counts = 5, .at = monoTime(50)});
  latchAll(capture, 60, {1, 2, 3});
  ASSERT_EQ(capture.end(kLocked), TouchFault::none);
  EXPECT_EQ(capture.recording().machineRowCount(), 11U);
  EXPECT_EQ(capture.incompleteRows(), 1U);
}

TEST(TouchCapture, DropsAFaultyTouchWholeAndSaysWhy) {
  TouchCapture capture{Capacity{}};
  recordTouch(capture);
  sampleProbe(capture, 70, /*clipped=*/true);
  EXPECT_EQ(capture.end(kLocked), TouchFault::probe_clipped);

  recordTouch(capture);
  capture.push(SourceLost{.source = Source::probe, .reason = LossReason::disconnected, .lost = 0, .at = monoTime(1)});
  EXPECT_EQ(capture.end(kLocked), TouchFault::source_lost);

  recordTouch(capture);
  TickMap holdover = kLocked;
  holdover.state = ClockState::holdover;
  EXPECT_EQ(capture.end(holdover), TouchFault::clock_not_locked);

  capture.begin(kTouch);
  for (int i = 0; i < 10; ++i) latchAll(capture, i, {0, 0, 0});
  EXPECT_EQ(capture.end(kLocked), TouchFault::no_probe_rows);

  EXPECT_EQ(capture.recording().touches().size(), 0U);
  EXPECT_EQ(capture.recording().machineRowCount(), 0U);
  EXPECT_EQ(capture.recording().probeRowCount(), 0U);
}

TEST(TouchCapture, RefusesATouchThatDoesNotFitAndKeepsTheOnesBefore) {
  TouchCapture capture{Capacity{.machine_rows = 15, .probe_rows = 100, .touches = 10}};
  recordTouch(capture);
  EXPECT_EQ(capture.end(kLocked), TouchFault::none);
  recordTouch(capture);
  EXPECT_EQ(capture.end(kLocked), TouchFault::recording_full);
  EXPECT_EQ(capture.recording().touches().size(), 1U);
}

// A second with a contact from 300 ms to 600 ms, whose positions come in its first and last tenth alone.
TouchFault touchedWithoutPositions(TouchCapture& capture, bool by_edges) {
  TouchRequest request = kTouch;
  request.by_edges = by_edges;
  capture.begin(request);
  for (std::int64_t ms = 0; ms < 1000; ++ms) {
    const std::int64_t at_ns = 1'000'000 * ms;
    if (ms < 100 || ms >= 900) latchAll(capture, at_ns, {ms, 0, 0});
    const std::int32_t pushed_nm = ms >= 300 && ms < 600 ? 100'000 : 0;
    capture.push(Deflection{.sequence = 0, .channels_nm = {pushed_nm, 0, 0}, .clipped = false, .at = monoTime(at_ns)});
  }
  capture.push(Edge{LineRole::trigger, 0, Level::active, 0, monoTime(300'000'000)});
  capture.push(Edge{LineRole::trigger, 0, Level::inactive, 1, monoTime(600'000'000)});
  return capture.end(kLocked);
}

TEST(TouchCapture, RepeatsATouchWithoutPositionsAtItsContact) {
  for (const bool by_edges : {false, true}) {
    TouchCapture capture{Capacity{}};
    recordTouch(capture);
    ASSERT_EQ(capture.end(kLocked), TouchFault::none);
    EXPECT_EQ(touchedWithoutPositions(capture, by_edges), TouchFault::no_machine_rows) << by_edges;
    EXPECT_EQ(capture.recording().touches().size(), 1U);
    EXPECT_EQ(capture.recording().machineRowCount(), 10U);
    EXPECT_EQ(capture.recording().probeRowCount(), 10U);
  }
}

// Edges of a switch at these times, ms, in a touch by the edges of `asked`; the levels alternate, beginning with
// contact.
TouchFault touchedBySwitch(TouchCapture& capture, std::initializer_list<std::int64_t> edges_ms,
                           SwitchOf of = SwitchOf::probe, SwitchOf asked = SwitchOf::probe) {
  TouchRequest request = kTouch;
  request.by_edges = true;
  request.switch_of = asked;
  capture.begin(request);
  for (std::int64_t i = 0; i < 500; ++i) latchAll(capture, 2'000'000 * i, {i, 10 * i, -i});
  Level level = Level::active;
  for (const auto at_ms : edges_ms) {
    capture.push(Edge{LineRole::trigger, 0, level, 0, monoTime(at_ms * 1'000'000)}, of);
    level = level == Level::active ? Level::inactive : Level::active;
  }
  return capture.end(kLocked);
}

TEST(TouchCapture, TakesTheFirstOpeningAndTheFirstClosingOfASwitchThatBounces) {
  TouchCapture capture{Capacity{}};
  ASSERT_EQ(touchedBySwitch(capture, {100, 101, 103, 300, 301, 302}), TouchFault::none);
  const auto& touch = capture.recording().touches().front();
  EXPECT_EQ(touch.contact, monoTime(100'000'000));
  EXPECT_EQ(touch.release, monoTime(300'000'000));
}

TEST(TouchCapture, TakesAReleaseSoonAfterTheChatterOfTheContact) {
  TouchCapture capture{Capacity{}};
  ASSERT_EQ(touchedBySwitch(capture, {100, 101, 103, 110, 111, 113}), TouchFault::none);
  EXPECT_EQ(capture.recording().touches().front().release, monoTime(110'000'000));
}

TEST(TouchCapture, RepeatsATouchWithASecondContactHoweverSoonItBegins) {
  for (const auto edges_ms : {std::initializer_list<std::int64_t>{100, 300, 315, 415},
                              {85, 90, 100, 300},
                              {100, 300, 321, 415},
                              {100, 300, 302, 415}}) {
    TouchCapture capture{Capacity{}};
    EXPECT_EQ(touchedBySwitch(capture, edges_ms), TouchFault::triggered_twice);
  }
}

TEST(TouchCapture, RepeatsATouchWhoseSwitchDidSomethingElse) {
  TouchCapture capture{Capacity{}};
  EXPECT_EQ(touchedBySwitch(capture, {100, 200, 300, 400}), TouchFault::triggered_twice);
  EXPECT_EQ(touchedBySwitch(capture, {}), TouchFault::no_trigger);
  EXPECT_EQ(touchedBySwitch(capture, {100, 200}, SwitchOf::tool_setter), TouchFault::no_trigger) << "another line";
  EXPECT_EQ(touchedBySwitch(capture, {500}), TouchFault::no_trigger);
  EXPECT_EQ(touchedBySwitch(capture, {600, 700}), TouchFault::still_deflected) << "it never closed again";
  EXPECT_EQ(touchedBySwitch(capture, {800, 900}), TouchFault::none);
}

TEST(TouchCapture, RepeatsATouchOfTheToolSettingDeviceWithASecondContact) {
  const auto touched = [](TouchCapture& capture, std::initializer_list<std::int64_t> edges_ms) {
    return touchedBySwitch(capture, edges_ms, SwitchOf::tool_setter, SwitchOf::tool_setter);
  };
  TouchCapture capture{Capacity{}};
  EXPECT_EQ(touched(capture, {100, 200, 500, 600}), TouchFault::triggered_twice);
  EXPECT_EQ(touched(capture, {100, 200, 221, 600}), TouchFault::triggered_twice);
  ASSERT_EQ(touched(capture, {100, 101, 103, 104, 106, 300, 302, 303, 320, 321}), TouchFault::none) << "it bounces";
  const auto& touch = capture.recording().touches().front();
  EXPECT_EQ(touch.contact, monoTime(100'000'000));
  EXPECT_EQ(touch.release, monoTime(321'000'000));
}

// Ten readings a second of the screw of Y, over a stated time.
TouchFault rested(double readings_s, double moved_counts = 0) {
  TouchCapture capture{Capacity{}, {1e-3, 1e-3, 1e-3}};
  TouchRequest request;
  request.outward_normal = request.retract_direction = {0, 1, 0};
  request.sweeps = true;
  request.rest_s = 60;
  capture.begin(request);
  for (std::int64_t i = 0; i < 60; ++i)
    latchAll(capture, 1'000'000'000 * i, {0, i == 30 ? static_cast<std::int64_t>(moved_counts) : 0, 0});
  for (std::int64_t i = 0; static_cast<double>(i) < 10 * readings_s; ++i)
    capture.push(Drift{Axis::y, 1000, monoTime(100'000'000 * i)});
  return capture.end(kLocked);
}

TEST(TouchCapture, RepeatsARestThatIsTooShortOrThatMoves) {
  EXPECT_EQ(rested(60), TouchFault::none);
  EXPECT_EQ(rested(55), TouchFault::rest_too_short);
  EXPECT_EQ(rested(60, 15), TouchFault::none) << "15 um: servo and encoder noise";
  EXPECT_EQ(rested(60, 50), TouchFault::moved);
  EXPECT_EQ(rested(0.2), TouchFault::no_drift_rows);
}

// A second of a scan whose probe is deflected by so much; both streams without what lies in the hole. every_ms: between
// positions.
TouchFault scanned(std::int32_t deflection_nm, std::int64_t hole_ms = 0, bool of_probe = true,
                   std::int64_t every_ms = 1) {
  TouchCapture capture{Capacity{}};
  TouchRequest request = kTouch;
  request.scan.count = 1;
  capture.begin(request);
  const auto isThere = [&](std::int64_t ms, bool probe) {
    return probe != of_probe || ms < 400 || ms >= 400 + hole_ms;
  };
  for (std::int64_t ms = 0; ms < 1000; ++ms) {
    if (isThere(ms, false) && ms % every_ms == 0) latchAll(capture, 1'000'000 * ms, {ms, 0, 0});
    const std::int32_t now_nm = ms == 700 ? deflection_nm : 300'000;
    if (isThere(ms, true))
      capture.push(
          Deflection{.sequence = 0, .channels_nm = {0, now_nm, 0}, .clipped = false, .at = monoTime(1'000'000 * ms)});
  }
  return capture.end(kLocked);
}

TEST(TouchCapture, RepeatsAScanThatComesOffTheSurfaceOrHasAHole) {
  EXPECT_EQ(scanned(-300'000), TouchFault::none);
  EXPECT_EQ(scanned(6'000), TouchFault::none);
  EXPECT_EQ(scanned(2'000), TouchFault::contact_lost) << "one sample is enough: noise is far below";
  EXPECT_EQ(scanned(300'000, 5), TouchFault::none) << "the solver leaves a short gap out";
  for (const bool of_probe : {true, false}) EXPECT_EQ(scanned(300'000, 15, of_probe), TouchFault::samples_missing);
  EXPECT_EQ(scanned(300'000, 0, false, 20), TouchFault::none) << "a control that tells its positions at 50 Hz";
  EXPECT_EQ(scanned(300'000, 100, false, 20), TouchFault::samples_missing);
}

// C turns from 0 at 0.1 rad/s for 10 s and back, while a switch is open between these times, or a probe is pushed.
struct Turning {
  bool by_switch{true};
  double asked_rad{1};         // towards this
  double sense{1};             // in which C really turns
  double from_s{4}, to_s{16};  // contact
  bool encoder{true};
  double moved_counts{};
};
TouchFault turned(const Turning& how, TouchCapture& capture) {
  TouchRequest request = kTouch;
  request.by_edges = how.by_switch;
  request.switch_of = SwitchOf::probe;
  request.until_contact = TurnOfC{.line_rad = 0.5, .to_rad = how.asked_rad, .speed_rad_s = 0.1};
  capture.begin(request);
  for (std::int64_t i = 0; i <= 4000; ++i) {
    const double t_s = 0.005 * static_cast<double>(i), c_rad = how.sense * 0.1 * (t_s < 10 ? t_s : 20 - t_s);
    const std::int64_t at_ns = 5'000'000 * i;
    latchAll(capture, at_ns, {i == 2000 ? static_cast<std::int64_t>(how.moved_counts) : 0, 0, 0});
    if (how.encoder) capture.push(AngleRow{monoTime(at_ns), c_rad});
    const bool touches = t_s >= how.from_s && t_s < how.to_s;
    const auto pushed_nm = static_cast<std::int32_t>(touches ? 100'000 : 0);
    if (!how.by_switch)
      capture.push(
          Deflection{.sequence = 0, .channels_nm = {pushed_nm, 0, 5}, .clipped = false, .at = monoTime(at_ns)});
  }
  std::uint32_t edges = 0;
  for (const double at_s : {how.from_s, how.to_s}) {
    const Level level = edges++ == 0 ? Level::active : Level::inactive;
    if (how.by_switch && at_s > 0)
      capture.push(Edge{LineRole::trigger, 0, level, edges, monoTime(std::llround(1e9 * at_s))}, SwitchOf::probe);
  }
  return capture.end(kLocked);
}
TouchFault turned(const Turning& how) {
  TouchCapture capture{Capacity{}, {1e-3, 1e-3, 1e-3}};
  return turned(how, capture);
}

TEST(TurnUntilContact, KeepsTheAnglesOfCAroundTheContact) {
  for (const bool by_switch : {true, false}) {
    TouchCapture capture{Capacity{}};
    ASSERT_EQ(turned({.by_switch = by_switch}, capture), TouchFault::none);
    EXPECT_TRUE(capture.recording().touches().empty()) << "a ball's centre does not follow from it";
    ASSERT_EQ(capture.recording().contacts().size(), 1U);
    const auto& touch = capture.recording().contacts().front();
    const auto angles = capture.recording().angleRows(touch);
    EXPECT_LT(angles.size(), 2100U) << "a row in 10 ms";
    EXPECT_NEAR(*angleAt(angles, monoTime(4'003'000'000)), 0.4003, 1e-12);
    EXPECT_FALSE(angleAt(angles, monoTime(20'100'000'000)));
  }
}

TEST(TurnUntilContact, IsRepeatedWhereNothingTouchesOrFromTheWrongSide) {
  for (const bool by_switch : {true, false}) {
    EXPECT_EQ(turned({.by_switch = by_switch, .from_s = -1, .to_s = -1}), TouchFault::no_contact);
    EXPECT_EQ(turned({.by_switch = by_switch, .sense = -1}), TouchFault::wrong_side);
    EXPECT_EQ(turned({.by_switch = by_switch, .asked_rad = -1, .sense = -1}), TouchFault::none) << "asked for";
    EXPECT_EQ(turned({.by_switch = by_switch, .encoder = false}), TouchFault::no_angles);
    EXPECT_EQ(turned({.by_switch = by_switch, .moved_counts = 50}), TouchFault::moved) << "the stylus has to stand";
  }
  EXPECT_EQ(turned({.to_s = -1}), TouchFault::no_trigger) << "it never closed again";
}

TEST(TouchDataset, GivesMillimetresWithSenseAndMasterSecondsFromTheTouchesOwnStart) {
  TouchCapture capture{Capacity{}};
  recordTouch(capture);
  TickMap slow = kLocked;
  slow.period_q32_ns += slow.period_q32_ns / 10'000;  // the master clock runs 100 ppm slow against the kernel's
  ASSERT_EQ(capture.end(slow), TouchFault::none);
  const auto dataset = touchDataset(capture.recording(), {.mm_per_count = {0.5, 0.5, -0.25}, .nominal_period = kPeriod},
                                    "delay-multi-speed");
  EXPECT_EQ(dataset.method, "delay-multi-speed");
  const auto& machine = *dataset.table("machine");
  const auto& probe = *dataset.table("probe");
  ASSERT_EQ(machine.rows(), 10U);
  EXPECT_EQ(machine.column("x_mm")->at(4), 2.0);
  EXPECT_EQ(machine.column("y_mm")->at(4), 20.0);
  EXPECT_EQ(machine.column("z_mm")->at(4), 1.0);
  EXPECT_EQ(machine.column("touch")->at(4), 3.0);
  EXPECT_EQ(machine.column("t_s")->front(), 0.0);
  EXPECT_NEAR(machine.column("t_s")->back(), 0.018 / 1.0001, 1e-15);
  EXPECT_NEAR(probe.column("t_s")->front(), 0.0005 / 1.0001, 1e-15);
  EXPECT_NEAR(probe.column("b")->front(), -0.002, 1e-15);
  EXPECT_EQ(dataset.table("touches")->column("speed_mm_s")->front(), 20.0);
}

TEST(TouchDataset, GivesPositionsOfTheUncorrectedMachine) {
  Recording recording{Capacity{}};
  for (std::int64_t i = 0; i < 5; ++i) {
    recording.append(MachineRow{monoTime(1000 * i), {100, 200, 300}, {0, -2'500'000, static_cast<std::int32_t>(i)}});
    recording.append(ProbeRow{monoTime(1000 * i), {}});
  }
  recording.setOffsets({10, 20, -30});
  recording.append(
      Touch{.request = kTouch, .map = kLocked, .machine_begin = 0, .machine_end = 5, .probe_begin = 0, .probe_end = 5});
  const auto dataset =
      touchDataset(recording, {.mm_per_count = {0.01, 0.01, 0.01}, .nominal_period = kPeriod}, "delay-multi-speed");
  const auto& machine = *dataset.table("machine");
  EXPECT_DOUBLE_EQ(machine.column("x_mm")->at(4), 10 + 1);
  EXPECT_DOUBLE_EQ(machine.column("y_mm")->at(4), 20 + 4.5) << "it stood 2.5 mm lower because it had been told to";
  EXPECT_DOUBLE_EQ(machine.column("z_mm")->at(4), -30 + 3 - 4e-6);
}

}  // namespace
}  // namespace probebox::capture
