#include "firmware/app/results/results_in_force.hpp"

#include <atomic>
#include <cmath>
#include <gmock/gmock.h>
#include <memory>
#include <optional>
#include <thread>
#include <utility>

#include "firmware/app/results/calibrations.hpp"
#include "firmware/app/results/connection_inhibits.hpp"
#include "host-tests/decided/decided.hpp"
#include "host-tests/support/temporary_folder.hpp"

namespace probebox::app {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

const Mounting kOnTheMill{"P-1001", "mill 3", "spindle"};

metrology::Result delayOf(double tau_s) {
  metrology::Result result;
  result.method = "delay-multi-speed";
  result.estimates = {metrology::Estimate::scalar("tau_s", tau_s, 4e-6)};
  return result;
}

std::optional<CutLock> unlessHeld(bool held) {
  return held ? std::nullopt : std::optional<CutLock>{std::in_place};
}

class InForce : public testing::Test {
 protected:
  // A box that follows no delay longer than the longest one.
  ResultsInForce boxWith(double longest_s, const Mounting& mounting = kOnTheMill) {
    told_.clear();
    return {store_, mounting, [] { return MonoTime{5s}; },
            [longest_s](std::span<const Event> events) -> std::optional<Error> {
              const auto* delay = std::get_if<DelayActivated>(&events.front());
              if (delay == nullptr || delay->tau_s[0] <= longest_s) return std::nullopt;
              return Error{"the delay is too long for the sources of this box"};
            },
            [this](const Event& event) { told_.push_back(event); }};
  }

  // No cut is on, and that has been known for long enough.
  static void letChange(ResultsInForce& results) {
    box::State state{};
    state.events = 1;
    results.look(state);
    state.at = MonoTime{2s};
    results.look(state);
  }

  store::Id propose(double tau_s) {
    const store::Binding binding{"delay", kOnTheMill.probe_serial_number, kOnTheMill.machine, kOnTheMill.mounting};
    const auto id = store_.propose(binding, delayOf(tau_s), "", "2026-01-01T00:00:00Z");
    EXPECT_TRUE(id);
    return id ? *id : 0;
  }

