#include "accepting.hpp"
#include "host-tests/decided/decided.hpp"

// A box that ended between the acceptance of a stylus offset and the storing of the sum.
namespace probebox::app {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

class MissingSum : public Accepting {
 protected:
  store::Id inForceAlready(const char* subject, const metrology::Result& result, const char* by) {
    const auto id = propose(subject, result);
    EXPECT_TRUE(decided::accept(store_, id, by, "2026-01-01T00:00:00Z"));
    return id;
  }
  // Both are in force and their sum is not.
  void letBoxEndBeforeTheSum() {
    tip_ = inForceAlready("centreline-stylus", centreAt(0.174, -0.1233), "Ada");
    offset_ = inForceAlready("stylus-offset-1", offsetOf(0.020, -0.013), "Grace");
  }
  void restart(bool cut_is_on = false) {
    anew_.emplace(
        store_, kMounting, [] { return MonoTime{std::chrono::seconds{5}}; },
        [](std::span<const Event>) { return std::optional<Error>{}; },
        [this](const Event& event) { told_.push_back(event); });
    anew_->restore();
    look(0, cut_is_on);
    look(2, cut_is_on);
  }
  void look(int seconds, bool cut_is_on) {
    box::State state{};
    state.events = 1;
    state.at = MonoTime{std::chrono::seconds{seconds}};
    state.snapshot.inhibited = cut_is_on;
    anew_->look(state);
  }
  std::size_t results() { return decided::newest(store_, 100)->size(); }

  store::Id tip_{}, offset_{};
  std::optional<ResultsInForce> anew_;
};

TEST_F(MissingSum, ComesIntoForceBehindTheStart) {
  letBoxEndBeforeTheSum();
  restart();
  const auto centre = inForce("centreline");
  ASSERT_TRUE(centre);
  EXPECT_EQ(centre->accepted_by, "Grace") << "who accepted the second";
  ASSERT_TRUE(servedCentre());
  EXPECT_NEAR((*servedCentre())[0], 0.194, 1e-12);
  EXPECT_THAT(anew_->active(), testing::Contains(centre->id));
  restart();
  EXPECT_EQ(results(), 3U) << "each pair has one sum";
}

TEST_F(MissingSum, WaitsForTheEndOfACut) {
  letBoxEndBeforeTheSum();
  restart(true);
  EXPECT_EQ(results(), 2U);
  look(3, false);
  EXPECT_TRUE(inForce("centreline"));
}

TEST_F(MissingSum, HasANumberOfItsOwnWhereAHostProposesBehindTheStart) {
  letBoxEndBeforeTheSum();
  restart(true);
  const auto unrelated = proposeLength();
  look(3, false);
  EXPECT_EQ(store_.find(unrelated)->state, store::State::proposed) << "nobody accepted it";
  EXPECT_EQ(inForce("centreline").value_or(store::Record{}).id, unrelated + 1);
}

TEST_F(MissingSum, ThatIsOnlyProposedComesLaterWhereTheStoreRefusesIt) {
  const auto direct = inForceAlready("centreline", centreAt(0.154, -0.110, "centreline-by-steps"), "Ada");
  letBoxEndBeforeTheSum();
  restart(true);
  proposeLength();
  letStoreRefuse();
  look(3, false);
  EXPECT_EQ(results(), 4U);
  letStoreTakeChanges();
  ASSERT_TRUE(anew_->accept(offset_, "Ada"));
  EXPECT_EQ(results(), 5U);
  EXPECT_EQ(inForce("centreline")->id, direct);
}

TEST_F(MissingSum, OfWhichTheProposalWasStoredComesIntoForce) {
  letBoxEndBeforeTheSum();
  const auto sum = propose("centreline", centreAt(0.194, -0.1363), {.rests_on = {tip_, offset_}});
  restart();
  EXPECT_EQ(inForce("centreline").value_or(store::Record{}).id, sum);
  EXPECT_EQ(results(), 3U);
}

TEST_F(MissingSum, ComesWhenOneOfItsPartsIsAcceptedAgain) {
  letBoxEndBeforeTheSum();
  const auto again = results_.accept(offset_, "Ada");
  ASSERT_TRUE(again) << again.error().what;
  EXPECT_THAT(again->notes, ElementsAre(HasSubstr("in force")));
  EXPECT_TRUE(inForce("centreline"));
  EXPECT_THAT(results_.accept(offset_, "Ada")->notes, IsEmpty());
}

TEST_F(MissingSum, IsNoneThatAPersonWentBackFrom) {
  acceptedAs("centreline-stylus", centreAt(0.174, -0.1233));
  const auto offset = acceptedAs("stylus-offset-1", offsetOf(0.020, -0.013)).id;
  ASSERT_TRUE(results_.rollBack(std::string{"centreline"}, "Ada"));
  restart();
  EXPECT_FALSE(inForce("centreline"));
  EXPECT_EQ(results(), 3U);
  EXPECT_THAT(anew_->accept(offset, "Ada")->notes, IsEmpty());
  EXPECT_FALSE(inForce("centreline"));
}

TEST_F(MissingSum, IsNoneThatWasOnlyProposedBesideAnother) {
  const auto direct = acceptedAs("centreline", centreAt(0.154, -0.110, "centreline-by-steps")).id;
  acceptedAs("centreline-stylus", centreAt(0.174, -0.1233));
  acceptedAs("stylus-offset-1", offsetOf(0.020, -0.013));
  restart();
  EXPECT_EQ(inForce("centreline")->id, direct);
  ASSERT_TRUE(anew_->rollBack(direct, "Ada"));
  restart();
  EXPECT_FALSE(inForce("centreline")) << "a person wanted none";
  EXPECT_EQ(results(), 4U);
}

TEST_F(MissingSum, IsNoneWhereAPersonChoseAnotherSince) {
  letBoxEndBeforeTheSum();
  const auto direct = inForceAlready("centreline", centreAt(0.154, -0.110, "centreline-by-steps"), "Ada");
  restart();
  EXPECT_EQ(inForce("centreline")->id, direct);
  ASSERT_TRUE(anew_->rollBack(direct, "Ada"));
  restart();
  EXPECT_FALSE(inForce("centreline"));
  EXPECT_EQ(results(), 3U);
}

}  // namespace
}  // namespace probebox::app
