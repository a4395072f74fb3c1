#include <algorithm>
#include <array>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <random>
#include <sqlite3.h>

#include "firmware/store/store.hpp"
#include "host-tests/decided/decided.hpp"
#include "scratch.hpp"

namespace probebox::store {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

class ResultsLife : public testing::Test {
 protected:
  Id propose(double tau_s, const Binding& binding = kBinding) {
    return store_.propose(binding, delayOf(tau_s), "{}", "t0").value();
  }
  Id accepted(double tau_s, const std::string& by = "Ada") {
    const auto id = propose(tau_s);
    EXPECT_TRUE(decided::accept(store_, id, by, "t1"));
    return id;
  }
  State stateOf(Id id) { return store_.find(id).value().state; }
  Id activeId() {
    const auto active = decided::active(store_, kBinding).value();
    return active ? active->id : 0;
  }
  std::vector<State> states(Id id) {
    std::vector<State> all;
    const auto history = store_.history(id).value();
    for (const auto& transition : history) all.push_back(transition.to);
    return all;
  }

  Scratch scratch_;
  Store store_{Store::open(scratch_.file()).value()};
};

TEST_F(ResultsLife, AnAcceptedResultWaitsUntilItIsActivated) {
  const auto old = accepted(1e-3);
  const auto next = propose(2e-3);
  ASSERT_TRUE(decided::accept(store_, next, "Grace", "t2", true));
  const auto waiting = store_.find(next).value();
  EXPECT_EQ(waiting.state, State::accepted);
  EXPECT_EQ(waiting.accepted_by, "Grace");
  EXPECT_EQ(waiting.accepted_utc, "t2");
  EXPECT_EQ(activeId(), old);

  ASSERT_TRUE(decided::activate(store_, next, "t3"));
  const auto active = store_.find(next).value();
  EXPECT_EQ(active.state, State::active);
  EXPECT_EQ(active.accepted_utc, "t2");
  EXPECT_EQ(activeId(), next);
  const auto history = store_.history(next).value();
  EXPECT_THAT(states(next), ElementsAre(State::proposed, State::accepted, State::active));
  EXPECT_EQ(history.back().utc, "t3");
  EXPECT_EQ(history.back().by, "Grace") << "in the name of the person who decided";
  EXPECT_EQ(store_.find(old)->retired_utc, "t3");
}

TEST_F(ResultsLife, OnlyTheLastAcceptedResultWaits) {
  const auto first = propose(1e-3);
  const auto second = propose(2e-3);
  ASSERT_TRUE(decided::accept(store_, first, "Ada", "t1", true));
  ASSERT_TRUE(decided::accept(store_, second, "Ada", "t2", true));
  EXPECT_EQ(stateOf(first), State::retired);
  const auto third = accepted(3e-3);
  EXPECT_EQ(stateOf(second), State::retired) << "it would replace a later decision";
  EXPECT_EQ(activeId(), third);
}

// To say that the first stays would be said of nothing: the other one comes into force at the end of the cut.
TEST_F(ResultsLife, TheActiveOneIsNotAcceptedAgainWhileAnotherWaits) {
  const auto first = accepted(1e-3);
  EXPECT_TRUE(decided::accept(store_, first, "Ada", "t2")) << "said twice";
  const auto second = propose(2e-3);
  ASSERT_TRUE(decided::accept(store_, second, "Ada", "t3", true));
  const auto refused = decided::accept(store_, first, "Ada", "t4");
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().reason, Reason::not_possible_now);
  EXPECT_THAT(refused.error().what, testing::HasSubstr("rollback " + std::to_string(second)));
  ASSERT_TRUE(decided::withdraw(store_, second, "Ada", "t5"));
  EXPECT_TRUE(decided::accept(store_, first, "Ada", "t6"));
  EXPECT_EQ(activeId(), first);
}

TEST_F(ResultsLife, DifferentMethodsReplaceOneAnotherWhenTheyAnswerTheSameQuestion) {
  const auto old = accepted(1e-3);
  auto other = delayOf(2e-3);
  other.method = "delay-per-axis";
  const auto next = store_.propose(kBinding, other, "", "t0").value();
  ASSERT_TRUE(decided::accept(store_, next, "Ada", "t1"));
  EXPECT_EQ(stateOf(old), State::retired);
  EXPECT_EQ(decided::active(store_, kBinding).value()->method, "delay-per-axis");
}