  support::TemporaryFolder folder_{support::inMemory()};
  store::Store store_ = store::Store::open(folder_.file("results.db")).value();
  std::vector<Event> told_;
};

// A connection's inhibit is on the disk before the core has heard of it.
TEST_F(InForce, WaitsForAConnectionThatHoldsACutWhichTheCoreDoesNotKnowOf) {
  auto results = boxWith(1e9);
  letChange(results);
  bool held = true;
  results.setCutGuards([&held] { return unlessHeld(held); });
  const auto id = propose(0.004);
  const auto accepted = results.accept(id, "Ada");
  ASSERT_TRUE(accepted);
  EXPECT_TRUE(results.isWaiting(id));
  EXPECT_TRUE(told_.empty());
  letChange(results);
  EXPECT_TRUE(results.isWaiting(id)) << "the core knows of no cut, and the connection holds one";
  held = false;
  letChange(results);
  EXPECT_FALSE(results.isWaiting(id));
  EXPECT_EQ(told_.size(), 1U);
}

// Stored by an older firmware, or by a mind of its own.
TEST_F(InForce, IsNothingThatTheMachineCannotBe) {
  auto mounting = kOnTheMill;
  mounting.travel = {{{-50, 450}, {-50, 350}, {-400, 50}}};
  auto results = boxWith(1e9, mounting);
  letChange(results);
  metrology::Result length;
  length.method = "tool-assembly";
  const store::Binding binding{"assembly-4", mounting.probe_serial_number, mounting.machine, mounting.mounting};
  for (const double nonsense_mm : {std::nan(""), 1e6}) {
    length.estimates = {metrology::Estimate::scalar("gauge_length_mm", nonsense_mm, 1e-3)};
    const auto id = store_.propose(binding, length, "", "2026-01-01T00:00:00Z").value();
    const auto accepted = results.accept(id, "Ada");
    ASSERT_FALSE(accepted);
    EXPECT_THAT(accepted.error().what, testing::HasSubstr("gauge_length_mm"));
    ASSERT_TRUE(decided::accept(store_, id, "Ada", "2026-01-01T00:00:00Z")) << "as an older firmware did";
    auto restarted = boxWith(1e9, mounting);
    EXPECT_THAT(restarted.restore(), IsEmpty());
    EXPECT_THAT(restarted.active(), IsEmpty());
  }
}

TEST_F(InForce, IsWhatThePersonAcceptedAndTheCoreFollows) {
  auto results = boxWith(0.1);
  EXPECT_THAT(results.restore(), IsEmpty());
  letChange(results);
  const auto id = propose(0.05);
  EXPECT_THAT(results.active(), IsEmpty());
  ASSERT_TRUE(results.accept(id, "Ada"));
  EXPECT_THAT(results.active(), ElementsAre(id));
  ASSERT_EQ(told_.size(), 1U);
  EXPECT_EQ(std::get<DelayActivated>(told_.front()).tau_s[0], 0.05);
  auto restarted = boxWith(0.1);
  EXPECT_EQ(restarted.restore().size(), 1U);
  EXPECT_THAT(restarted.active(), ElementsAre(id));
}

// Plates across X after touches all around a sphere: Y and Z keep what was measured of them, also behind a restart and
// where one of the two is gone back from.
TEST_F(InForce, ADelayIsOfTheAxesThatItsResultObserved) {
  auto results = boxWith(0.1);
  letChange(results);
  const auto proposeAbout = [&](const std::string& subject, double tau_s) {
    const store::Binding binding{subject, kOnTheMill.probe_serial_number, kOnTheMill.machine, kOnTheMill.mounting};
    metrology::Result result;
    result.method = "delay-plates";
    result.estimates = {metrology::Estimate::scalar("tau_s", tau_s, 1e-5)};
    return store_.propose(binding, result, "", "2026-01-01T00:00:00Z").value();
  };
  const auto delays = [](const Event& event) {
    const auto& delay = std::get<DelayActivated>(event);
    return std::pair{delay.tau_s, delay.sd_s};
  };
  using Axes = std::array<double, kLinearAxes>;
  const auto x = proposeAbout("delay-x", 0.002);
  ASSERT_TRUE(results.accept(x, "Ada"));
  EXPECT_EQ(delays(told_.back()), (std::pair{Axes{0.002, 0, 0}, Axes{1e-5, 0, 0}})) << "Y and Z were never measured";
  const auto all = proposeAbout("delay", 0.004);
  ASSERT_TRUE(results.accept(all, "Ada"));
  EXPECT_EQ(delays(told_.back()).first, (Axes{0.004, 0.004, 0.004})) << "the newest of each axis";
  const auto again = proposeAbout("delay-x", 0.003);
  ASSERT_TRUE(results.accept(again, "Ada", true));
  EXPECT_EQ(delays(told_.back()).first, (Axes{0.003, 0.004, 0.004}));
  EXPECT_EQ(std::get<DelayActivated>(told_.back()).result_id, again);
  {
    auto restarted = boxWith(0.1);
    const auto restored = restarted.restore();
    ASSERT_EQ(restored.size(), 1U);
    EXPECT_EQ(delays(restored.front()).first, (Axes{0.003, 0.004, 0.004}));
  }
  ASSERT_TRUE(results.rollBack("delay", "Ada"));
  EXPECT_EQ(delays(told_.back()), (std::pair{Axes{0.003, 0, 0}, Axes{1e-5, 0, 0}}));
  ASSERT_TRUE(results.rollBack("delay-x", "Ada"));
  EXPECT_EQ(delays(told_.back()).first, (Axes{0.002, 0, 0})) << "the one before it is back";
}

TEST_F(InForce, NoResultIsThatFitsTheBoxNoMore) {
  auto results = boxWith(0.1);
  letChange(results);
  const auto id = propose(0.05);
  ASSERT_TRUE(results.accept(id, "Ada"));
  auto other_sources = boxWith(0.01);
  EXPECT_THAT(other_sources.restore(), IsEmpty());
  EXPECT_THAT(other_sources.active(), IsEmpty()) << "the store calls it active, but nothing follows it";
  letChange(other_sources);
  const auto refused = other_sources.accept(id, "Ada");
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().reason, store::Reason::not_possible_now);
  ASSERT_TRUE(other_sources.rollBack(id, "Ada")) << "one can still go back from it";
  EXPECT_THAT(other_sources.restore(), IsEmpty());
}

