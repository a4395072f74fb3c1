#include "firmware/store/store.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "host-tests/decided/decided.hpp"
#include "scratch.hpp"

namespace probebox::store {
namespace {

using testing::ElementsAre;
using testing::Field;
using testing::HasSubstr;
using testing::IsEmpty;

class StoreTest : public testing::Test {
 protected:
  Id propose(double tau_s, const Binding& binding = kBinding) {
    return store_.propose(binding, delayOf(tau_s), "{}", "2026-11-21T06:00:00Z").value();
  }
  State stateOf(Id id) { return store_.find(id).value().state; }
  void reopen() { store_ = Store::open(scratch_.file()).value(); }

  Scratch scratch_;
  Store store_{Store::open(scratch_.file()).value()};
};

TEST_F(StoreTest, GivesBackAResultToTheLastBit) {
  const auto id = propose(0.1 / 3);
  reopen();
  const auto record = store_.find(id).value();
  ASSERT_NE(record.result(), nullptr);
  EXPECT_EQ(*record.result(), delayOf(0.1 / 3));
  EXPECT_EQ(record.binding, kBinding);
  EXPECT_EQ(record.state, State::proposed);
}

TEST_F(StoreTest, RemembersWhatTheReadingsCouldNotTellApart) {
  auto tied = delayOf(4e-3);
  tied.covariance = {{"a", "b"}, {1.0, 1.9, 1.9, 4.0}};
  const auto id = store_.propose(kBinding, tied, "{}", "2026-11-21T06:00:00Z").value();
  ASSERT_TRUE(store_.find(id)->result()->weakest);
  EXPECT_THAT(store_.find(id)->result()->weakest->components, ElementsAre("a", "b"));
}

TEST_F(StoreTest, ActivatesAnAcceptedResultAndSaysByWhom) {
  const auto id = propose(4e-3);
  const auto record = decided::accept(store_, id, "Ada", "2026-11-21T07:00:00Z");
  ASSERT_TRUE(record);
  EXPECT_EQ(record->state, State::active);
  EXPECT_EQ(record->accepted_by, "Ada");
  EXPECT_EQ(record->accepted_utc, "2026-11-21T07:00:00Z");
  reopen();
  EXPECT_EQ(decided::active(store_, kBinding).value()->id, id);
}

TEST_F(StoreTest, AProposalChangesNothingThatIsInForce) {
  const auto old = propose(4e-3);
  ASSERT_TRUE(decided::accept(store_, old, "Ada", "t1"));
  propose(5e-3);
  EXPECT_EQ(decided::active(store_, kBinding).value()->id, old);
}

TEST_F(StoreTest, RetiresThePreviousResultOfTheSameBinding) {
  const auto old = propose(4e-3);
  const auto next = propose(5e-3);
  ASSERT_TRUE(decided::accept(store_, old, "Ada", "t1"));
  ASSERT_TRUE(decided::accept(store_, next, "Grace", "t2"));
  EXPECT_EQ(stateOf(old), State::retired);
  EXPECT_EQ(store_.find(old)->retired_utc, "t2");
  EXPECT_EQ(decided::active(store_, kBinding).value()->id, next);
}

TEST_F(StoreTest, LeavesOtherSubjectsProbesMachinesAndMountingsAlone) {
  std::vector<Id> others;
  for (Binding other :
       {Binding{"sphere-fit", "P-1001", "mill 3", "spindle"}, Binding{"delay", "P-1002", "mill 3", "spindle"},
        Binding{"delay", "P-1001", "mill 4", "spindle"}, Binding{"delay", "P-1001", "mill 3", "table"}}) {
    others.push_back(propose(4e-3, other));
    ASSERT_TRUE(decided::accept(store_, others.back(), "Ada", "t1"));
  }
  ASSERT_TRUE(decided::accept(store_, propose(5e-3), "Ada", "t2"));
  for (const auto id : others) EXPECT_EQ(stateOf(id), State::active);
}

TEST_F(StoreTest, KeepsTheHistoryOfAResult) {
  const auto old = propose(4e-3);
  ASSERT_TRUE(decided::accept(store_, old, "Ada", "t1"));
  ASSERT_TRUE(decided::accept(store_, propose(5e-3), "Grace", "t2"));
  EXPECT_THAT(store_.history(old).value(),
              ElementsAre(Field(&Transition::to, State::proposed), Field(&Transition::to, State::accepted),
                          Field(&Transition::to, State::active), Field(&Transition::to, State::retired)));
  EXPECT_EQ(store_.history(old)->back().by, "Grace");
}

TEST_F(StoreTest, AcceptingTwiceIsTheSameAsOnce) {
  const auto id = propose(4e-3);
  ASSERT_TRUE(decided::accept(store_, id, "Ada", "t1"));
  const auto again = decided::accept(store_, id, "Grace", "t2");
  ASSERT_TRUE(again);
  EXPECT_EQ(again->accepted_by, "Ada");
  EXPECT_EQ(store_.history(id)->size(), 3U);
}

TEST_F(StoreTest, RefusesToAcceptWhatCannotBeAccepted) {
  const auto refusal =
      store_.refuse(kBinding, "delay-multi-speed", {"single-speed", "one speed only"}, "", "t0").value();
  const auto refused = decided::accept(store_, refusal, "Ada", "t1");
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().reason, Reason::not_possible_now);
  EXPECT_THAT(refused.error().what, HasSubstr("one speed"));

  const auto old = propose(4e-3);
  ASSERT_TRUE(decided::accept(store_, old, "Ada", "t1"));
  ASSERT_TRUE(decided::accept(store_, propose(5e-3), "Ada", "t2"));
  EXPECT_THAT(decided::accept(store_, old, "Ada", "t3").error().what, HasSubstr("retired"));

  EXPECT_EQ(decided::accept(store_, 999, "Ada", "t3").error().reason, Reason::unknown_result);
  EXPECT_EQ(decided::accept(store_, propose(6e-3), "", "t3").error().reason, Reason::bad_argument);
}

TEST_F(StoreTest, RemembersRefusalsToo) {
  const auto id =
      store_.refuse(kBinding, "delay-multi-speed", {"single-speed", "one speed only: \xff"}, "{\"a\":1}", "t0").value();
  reopen();
  const auto record = store_.find(id).value();
  EXPECT_EQ(record.state, State::refused);
  ASSERT_NE(record.refusal(), nullptr);
  EXPECT_EQ(record.refusal()->name, "single-speed");
  EXPECT_EQ(store_.dataset(id).value(), "{\"a\":1}");
}

TEST_F(StoreTest, NumbersResultsUpwards) {
  std::vector<Id> ids;
  for (int i = 0; i < 5; ++i) {
    ids.push_back(propose(4e-3));
    reopen();
  }
  EXPECT_TRUE(std::ranges::is_sorted(ids, std::less_equal<>{}));
  const auto newest = decided::newest(store_, 2).value();
  EXPECT_THAT(newest, ElementsAre(Field(&Record::id, ids[4]), Field(&Record::id, ids[3])));
}

TEST_F(StoreTest, TakesTextAsItIsAndNeverAsSql) {
  const Binding hostile{"delay", "'); DROP TABLE results; --", "mill \"3\"", ""};
  const auto id = propose(4e-3, hostile);
  ASSERT_TRUE(decided::accept(store_, id, "O'Brien", "t1"));
  EXPECT_EQ(decided::active(store_, hostile).value()->accepted_by, "O'Brien");
}

}  // namespace
}  // namespace probebox::store
