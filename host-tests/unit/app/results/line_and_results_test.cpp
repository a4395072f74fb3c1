#include <functional>
#include <utility>

#include "accepting.hpp"

// An inhibit line rises when it likes, also while a result comes into force: nothing keeps it out as a connection is.
namespace probebox::app {
namespace {

using metrology::Estimate;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

class BesideALine : public Accepting {
 protected:
  BesideALine() {
    results_.setCutGuards([] { return std::optional<CutLock>{std::in_place}; }, [this] { return line_is_up_(); });
  }
  // From the second question on, which is asked when the store has the change.
  void letLineRiseInsideTheStore() {
    line_is_up_ = [asked = 0]() mutable { return ++asked > 1; };
  }
  void letLineFall() {
    line_is_up_ = [] { return false; };
    told_.clear();
    letCut(false);
  }
  store::Id acceptedLater(store::Id id) {
    letCut(true);
    const auto accepted = results_.accept(id, "Ada", true);
    EXPECT_TRUE(accepted) << accepted.error().what;
    EXPECT_TRUE(results_.isWaiting(id));
    return id;
  }

  std::function<bool()> line_is_up_ = [] { return false; };
};

TEST_F(BesideALine, WaitsWhereTheLineRisesBehindTheOneBeforeIt) {
  const auto delay = acceptedLater(proposeDelay(0.004)), length = acceptedLater(proposeLength());
  line_is_up_ = [this] { return !told_.empty(); };
  letCut(false);
  EXPECT_EQ(told_.size(), 1U);
  EXPECT_THAT(results_.active(), ElementsAre(delay));
  EXPECT_EQ(results_.served()->in_force.size(), 1U) << "registers do not change in a cut";
  EXPECT_EQ(store_.find(length)->state, store::State::accepted);
  letLineFall();
  EXPECT_THAT(results_.active(), ElementsAre(delay, length));
}

TEST_F(BesideALine, WaitsAgainWhereTheLineRisesWhileItIsStored) {
  const auto before = acceptedAs("delay", resultOf("delay-plates", {Estimate::scalar("tau_s", 0.004, 4e-6)})).id;
  const auto next = acceptedLater(proposeDelay(0.005));
  told_.clear();
  const auto served = results_.served();
  letLineRiseInsideTheStore();
  letCut(false);
  EXPECT_THAT(told_, IsEmpty());
  EXPECT_EQ(results_.served(), served);
  EXPECT_TRUE(results_.isWaiting(next));
  EXPECT_THAT(afterRestart(), ElementsAre(before));
  letLineFall();
  EXPECT_EQ(told_.size(), 1U);
  EXPECT_THAT(afterRestart(), ElementsAre(next));
  EXPECT_EQ(store_.history(next)->back().by, "Ada");
}

TEST_F(BesideALine, AnAcceptanceSaysThatItWaits) {
  const auto before = acceptedAs("delay", resultOf("delay-plates", {Estimate::scalar("tau_s", 0.004, 4e-6)})).id;
  told_.clear();
  letLineRiseInsideTheStore();
  const auto next = proposeDelay(0.005);
  const auto accepted = results_.accept(next, "Grace", true);
  ASSERT_TRUE(accepted) << accepted.error().what;
  EXPECT_EQ(accepted->state, store::State::accepted);
  EXPECT_TRUE(results_.isWaiting(next));
  EXPECT_THAT(results_.active(), ElementsAre(before));
  EXPECT_THAT(told_, IsEmpty());
  EXPECT_THAT(afterRestart(), ElementsAre(before));
  letLineFall();
  EXPECT_THAT(results_.active(), ElementsAre(next));
  EXPECT_EQ(inForce("delay")->accepted_by, "Grace");
}

TEST_F(BesideALine, WaitsAgainAlsoWhereTheStoreCannotBeReadBehindIt) {
  const auto before = acceptedAs("delay", resultOf("delay-plates", {Estimate::scalar("tau_s", 0.004, 4e-6)})).id;
  const auto next = proposeDelay(0.005), unrelated = proposeLength();
  told_.clear();
  changeStore("CREATE TRIGGER spoil AFTER DELETE ON transitions BEGIN UPDATE results SET method = 'x' WHERE id = " +
              std::to_string(unrelated) +
              "; END; CREATE TRIGGER keep BEFORE UPDATE ON results WHEN NEW.state = 5 BEGIN SELECT RAISE(ABORT, "
              "'refused'); END");
  letLineRiseInsideTheStore();
  const auto accepted = results_.accept(next, "Grace", true);
  ASSERT_TRUE(accepted) << accepted.error().what;
  EXPECT_EQ(accepted->state, store::State::accepted);
  EXPECT_THAT(told_, IsEmpty());
  EXPECT_THAT(results_.active(), ElementsAre(before));
  EXPECT_TRUE(results_.isWaiting(next));
}

TEST_F(BesideALine, ASumWaitsAsWell) {
  const auto tip = acceptedAs("centreline-stylus", centreAt(0.174, -0.1233)).id;
  line_is_up_ = [this] { return inForce("centreline").has_value(); };
  const auto offset = acceptedAs("stylus-offset-1", offsetOf(0.020, -0.013));
  EXPECT_THAT(offset.notes, IsEmpty()) << "the sum is none before its part is in force";
  EXPECT_THAT(afterRestart(), ElementsAre(tip));
  EXPECT_FALSE(inForce("centreline"));
  EXPECT_FALSE(servedCentre());
  line_is_up_ = [] { return false; };
  letCut(false);
  EXPECT_TRUE(servedCentre());
}

TEST_F(BesideALine, ARollbackIsRefused) {
  const auto first = acceptedAs("delay", resultOf("delay-plates", {Estimate::scalar("tau_s", 0.004, 4e-6)})).id;
  const auto second = proposeDelay(0.005);
  ASSERT_TRUE(results_.accept(second, "Ada", true));
  told_.clear();
  letLineRiseInsideTheStore();
  const auto refused = results_.rollBack(std::string{"delay"}, "Ada");
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().reason, store::Reason::cut_is_on);
  EXPECT_THAT(told_, IsEmpty());
  EXPECT_THAT(results_.active(), ElementsAre(second));
  EXPECT_THAT(afterRestart(), ElementsAre(second));
  line_is_up_ = [] { return false; };
  ASSERT_TRUE(results_.rollBack(std::string{"delay"}, "Ada"));
  EXPECT_THAT(results_.active(), ElementsAre(first));
}

}  // namespace
}  // namespace probebox::app