TEST_F(InForce, NoResultComesBackThatFitsTheBoxNoMore) {
  auto results = boxWith(0.1);
  letChange(results);
  ASSERT_TRUE(results.accept(propose(0.05), "Ada"));
  auto other_sources = boxWith(0.01);
  letChange(other_sources);
  const auto second = propose(0.005);
  ASSERT_TRUE(other_sources.accept(second, "Ada", true));
  told_.clear();
  for (const bool by_number : {false, true}) {
    const auto refused = by_number ? other_sources.rollBack(second, "Ada") : other_sources.rollBack("delay", "Ada");
    ASSERT_FALSE(refused) << "it would be said to be in force";
    EXPECT_EQ(refused.error().reason, store::Reason::not_possible_now);
    EXPECT_THAT(refused.error().what, testing::AllOf(HasSubstr("Result 1 "), HasSubstr("too long")));
  }
  EXPECT_THAT(told_, IsEmpty());
  EXPECT_THAT(other_sources.active(), ElementsAre(second));
  EXPECT_EQ(store_.find(second)->state, store::State::active) << "the store has not changed either";
}

TEST_F(InForce, NoWaitingResultIsThatFitsTheBoxNoMore) {
  auto results = boxWith(0.1);
  letChange(results);
  const auto first = propose(0.005), second = propose(0.05);
  ASSERT_TRUE(results.accept(first, "Ada"));
  results.setCutGuards([] { return unlessHeld(true); });
  ASSERT_TRUE(results.accept(second, "Ada", true));
  auto other_sources = boxWith(0.01);
  testing::internal::CaptureStderr();
  other_sources.restore();
  letChange(other_sources);
  letChange(other_sources);
  const auto logged = testing::internal::GetCapturedStderr();
  EXPECT_THAT(logged, HasSubstr("too long"));
  EXPECT_EQ(logged.find("too long"), logged.rfind("too long")) << "said once";
  EXPECT_THAT(told_, IsEmpty());
  EXPECT_THAT(other_sources.active(), ElementsAre(first)) << "it stays in force";
  EXPECT_TRUE(other_sources.isWaiting(second));
  EXPECT_THAT(other_sources.toRepeat(), ElementsAre(testing::AllOf(HasSubstr("waits"), HasSubstr("too long"))));
  ASSERT_TRUE(other_sources.rollBack(second, "Ada")) << "it can be withdrawn";
  EXPECT_THAT(other_sources.toRepeat(), IsEmpty());
}

TEST_F(InForce, NoResultIsOfAnotherMounting) {
  auto results = boxWith(0.1);
  letChange(results);
  ASSERT_TRUE(results.accept(propose(0.05), "Ada"));
  auto elsewhere = boxWith(0.1, {"P-1001", "mill 3", "turret"});
  EXPECT_THAT(elsewhere.restore(), IsEmpty());
  EXPECT_THAT(elsewhere.active(), IsEmpty());
}