TEST_F(ResultsLife, ARollbackBringsBackWhatWasInForceBefore) {
  const auto first = accepted(1e-3);
  const auto second = accepted(2e-3);
  const auto changed = decided::rollBack(store_, kBinding, "Grace", "t5").value();
  EXPECT_EQ(changed.retired->id, second);
  EXPECT_EQ(changed.active->id, first);
  EXPECT_EQ(activeId(), first);
  EXPECT_EQ(store_.find(first)->retired_utc, "");
  EXPECT_EQ(store_.history(first)->back().by, "Grace");
  EXPECT_EQ(store_.history(second)->back().utc, "t5");

  ASSERT_TRUE(decided::rollBack(store_, kBinding, "Grace", "t6"));
  EXPECT_EQ(activeId(), second) << "a second rollback undoes the first";
}

TEST_F(ResultsLife, ARollbackOfTheFirstResultLeavesNone) {
  const auto only = accepted(1e-3);
  const auto changed = decided::rollBack(store_, kBinding, "Grace", "t5").value();
  EXPECT_EQ(changed.retired->id, only);
  EXPECT_FALSE(changed.active);
  EXPECT_EQ(activeId(), 0U);
}

TEST_F(ResultsLife, ARollbackPassesOverWhatNeverWasInForce) {
  const auto first = accepted(1e-3);
  const auto second = accepted(2e-3);
  const auto withdrawn = propose(3e-3);
  ASSERT_TRUE(decided::accept(store_, withdrawn, "Ada", "t3", true));
  ASSERT_TRUE(decided::withdraw(store_, withdrawn, "Ada", "t4"));
  EXPECT_EQ(activeId(), second) << "nothing in force has changed";
  EXPECT_EQ(decided::rollBack(store_, kBinding, "Ada", "t5")->active->id, first);
}

// As where a cut begins while the change is being stored.
TEST_F(ResultsLife, AChangeThatIsUndoneHasNeverBeenMade) {
  const auto first = accepted(1e-3), second = propose(2e-3);
  ASSERT_TRUE(decided::accept(store_, second, "Grace", "t2", true));
  const auto changes = store_.history({}).value().size();
  ASSERT_TRUE(decided::activate(store_, second, "t3"));
  const std::array undone{Change{second, State::accepted, State::active}, Change{first, State::active, State::retired}};
  ASSERT_TRUE(store_.undo(undone));
  EXPECT_EQ(activeId(), first);
  EXPECT_EQ(store_.find(first)->retired_utc, "");
  EXPECT_EQ(stateOf(second), State::accepted);
  EXPECT_EQ(store_.find(second)->accepted_by, "Grace");
  EXPECT_EQ(store_.history({}).value().size(), changes);
  store_ = Store::open(scratch_.file()).value();
  EXPECT_THAT(store_.damage(), IsEmpty()) << store_.notice();
  EXPECT_FALSE(store_.undo(undone)) << "it is in force already";
}

TEST_F(ResultsLife, ARollbackThatIsUndoneHasNeverBeenMade) {
  const auto first = accepted(1e-3), second = accepted(2e-3);
  ASSERT_TRUE(decided::rollBack(store_, kBinding, "Grace", "t5"));
  ASSERT_TRUE(store_.undo(
      std::array{Change{first, State::retired, State::active}, Change{second, State::active, State::retired}}));
  EXPECT_EQ(activeId(), second);
  EXPECT_EQ(store_.find(first)->retired_utc, "t1");
  EXPECT_THAT(states(second), ElementsAre(State::proposed, State::accepted, State::active));
  EXPECT_EQ(decided::rollBack(store_, kBinding, "Grace", "t6")->active->id, first);
}

// Whoever decided by what has changed meanwhile.
TEST_F(ResultsLife, NoChangeBeginsWithAnotherStateThanTheOneOfTheResult) {
  const auto first = accepted(1e-3), second = propose(2e-3);
  const std::array changes{Change{second, State::proposed, State::accepted, "Ada"},
                           Change{first, State::accepted, State::active, "Ada"}};
  const auto refused = store_.append(changes, std::nullopt, 0, "t3");
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().reason, Reason::not_possible_now);
  EXPECT_EQ(stateOf(second), State::proposed) << "all of them or none";
  EXPECT_EQ(store_.append({}, std::nullopt, 0, "").error().reason, Reason::bad_argument);
  EXPECT_EQ(
      store_.append(std::array{Change{99, State::proposed, State::accepted}}, std::nullopt, 0, "t").error().reason,
      Reason::unknown_result);
}

