#include "firmware/results/decide.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <utility>

#include "box_of_results.hpp"
#include "firmware/results/core_events.hpp"
#include "firmware/results/notes.hpp"

namespace probebox::results {
namespace {

using store::Reason;
using testing::ElementsAre;
using testing::Field;
using testing::IsEmpty;
using testing::SizeIs;

class Deciding : public testing::Test {
 protected:
  Reason reasonOf(const Outcome<Decision, Failure>& outcome) {
    EXPECT_FALSE(outcome);
    return outcome ? Reason{} : outcome.error().reason;
  }

  BoxOfResults box_;
};

TEST_F(Deciding, AnAcceptanceRetiresWhatWasInForceAndSaysWithWhatItWasCompared) {
  const auto first = box_.propose("check", 1), next = box_.propose("check", 1.2);
  ASSERT_TRUE(box_.accept(first, false));
  const auto decision = box_.accept(next, false);
  ASSERT_TRUE(decision);
  EXPECT_EQ(decision->compared_with, first);
  EXPECT_EQ(box_.inForce("check"), next);
  EXPECT_EQ(box_.stateOf(first), State::retired);
  EXPECT_TRUE(box_.accept(next)->isEmpty()) << "said twice";
}

TEST_F(Deciding, WhatDiffersIsRefusedUnlessAPersonSaysSo) {
  ASSERT_TRUE(box_.accept(box_.propose("check", 1), false));
  const auto next = box_.propose("check", 2);
  EXPECT_EQ(reasonOf(box_.accept(next, false)), Reason::differs);
  EXPECT_EQ(box_.stateOf(next), State::proposed);
  EXPECT_THAT(box_.accept(next, true)->changes, testing::Contains(Field(&Change::remark, "although it differs")));
}

TEST_F(Deciding, NothingInForceChangesDuringACut) {
  const auto first = box_.propose("check", 1), second = box_.propose("check", 1), third = box_.propose("check", 1);
  ASSERT_TRUE(box_.accept(first));
  ASSERT_TRUE(box_.accept(second, true, true));
  EXPECT_EQ(box_.inForce("check"), first);
  EXPECT_EQ(reasonOf(box_.rollBack("check", true)), Reason::cut_is_on);
  EXPECT_EQ(reasonOf(box_.accept(first)), Reason::not_possible_now) << "another one waits to take its place";
  EXPECT_TRUE(box_.perform(Activate{second}, true)->isEmpty());
  ASSERT_TRUE(box_.accept(third, true, true));
  EXPECT_EQ(box_.stateOf(second), State::retired) << "the last decision counts";
  ASSERT_TRUE(box_.perform(Activate{third}));
  EXPECT_EQ(box_.inForce("check"), third);
  EXPECT_EQ(box_.ledger().find(third)->activated_by, "Ada") << "in the name of who decided";
}

TEST_F(Deciding, AWaitingResultIsWithdrawnAlsoDuringACutAndNeverComesBackByARollback) {
  const auto first = box_.propose("check", 1), second = box_.propose("check", 1);
  ASSERT_TRUE(box_.accept(first));
  ASSERT_TRUE(box_.accept(second, true, true));
  ASSERT_TRUE(box_.perform(RollBack{second, "Grace"}, true));
  EXPECT_EQ(box_.stateOf(second), State::retired);
  ASSERT_TRUE(box_.rollBack("check"));
  EXPECT_EQ(box_.inForce("check"), 0U);
  ASSERT_TRUE(box_.rollBack("check"));
  EXPECT_EQ(box_.inForce("check"), first);
}

TEST_F(Deciding, EveryCommandOfAPersonNeedsAName) {
  const auto id = box_.propose("check", 1);
  EXPECT_EQ(reasonOf(box_.perform(Accept{id, "", true})), Reason::bad_argument);
  ASSERT_TRUE(box_.accept(id));
  EXPECT_EQ(reasonOf(box_.perform(RollBack{id, ""})), Reason::bad_argument);
}

TEST_F(Deciding, AnUnknownResultAndOneOfAnotherMountingAreRefusedByName) {
  EXPECT_EQ(reasonOf(box_.accept(7)), Reason::unknown_result);
  const auto id = box_.propose("check", 1);
  box_.values().here.mounting = "turret";
  EXPECT_EQ(reasonOf(box_.accept(id)), Reason::other_binding);
  EXPECT_EQ(reasonOf(box_.perform(RollBack{id, "Ada"})), Reason::other_binding);
}

TEST_F(Deciding, WhatDoesNotFitTheBoxNeitherComesNorComesBack) {
  const auto first = box_.propose("check", 1), second = box_.propose("check", 1);
  ASSERT_TRUE(box_.accept(first));
  ASSERT_TRUE(box_.accept(second));
  box_.values().activation = [=](const Record& record) -> Outcome<std::vector<Event>> {
    if (record.id == first) return Error{"too far"};
    return std::vector<Event>{};
  };
  EXPECT_EQ(reasonOf(box_.rollBack("check")), Reason::not_possible_now);
  EXPECT_EQ(box_.inForce("check"), second);
}

TEST_F(Deciding, ASlideAndASpindleExcludeEachOther) {
  const auto spindle = box_.propose("centreline", 1), slide = box_.propose("centreline-slide", 1);
  ASSERT_TRUE(box_.accept(spindle));
  EXPECT_EQ(reasonOf(box_.accept(slide)), Reason::not_possible_now);
  ASSERT_TRUE(box_.rollBack("centreline"));
  ASSERT_TRUE(box_.accept(slide));
  EXPECT_EQ(reasonOf(box_.rollBack("centreline")), Reason::not_possible_now) << "it would bring one back beside it";
}

TEST_F(Deciding, TheTwoChucksAreAboutThemselvesAlone) {
  const auto first = box_.propose("centreline", 1), second = box_.propose("centreline-2", 2);
  ASSERT_TRUE(box_.accept(first));
  ASSERT_TRUE(box_.accept(second)) << "and does not differ from that of the other chuck";
  EXPECT_EQ(box_.inForce("centreline"), first);
  EXPECT_EQ(box_.inForce("centreline-2"), second);
  ASSERT_TRUE(box_.rollBack("centreline"));
  EXPECT_EQ(box_.inForce("centreline-2"), second);
  EXPECT_TRUE(box_.accept(box_.propose("centreline-slide", 1))) << "the main chuck's slide, beside the second chuck";
}

TEST_F(Deciding, ATipOfTheSecondChuckGivesItsOwnSum) {
  ASSERT_TRUE(box_.accept(box_.propose("centreline-stylus-2", 10)));
  const auto decision = box_.accept(box_.propose("stylus-offset-1", 3));
  ASSERT_TRUE(decision && decision->proposal);
  EXPECT_NE(box_.inForce("centreline-2"), 0U);
  EXPECT_EQ(box_.inForce("centreline"), 0U);
}

TEST_F(Deciding, MeasuredLengthsEndWhereTheBoxHoldsNoMore) {
  box_.values().most_tool_lengths = 2;
  for (const auto* tool : {"assembly-1", "assembly-2"}) ASSERT_TRUE(box_.accept(box_.propose(tool, 1)));
  EXPECT_EQ(reasonOf(box_.accept(box_.propose("assembly-3", 1))), Reason::not_possible_now);
  EXPECT_TRUE(box_.accept(box_.propose("assembly-2", 2))) << "in the place of its own";
}

TEST_F(Deciding, ATipAndItsOffsetComeTogetherWithTheirSum) {
  const auto tip = box_.propose("centreline-stylus", 10), offset = box_.propose("stylus-offset-1", 3);
  ASSERT_TRUE(box_.accept(tip));
  const auto decision = box_.accept(offset);
  ASSERT_TRUE(decision && decision->proposal);
  const auto sum = box_.inForce("centreline");
  ASSERT_NE(sum, 0U);
  EXPECT_EQ(box_.valueOf(sum), 13);
  EXPECT_EQ(box_.ledger().find(sum)->rests_on, (std::vector{tip, offset}));
  EXPECT_TRUE(box_.accept(offset)->isEmpty()) << "each pair has one";
  ASSERT_TRUE(box_.rollBack("centreline"));
  EXPECT_TRUE(box_.perform(MakeMissingSum{})->isEmpty()) << "a person wanted none";
}

TEST_F(Deciding, ASumThatAPersonWentBackFromIsNotMadeAgainWhereItIsLost) {
  ASSERT_TRUE(box_.accept(box_.propose("centreline-stylus", 10)));
  ASSERT_TRUE(box_.accept(box_.propose("stylus-offset-1", 3)));
  const auto sum = box_.inForce("centreline");
  ASSERT_TRUE(box_.rollBack("centreline"));
  EXPECT_TRUE(decide(box_.replayed(sum), box_.values(), MakeMissingSum{}, Cut{})->isEmpty());
}

TEST_F(Deciding, NoSumTakesThePlaceOfATurningAxisThatAPersonLetsWait) {
  ASSERT_TRUE(box_.accept(box_.propose("centreline-stylus", 10)));
  const auto offset = box_.propose("stylus-offset-1", 3), direct = box_.propose("centreline", 1);
  for (const auto id : {offset, direct}) ASSERT_TRUE(box_.perform(Accept{id, "Ada", true}, true));
  ASSERT_TRUE(box_.perform(Activate{offset}));
  ASSERT_EQ(box_.stateOf(direct), State::accepted);
  ASSERT_TRUE(box_.perform(Activate{direct}));
  EXPECT_EQ(box_.inForce("centreline"), direct);
}

TEST_F(Deciding, ARollbackBringsNoLengthBackThatTheBoxHasNoPlaceFor) {
  box_.values().most_tool_lengths = 1;
  ASSERT_TRUE(box_.accept(box_.propose("assembly-1", 1)));
  ASSERT_TRUE(box_.rollBack("assembly-1"));
  ASSERT_TRUE(box_.accept(box_.propose("assembly-2", 1)));
  EXPECT_EQ(reasonOf(box_.rollBack("assembly-1")), Reason::not_possible_now);
}

TEST_F(Deciding, NoSumIsMadeWhereAPersonHasDecidedAboutTheTurningAxisSince) {
  const auto sum = std::exchange(box_.values().sum, [](const Record&, const Record&) { return std::nullopt; });
  ASSERT_TRUE(box_.accept(box_.propose("centreline-stylus", 10)));
  ASSERT_TRUE(box_.accept(box_.propose("stylus-offset-1", 3)));
  box_.values().sum = sum;
  EXPECT_TRUE(box_.perform(MakeMissingSum{}, true)->isEmpty()) << "not during a cut";
  ASSERT_TRUE(box_.accept(box_.propose("centreline", 1)));
  ASSERT_TRUE(box_.rollBack("centreline"));
  EXPECT_TRUE(box_.perform(MakeMissingSum{})->isEmpty());
}

TEST_F(Deciding, ASumIsOnlyProposedBesideATurningAxisInForce) {
  const auto direct = box_.propose("centreline", 1);
  ASSERT_TRUE(box_.accept(direct));
  ASSERT_TRUE(box_.accept(box_.propose("centreline-stylus", 10)));
  const auto decision = box_.accept(box_.propose("stylus-offset-1", 3));
  ASSERT_TRUE(decision && decision->proposal);
  EXPECT_EQ(box_.inForce("centreline"), direct);
  EXPECT_EQ(box_.stateOf(box_.ledger().lastId()), State::proposed);
}

TEST_F(Deciding, ACutThatBeginsMeanwhileLetsThePartWaitAndTheSumComeWithIt) {
  ASSERT_TRUE(box_.accept(box_.propose("centreline-stylus", 10)));
  const auto offset = box_.propose("stylus-offset-1", 3);
  const auto decision = box_.accept(offset);
  ASSERT_TRUE(decision);
  box_.revert(*decision);
  EXPECT_EQ(box_.stateOf(offset), State::accepted);
  EXPECT_EQ(box_.inForce("centreline"), 0U);
  EXPECT_THAT(decision->notes_if_it_waits, IsEmpty()) << "nothing of a sum that is none yet";
  EXPECT_THAT(box_.ledger().all(State::accepted, BoxOfResults::about("")), SizeIs(1));
  ASSERT_TRUE(box_.perform(Activate{offset}));
  EXPECT_NE(box_.inForce("centreline"), 0U);
  EXPECT_EQ(box_.ledger().lastId(), 3U) << "the same sum";
}

TEST_F(Deciding, NoSumComesIntoForceOfAPartThatAPersonWithdrawsInTheCut) {
  ASSERT_TRUE(box_.accept(box_.propose("centreline-stylus", 10)));
  const auto offset = box_.propose("stylus-offset-1", 3);
  box_.revert(*box_.accept(offset));
  ASSERT_TRUE(box_.perform(RollBack{offset, "Ada"}, true));
  EXPECT_THAT(box_.ledger().all(State::accepted, BoxOfResults::about("")), IsEmpty());
  EXPECT_TRUE(box_.perform(MakeMissingSum{})->isEmpty());
  EXPECT_EQ(box_.inForce("centreline"), 0U);
}

TEST_F(Deciding, ASumOfPartsInForceWaitsByItselfWhereACutBegins) {
  const auto tip = box_.propose("centreline-stylus", 10), offset = box_.propose("stylus-offset-1", 3);
  const auto sum = std::exchange(box_.values().sum, [](const Record&, const Record&) { return std::nullopt; });
  for (const auto part : {tip, offset}) ASSERT_TRUE(box_.accept(part));
  box_.values().sum = sum;
  const auto decision = box_.perform(MakeMissingSum{});
  ASSERT_TRUE(decision);
  EXPECT_THAT(decision->notes_if_it_waits, SizeIs(1));
  box_.revert(*decision);
  EXPECT_EQ(box_.stateOf(3), State::accepted);
}

TEST_F(Deciding, NothingComesIntoForceThatCannotBeRead) {
  const auto first = box_.propose("delay", 1), second = box_.propose("delay", 2), third = box_.propose("delay", 3);
  ASSERT_TRUE(box_.accept(first));
  ASSERT_TRUE(box_.accept(second));
  ASSERT_TRUE(box_.accept(third, true, true));
  const auto readable = std::exchange(box_.values().record, [](Id) { return nullptr; });
  EXPECT_EQ(reasonOf(box_.rollBack("delay")), Reason::unavailable);
  EXPECT_EQ(reasonOf(box_.perform(Activate{third})), Reason::unavailable);
  EXPECT_EQ(reasonOf(box_.accept(box_.propose("check", 1))), Reason::unavailable);
  EXPECT_EQ(box_.inForce("delay"), second);
  box_.values().record = readable;
  EXPECT_TRUE(box_.rollBack("delay"));
}

TEST_F(Deciding, WhatRestsOnARetiredResultIsNamedWhereTheNextOneMovesIt) {
  const auto first = box_.propose("delay", 1);
  ASSERT_TRUE(box_.accept(first));
  const auto based = box_.propose("setter", 1, {first});
  ASSERT_TRUE(box_.accept(based));
  EXPECT_THAT(box_.accept(box_.propose("delay", 1.2))->notes, IsEmpty());
  EXPECT_THAT(box_.accept(box_.propose("delay", 1.8))->notes, SizeIs(1));
  const auto& entry = *box_.ledger().find(based);
  EXPECT_THAT(onRetired(box_.ledger(), box_.values(), entry), SizeIs(1));
  ASSERT_TRUE(box_.accept(box_.propose("delay", 1.1)));
  EXPECT_THAT(onRetired(box_.ledger(), box_.values(), entry), IsEmpty());
}

// The delay of each axis is that of the newest result which observed it.
TEST_F(Deciding, DelaysAreComposedByAxis) {
  box_.values().activation = [this](const Record& record) -> Outcome<std::vector<Event>> {
    DelayActivated event{};
    event.result_id = record.id;
    event.tau_s.fill(box_.valueOf(record.id));
    event.sd_s.fill(0.1);
    return std::vector<Event>{event};
  };
  const auto proposed_first = box_.propose("delay-x", 1);
  const auto first_accepted = box_.propose("delay", 5);
  ASSERT_TRUE(box_.accept(first_accepted));
  ASSERT_TRUE(box_.accept(proposed_first));
  EXPECT_EQ(delayByAxis(box_.ledger(), box_.values())->tau_s, (std::array{1.0, 5.0, 5.0}))
      << "by the acceptances, not by the numbers of the results";
  ASSERT_TRUE(box_.rollBack("delay"));
  EXPECT_EQ(delayByAxis(box_.ledger(), box_.values())->tau_s, (std::array{1.0, 0.0, 0.0}));
  ASSERT_TRUE(box_.accept(box_.propose("delay", 2)));
  EXPECT_EQ(delayByAxis(box_.ledger(), box_.values())->tau_s, (std::array{2.0, 2.0, 2.0}));
  const auto newer = box_.propose("delay-x", 3);
  const auto decision = box_.accept(newer);
  const auto composed = *delayByAxis(box_.ledger(), box_.values());
  EXPECT_EQ(composed.tau_s, (std::array{3.0, 2.0, 2.0}));
  EXPECT_EQ(composed.result_id, newer);
  std::vector<std::string> errors;
  EXPECT_THAT(eventsBetween(box_.before(), box_.ledger(), box_.values(), errors), SizeIs(1));
  box_.revert(*decision);
  EXPECT_EQ(delayByAxis(box_.ledger(), box_.values())->tau_s, (std::array{2.0, 2.0, 2.0}))
      << "a change that nobody was told of has never been made";
}

}  // namespace
}  // namespace probebox::results