// The centreline from a tip and the offset of that stylus, whose sum lies where this box corrects nothing.
TEST_F(InForce, NoSumOfTwoResultsIsThatDoesNotFitTheBox) {
  ResultsInForce results{store_, kOnTheMill, [] { return MonoTime{5s}; },
                         [](std::span<const Event> events) -> std::optional<Error> {
                           const bool sums = !events.empty() && std::holds_alternative<CentrelineActivated>(events[0]);
                           return sums ? std::optional{Error{"it is too far away"}} : std::nullopt;
                         },
                         [this](const Event& event) { told_.push_back(event); }};
  letChange(results);
  const auto accept = [&](const char* subject, const char* method, const char* key) {
    metrology::Result result;
    result.method = method;
    result.estimates = {metrology::Estimate::vector(key, {1, 2}, {1e-4, 1e-4})};
    const auto id = store_.propose(results.bindingFor(subject), result, "", "2026-01-01T00:00:00Z").value();
    const auto accepted = results.accept(id, "Ada");
    EXPECT_TRUE(accepted) << accepted.error().what;
    return accepted->notes;
  };
  accept("centreline-stylus", "centreline", "centre_mm");
  EXPECT_THAT(accept("stylus-offset-1", "spindle-offset-2x2", "stylus_offset_mm"),
              testing::Contains(testing::AllOf(HasSubstr("too far"), testing::Not(HasSubstr("is in force")))));
  EXPECT_THAT(told_, IsEmpty());
  EXPECT_FALSE(decided::active(store_, results.bindingFor("centreline")).value());
}

// A result of which the core hears nothing: the worker follows it.
class HeadInForce : public InForce {
 protected:
  std::unique_ptr<ResultsInForce> started() {
    auto results = std::make_unique<ResultsInForce>(
        store_, kOnTheMill, [] { return MonoTime{5s}; }, [](std::span<const Event>) { return std::optional<Error>{}; },
        [this](const Event& event) { told_.push_back(event); });
    results->restore();
    letChange(*results);
    return results;
  }
  store::Id proposeHead(std::vector<double> matrix, const std::string& subject = "sensor-head-5") {
    metrology::Result result;
    result.method = "sensor-head-calibration";
    const std::vector<double> sd(matrix.size(), 1e-4);
    result.estimates = {metrology::Estimate::matrix("sensor_matrix", 3, std::move(matrix), sd)};
    const store::Binding binding{subject, kOnTheMill.probe_serial_number, kOnTheMill.machine, kOnTheMill.mounting};
    return store_.propose(binding, result, "", "2026-01-01T00:00:00Z").value();
  }
};

TEST_F(HeadInForce, IsWhatThePersonAccepted) {
  const auto results = started();
  const auto id = proposeHead({1, 0, 0, 0, 1, 0, 0.5, 0, 1});
  EXPECT_FALSE(results->sensorHead(5)) << "it is proposed";
  ASSERT_TRUE(results->accept(id, "Ada"));
  const auto head = results->sensorHead(5);
  ASSERT_TRUE(head);
  EXPECT_EQ(head->result_id, id);
  EXPECT_EQ(head->tool, 5U);
  EXPECT_EQ(head->matrix[2][0], 0.5);
  EXPECT_EQ(head->sd[2][0], 1e-4);
  EXPECT_THAT(told_, IsEmpty());
  EXPECT_TRUE(started()->sensorHead(5)) << "after a restart as well";
  ASSERT_TRUE(results->rollBack("sensor-head-5", "Ada"));
  EXPECT_FALSE(results->sensorHead(5));
}

TEST_F(HeadInForce, IsWhatMethodsMeasureWith) {
  procedure::Facts facts;
  facts.sensor_head.emplace().tool = 5;
  Calibrations calibrations{store::Store::open(folder_.file("results.db")).value(),
                            kOnTheMill,
                            facts,
                            [] { return MonoTime{5s}; },
                            [](std::span<const Event>) { return std::optional<Error>{}; },
                            [](const Event&) { return true; }};
  letChange(calibrations.inForce());
  const auto id = proposeHead({1, 0, 0, 0, 1, 0, 0, 0, 1});
  EXPECT_FALSE(calibrations.factsNow().sensor_head->calibrated);
  ASSERT_TRUE(calibrations.inForce().accept(id, "Ada"));
  ASSERT_TRUE(calibrations.factsNow().sensor_head->calibrated);
  EXPECT_EQ(calibrations.factsNow().sensor_head->calibrated->result_id, id);
}

