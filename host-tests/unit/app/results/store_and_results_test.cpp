#include <array>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <map>
#include <random>
#include <set>

#include "accepting.hpp"

// The store gets results that the ledger has not read yet, loses others, and refuses changes: the core, what is shown
// and what a start reads are the same all the same.
namespace probebox::app {
namespace {

using testing::IsEmpty;
using testing::SizeIs;

class BesideTheStore : public Accepting {
 protected:
  store::Id acceptedDelay(double tau_s) {
    const auto id = proposeDelay(tau_s);
    EXPECT_TRUE(results_.accept(id, "Ada", true));
    return id;
  }
  void damage(store::Id id) const {
    changeStore("UPDATE results SET method = method || '?' WHERE id = " + std::to_string(id));
  }
  using Ids = std::map<std::string, store::Id>;
  // The results that the core was told of last.
  Ids coreHas() const {
    Ids ids;
    for (const auto& event : told_) {
      if (const auto* centreline = std::get_if<CentrelineActivated>(&event)) ids["centreline"] = centreline->result_id;
      if (const auto* length = std::get_if<ToolLengthActivated>(&event)) ids["assembly-4"] = length->result_id;
    }
    std::erase_if(ids, [](const auto& each) { return each.second == 0; });
    return ids;
  }
  // The results in force, of those that the core follows.
  Ids shown() const {
    Ids ids;
    for (const auto& each : results_.about())
      if (each.subject == "centreline" || each.subject == "assembly-4") ids[each.subject] = each.id;
    return ids;
  }
};

TEST_F(BesideTheStore, NoResultComesIntoForceThatWasProposedInTheCutAndNobodyAccepted) {
  acceptedAs("centreline-stylus", centreAt(0.174, -0.1233));
  letCut(true);
  ASSERT_TRUE(results_.accept(propose("stylus-offset-1", offsetOf(0.020, -0.013)), "Ada"));
  const auto unrelated = proposeLength();
  letCut(false);
  EXPECT_EQ(store_.find(unrelated)->state, store::State::proposed);
  EXPECT_FALSE(inForce("assembly-4"));
  EXPECT_EQ(inForce("centreline").value_or(store::Record{}).id, unrelated + 1);
  EXPECT_TRUE(servedCentre());
}

TEST_F(BesideTheStore, TheCoreLeavesADamagedResultThatAPersonGoesBackFrom) {
  damage(acceptedDelay(0.004));
  told_.clear();
  EXPECT_FALSE(results_.rollBack(std::string{"delay"}, "Ada")) << "there was none before it";
  EXPECT_THAT(results_.active(), IsEmpty());
  ASSERT_THAT(told_, SizeIs(1));
  EXPECT_EQ(std::get<DelayActivated>(told_.front()).sd_s[0], 0);
  EXPECT_THAT(results_.storageProblems(), SizeIs(1));
}

TEST_F(BesideTheStore, ADamagedResultThatIsNamedByItsNumberIsSaidToBeDamagedAndLeft) {
  const auto id = acceptedDelay(0.004);
  damage(id);
  told_.clear();
  const auto back = results_.rollBack(id, "Ada");
  ASSERT_FALSE(back);
  EXPECT_EQ(back.error().reason, store::Reason::damaged);
  EXPECT_THAT(results_.active(), IsEmpty());
  EXPECT_THAT(told_, SizeIs(1));
  EXPECT_THAT(results_.storageProblems(), SizeIs(1));
}

TEST_F(BesideTheStore, ARollbackPassesOverADamagedResult) {
  const auto first = acceptedDelay(0.004), second = acceptedDelay(0.005);
  acceptedDelay(0.006);
  damage(second);
  const auto back = results_.rollBack(std::string{"delay"}, "Ada");
  ASSERT_TRUE(back) << back.error().what;
  EXPECT_EQ(back->active.value_or(store::Record{}).id, first);
  EXPECT_EQ(std::get<DelayActivated>(told_.back()).tau_s[0], 0.004);
}

TEST_F(BesideTheStore, DamageIsShownAlsoWhereNothingChanges) {
  damage(proposeLength());
  EXPECT_FALSE(results_.accept(proposeDelay(0.004), "")) << "of nobody";
  EXPECT_THAT(results_.storageProblems(), SizeIs(1));
}

TEST_F(BesideTheStore, WhatCouldNotBeReadOnceIsReadAgain) {
  const auto first = acceptedDelay(0.004);
  acceptedDelay(0.004);
  EXPECT_FALSE(results_.isToRepeat(first));
  changeStore("ALTER TABLE results RENAME TO gone");
  EXPECT_TRUE(results_.isToRepeat(first));
  changeStore("ALTER TABLE gone RENAME TO results");
  EXPECT_FALSE(results_.isToRepeat(first));
}

TEST_F(BesideTheStore, ACallGivesTheRecordThatIsStored) {
  const auto expectStored = [&](const store::Record& given, store::State state) {
    const auto kept = store_.find(given.id).value();
    EXPECT_EQ(given.state, state);
    EXPECT_EQ(kept.state, state);
    EXPECT_EQ(given.accepted_by, kept.accepted_by);
    EXPECT_EQ(given.accepted_utc, kept.accepted_utc);
    EXPECT_FALSE(given.accepted_utc.empty());
    EXPECT_EQ(given.retired_utc, kept.retired_utc);
    EXPECT_EQ(given.retired_utc.empty(), state != store::State::retired);
  };
  const auto expectAccepted = [&](double tau_s, store::State state) {
    const auto accepted = results_.accept(proposeDelay(tau_s), "Ada", true);
    ASSERT_TRUE(accepted) << accepted.error().what;
    expectStored(*accepted, state);
  };
  letCut(true);
  expectAccepted(0.004, store::State::accepted);
  letCut(false);
  expectAccepted(0.005, store::State::active);
  const auto back = results_.rollBack(std::string{"delay"}, "Grace");
  ASSERT_TRUE(back && back->retired && back->active);
  expectStored(*back->retired, store::State::retired);
  expectStored(*back->active, store::State::active);
  letCut(true);
  const auto waiting = proposeDelay(0.006);
  ASSERT_TRUE(results_.accept(waiting, "Ada", true));
  const auto withdrawn = results_.rollBack(waiting, "Grace");
  ASSERT_TRUE(withdrawn && withdrawn->retired);
  expectStored(*withdrawn->retired, store::State::retired);
}

// Solvers and hosts propose past the ledger, cuts come and go, and the store refuses changes now and then.
TEST_F(BesideTheStore, CoreAndShownAndAFreshStartAgreeWhateverHappens) {
  std::mt19937 random{7};
  std::vector<store::Id> proposed;
  std::set<store::Id> wanted;  // by a person
  const auto some = [&] { return proposed.empty() ? store::Id{1} : proposed[random() % proposed.size()]; };
  for (int step = 0; step < 200 && !HasFailure(); ++step) {
    const bool is_refusing = random() % 4 == 0;
    if (!is_refusing) {
      const double value = static_cast<double>(1 + random() % 5) / 50;
      const std::array next{std::pair{"centreline-stylus", centreAt(value, 0)},
                            std::pair{"stylus-offset-1", offsetOf(value, 0)},
                            std::pair{"centreline", centreAt(value, 1, "centreline-by-steps")}};
      if (const auto which = random() % 6; which < next.size())
        proposed.push_back(propose(next[which].first, next[which].second));
      else if (which == next.size())
        proposed.push_back(proposeLength(120 + value));
    }
    if (is_refusing) letStoreRefuse();
    switch (random() % 4) {
      case 0:
        (void)results_.accept(*wanted.insert(some()).first, "Ada", true);
        break;
      case 1:
        (void)results_.rollBack(some(), "Grace");
        break;
      default:
        letCut(random() % 2 == 0);
    }
    if (is_refusing) letStoreTakeChanges();
    EXPECT_EQ(coreHas(), shown()) << step;
    EXPECT_EQ(afterRestart(), results_.active()) << step;
    for (const auto& [subject, id] : shown())
      EXPECT_TRUE(wanted.contains(id) || store_.find(id)->result()->find("tip_centre_mm") != nullptr)
          << step << ": nobody accepted " << id << " about " << subject;
  }
}

}  // namespace
}  // namespace probebox::app
