#include <algorithm>
#include <array>
#include <gtest/gtest.h>
#include <random>

#include "box_of_results.hpp"
#include "firmware/results/core_events.hpp"

// Whatever people do, in any order.
namespace probebox::results {
namespace {

constexpr std::array kSubjects{"delay",           "delay-x",          "centreline",   "centreline-stylus",
                               "stylus-offset-1", "centreline-slide", "centreline-2", "centreline-stylus-2",
                               "check",           "assembly-4"};

class RandomDecisions : public testing::TestWithParam<unsigned> {
 protected:
  Outcome<Decision, Failure> anything(bool cut_is_on) {
    const auto* subject = kSubjects[random_() % kSubjects.size()];
    const Id some = 1 + random_() % (box_.ledger().lastId() + 1);
    switch (random_() % 7) {
      case 0:
      case 1: {
        const Id basis = random_() % 2 == 0 ? some : 0;
        box_.propose(subject, static_cast<double>(random_() % 4),
                     basis == 0 || basis > box_.ledger().lastId() ? std::vector<Id>{} : std::vector{basis});
        return Decision{};
      }
      case 2:
      case 3:
        return box_.accept(some, random_() % 2 == 0, cut_is_on);
      case 4:
        return box_.perform(Activate{some}, cut_is_on);
      case 5:
        return box_.rollBack(subject, cut_is_on);
      default:
        return box_.perform(RollBack{some, "Grace"}, cut_is_on);
    }
  }
  std::vector<Id> inForce() const {
    std::vector<Id> ids;
    for (const auto* entry : box_.ledger().all(State::active, BoxOfResults::about(""))) ids.push_back(entry->id);
    return ids;
  }

  std::mt19937 random_{GetParam()};
  BoxOfResults box_;
};

TEST_P(RandomDecisions, LeaveAtMostOneInForceAndOneWaitingAndNothingChangesInACut) {
  for (int step = 0; step < 300; ++step) {
    const bool cut_is_on = random_() % 3 == 0;
    const auto before = box_.ledger();
    const auto in_force = inForce();
    const auto decision = anything(cut_is_on);
    if (cut_is_on) {
      ASSERT_EQ(inForce(), in_force) << step;
    }
    if (!decision) {
      ASSERT_TRUE(box_.ledger() == before) << step << ": " << decision.error().what;
    }
    if (decision && !decision->isEmpty()) {
      ASSERT_TRUE(box_.ledger() == after(before, *decision)) << step << ": what was decided is what is stored";
    }
    for (const auto* subject : kSubjects) {
      const auto count = [&](State state) {
        return std::ranges::count_if(box_.ledger().all(state, BoxOfResults::about("")),
                                     [&](const Entry* entry) { return entry->binding.subject == subject; });
      };
      ASSERT_LE(count(State::active), 1) << step;
      ASSERT_LE(count(State::accepted), 1) << step;
    }
    ASSERT_FALSE(box_.inForce("centreline") != 0 && box_.inForce("centreline-slide") != 0) << step;
    if (decision && random_() % 4 == 0) {
      box_.revert(*decision);
      ASSERT_EQ(inForce(), in_force) << step << ": as though it had never been made";
    }
    ASSERT_TRUE(box_.ledger() == box_.replayed()) << step;
  }
}

TEST_P(RandomDecisions, ASecondRollbackUndoesTheFirst) {
  for (int step = 0; step < 200; ++step) {
    (void)anything(false);
    const auto* subject = kSubjects[random_() % kSubjects.size()];
    const auto before = inForce();
    if (box_.inForce(subject) == 0 || !box_.rollBack(subject)) continue;
    ASSERT_NE(inForce(), before) << step;
    if (!box_.rollBack(subject)) continue;  // one beside it forbids that
    ASSERT_EQ(inForce(), before) << step;
  }
}

// What the core hears brings it from any ledger to any later one.
TEST_P(RandomDecisions, EventsTellTheCoreWhatHasChangedAndNothingElse) {
  box_.values().activation = [](const Record& record) -> Outcome<std::vector<Event>> {
    ToolLengthActivated event{};
    event.result_id = record.id;
    if (isAbout(record.binding.subject, SubjectKind::assembly)) return std::vector<Event>{event};
    return std::vector<Event>{};
  };
  box_.values().none = [](const std::string& subject) -> std::optional<Event> {
    if (!isAbout(subject, SubjectKind::assembly)) return std::nullopt;
    return ToolLengthActivated{};
  };
  Id told = 0;
  for (int step = 0; step < 300; ++step) {
    const auto before = box_.ledger();
    (void)anything(random_() % 4 == 0);
    std::vector<std::string> errors;
    const auto events = eventsBetween(before, box_.ledger(), box_.values(), errors);
    for (const auto& event : events) told = std::get<ToolLengthActivated>(event).result_id;
    ASSERT_EQ(told, box_.inForce("assembly-4")) << step;
    if (before == box_.ledger()) {
      ASSERT_TRUE(events.empty()) << step;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, RandomDecisions, testing::Range(1U, 21U));

}  // namespace
}  // namespace probebox::results