TEST_F(ResultsLife, AProposalIsStoredWithTheChangesThatFollowFromIt) {
  const auto before = accepted(1e-3);
  const auto next = store_.load()->next_id;
  const std::array changes{Change{next, State::proposed, State::accepted, "Ada"}};
  const Proposal sum{kBinding, delayOf(3e-3), {.rests_on = {before}, .remark = "a sum"}};
  const auto transitions = store_.append(changes, sum, next, "t2");
  ASSERT_TRUE(transitions) << transitions.error().what;
  ASSERT_EQ(transitions->size(), 2U);
  EXPECT_EQ(transitions->front().result, next);
  EXPECT_EQ(stateOf(next), State::accepted);
  EXPECT_EQ(store_.restsOn(next)->front().id, before);
  const auto later = store_.load(before).value();
  ASSERT_EQ(later.heads.size(), 1U);
  EXPECT_EQ(later.heads[0].accepted_by, "Ada");
  EXPECT_EQ(later.transitions.size(), 2U);
  EXPECT_EQ(later.dependences.size(), 1U);
  EXPECT_EQ(later.next_id, next + 1);
}

// Whoever decided before another result was proposed.
TEST_F(ResultsLife, AProposalIsNotStoredUnderAnotherNumberThanTheOneThatTheChangesGiveIt) {
  const auto next = store_.load()->next_id;
  const auto unrelated = propose(1e-3);
  ASSERT_EQ(unrelated, next);
  const std::array changes{Change{next, State::proposed, State::accepted, "Ada"}};
  const auto refused = store_.append(changes, Proposal{kBinding, delayOf(3e-3), {}}, next, "t2");
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().reason, Reason::not_possible_now);
  EXPECT_EQ(stateOf(unrelated), State::proposed) << "nobody accepted it";
  EXPECT_EQ(store_.load()->next_id, next + 1) << "all of it or nothing";
}

// As a sum whose part waits again.
TEST_F(ResultsLife, AnAcceptanceThatIsUndoneHasNeverBeenMade) {
  const auto id = propose(1e-3);
  ASSERT_TRUE(decided::accept(store_, id, "Ada", "t1", true));
  ASSERT_TRUE(store_.undo(std::array{Change{id, State::proposed, State::accepted}}));
  const auto record = store_.find(id).value();
  EXPECT_EQ(record.state, State::proposed);
  EXPECT_EQ(record.accepted_by, "");
  EXPECT_EQ(record.accepted_utc, "");
  EXPECT_THAT(states(id), ElementsAre(State::proposed));
}

TEST_F(ResultsLife, ARollbackOfAnotherMountingTouchesNothingHere) {
  const auto here = accepted(1e-3);
  auto elsewhere = kBinding;
  elsewhere.mounting = "table";
  const auto refused = decided::rollBack(store_, elsewhere, "Ada", "t2");
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().reason, Reason::not_possible_now);
  EXPECT_THAT(refused.error().what, HasSubstr("'delay'"));
  EXPECT_EQ(activeId(), here);
}

TEST_F(ResultsLife, ARetiredResultComesBackByItsSubjectAndTheRefusalSaysSo) {
  const auto id = accepted(1e-3);
  ASSERT_TRUE(decided::rollBack(store_, kBinding, "Ada", "t3"));
  EXPECT_THAT(decided::accept(store_, id, "Ada", "t4").error().what, HasSubstr("rollback delay"));
  ASSERT_TRUE(decided::rollBack(store_, kBinding, "Ada", "t5"));
  EXPECT_EQ(activeId(), id);
}