TEST_F(HeadInForce, IsOfEachHeadItsOwn) {
  const auto results = started();
  const auto fifth = proposeHead({1, 0, 0, 0, 1, 0, 0, 0, 1}),
             seventh = proposeHead({2, 0, 0, 0, 2, 0, 0, 0, 2}, "sensor-head-7");
  ASSERT_TRUE(results->accept(fifth, "Ada"));
  EXPECT_FALSE(results->sensorHead(7)) << "another head is in the spindle";
  ASSERT_TRUE(results->accept(seventh, "Ada"));
  EXPECT_EQ(results->sensorHead(5)->result_id, fifth);
  EXPECT_EQ(results->sensorHead(7)->result_id, seventh);
}

TEST_F(HeadInForce, CannotBeOfNobody) {
  const auto results = started();
  const auto refused = results->accept(proposeHead({1, 0, 0, 0, 1, 0, 0, 0, 1}, "sensor-head-calibration"), "Ada");
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().what, testing::HasSubstr("sensor head"));
}

TEST_F(HeadInForce, CannotBeWhatHasNoMatrix) {
  const auto results = started();
  const auto refused = results->accept(proposeHead({1, 0, 0, 0, 1, 0}), "Ada");
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().reason, store::Reason::not_possible_now);
  EXPECT_THAT(refused.error().what,
              testing::AllOf(testing::HasSubstr("6 values"), testing::HasSubstr("sensor_matrix")));
  EXPECT_FALSE(results->sensorHead(5));
}

TEST_F(HeadInForce, WaitsWhereACutBeginsBehindTheOneBeforeIt) {
  const auto results = started();
  int questions_without_cut = 0;
  results->setCutGuards([&] { return unlessHeld(questions_without_cut-- <= 0); });
  const auto delay = propose(0.004), head = proposeHead({1, 0, 0, 0, 1, 0, 0, 0, 1});
  for (const auto id : {delay, head}) ASSERT_TRUE(results->accept(id, "Ada"));
  const auto look = [&] {
    questions_without_cut = 1;
    box::State state{};
    state.events = 1;
    state.at = MonoTime{3s};
    results->look(state);
  };
  look();
  EXPECT_THAT(results->active(), ElementsAre(delay));
  EXPECT_TRUE(results->isWaiting(head));
  EXPECT_EQ(store_.find(head)->state, store::State::accepted);
  EXPECT_EQ(results->served()->in_force.size(), 1U) << "registers do not change in a cut";
  look();
  EXPECT_THAT(results->active(), ElementsAre(delay, head));
}

// A connection that declares a cut in the midst of an acceptance, from a thread of its own.
TEST_F(InForce, IsWithTheCoreBeforeACutIsAcknowledged) {
  std::vector<Event> heard;  // by the core; both that tell it hold changing_
  std::atomic<bool> acknowledged{};
  ConnectionInhibits connections{folder_.file("connections"), [&](bool inhibited) {
                                   heard.emplace_back(CutInhibit{.active = inhibited, .at = {}});
                                   return true;
                                 }};
  std::thread controller;
  ResultsInForce results{store_, kOnTheMill, [] { return MonoTime{5s}; },
                         [](std::span<const Event>) { return std::optional<Error>{}; },
                         [&](const Event& event) {
                           controller = std::thread{[&] {
                             EXPECT_FALSE(connections.setInhibit("modbus:/dev/ttyS2", true, ""));
                             acknowledged = true;
                           }};
                           std::this_thread::sleep_for(50ms);
                           EXPECT_FALSE(acknowledged) << "the store has the result already, and the core does not";
                           heard.push_back(event);
                         }};
  results.setCutGuards([&connections] { return connections.tryLockOutCuts(); });
  letChange(results);
  const auto accepted = results.accept(propose(0.004), "Ada");
  controller.join();
  ASSERT_TRUE(accepted);
  EXPECT_EQ(accepted->state, store::State::active);
  ASSERT_EQ(heard.size(), 2U);
  EXPECT_TRUE(std::holds_alternative<DelayActivated>(heard.front()));
  EXPECT_TRUE(connections.anyInhibits());
}

}  // namespace
}  // namespace probebox::app