// Whatever people do, in any order: at most one result of a binding is active and at most one waits, the history says
// the same as the records, and it can be read piece by piece.
TEST_F(ResultsLife, StaysConsistentUnderAnySequenceOfDecisions) {
  std::mt19937 random{20261121};
  const std::vector<Binding> bindings{
      kBinding, {"centreline", "P-1001", "mill 3", "spindle"}, {"delay", "P-1002", "mill 3", "spindle"}};
  for (int step = 0; step < 150; ++step) {
    const auto& binding = bindings[random() % bindings.size()];
    const Id some = 1 + random() % (1 + decided::newest(store_, 1)->size() * 20);
    switch (random() % 6) {
      case 0:
        propose(1e-3, binding);
        break;
      case 1:
        (void)decided::accept(store_, some, "Ada", "t");
        break;
      case 2:
        (void)decided::accept(store_, some, "Ada", "t", true);
        break;
      case 3:
        (void)decided::activate(store_, some, "t");
        break;
      case 4:
        (void)decided::rollBack(store_, binding, "Grace", "t");
        break;
      default:
        (void)decided::withdraw(store_, some, "Grace", "t");
        break;
    }
    for (const auto& each : bindings) {
      const auto all = decided::newest(store_, 1000).value();
      const auto count = [&](State state) {
        return std::ranges::count_if(all, [&](const Record& r) { return r.state == state && r.binding == each; });
      };
      ASSERT_LE(count(State::active), 1);
      ASSERT_LE(count(State::accepted), 1);
    }
  }
  std::vector<Transition> pieces;
  for (bool more = true; more;) {
    const auto piece = store_.history({.after = pieces.empty() ? 0 : pieces.back().number, .count = 7}).value();
    more = !piece.empty();
    pieces.insert(pieces.end(), piece.begin(), piece.end());
  }
  const auto records = decided::newest(store_, 1000).value();
  for (const auto& record : records) {
    const auto own = store_.history(record.id).value();
    EXPECT_EQ(own.back().to, record.state);
    EXPECT_EQ(std::ranges::count(pieces, record.id, &Transition::result), std::ssize(own));
  }
}

TEST_F(ResultsLife, TellsTheHistoryOfOneSubject) {
  accepted(1e-3);
  propose(2e-3, {"centreline", "P-1001", "mill 3", "spindle"});
  const auto about = store_.history({.subject = "centreline"}).value();
  ASSERT_EQ(about.size(), 1U);
  EXPECT_EQ(about[0].result, 2U);
  EXPECT_EQ(about[0].binding.subject, "centreline");
  EXPECT_THAT(store_.history({.subject = "swivel"}).value(), IsEmpty());
}

TEST_F(ResultsLife, KeepsTheDatasetsOfAcceptedResultsAndOfTheNewestOthers) {
  const auto dear = store_.propose(kBinding, delayOf(1e-3), "dear", "t0").value();
  ASSERT_TRUE(decided::accept(store_, dear, "Ada", "t1"));
  const std::string large(200'000, 'x');
  std::vector<Id> others;
  std::uintmax_t size_after_30 = 0;
  for (int i = 0; i < 90; ++i) {
    others.push_back(i % 2 == 0 ? store_.propose(kBinding, delayOf(2e-3), large, "t2").value()
                                : store_.refuse(kBinding, "delay-multi-speed", {"a", "b"}, large, "t2").value());
    if (i == 30) size_after_30 = std::filesystem::file_size(scratch_.file());
  }
  ASSERT_TRUE(decided::rollBack(store_, kBinding, "Ada", "t3"));
  EXPECT_EQ(store_.dataset(dear).value(), "dear") << "accepted once, kept for ever";
  for (std::size_t i = 0; i < others.size(); ++i) {
    const bool is_new = i + Store::kOtherDatasets >= others.size();
    EXPECT_EQ(store_.dataset(others[i]).value(), is_new ? large : "") << i;
    EXPECT_TRUE(store_.find(others[i])) << "the result itself stays";
  }
  EXPECT_LT(std::filesystem::file_size(scratch_.file()), size_after_30 + 400'000) << "the file does not grow for ever";
}

// A disk of an image has room for an update beside them.
TEST_F(ResultsLife, KeepsLargeDatasetsOfTheNewestOthersOnly) {
  const std::string large(10'000'000, 'x');
  for (int i = 0; i < 5; ++i) ASSERT_TRUE(store_.refuse(kBinding, "delay-multi-speed", {"a", "b"}, large, "t1"));
  for (Id id = 1; id <= 5; ++id) EXPECT_EQ(store_.dataset(id).value().empty(), id <= 2) << id;
  const std::string larger(Store::kOtherDatasetsCharacters + 1, 'x');
  ASSERT_TRUE(store_.refuse(kBinding, "delay-multi-speed", {"a", "b"}, larger, "t1"));
  for (Id id = 1; id <= 6; ++id) EXPECT_EQ(store_.dataset(id).value().empty(), id <= 5) << id;
}

}  // namespace
}  // namespace probebox::store
