// The rates that a run needs, against what the solvers then make of it.
#include "firmware/procedure/plan/rates.hpp"

#include <algorithm>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <memory>

#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/plan/plan.hpp"
#include "tools/plan/completed.hpp"
#include "tools/plan/simulated_facts.hpp"
#include "tools/plan/simulated_run.hpp"

namespace probebox::plan {
namespace {

using procedure::LiveMethod;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

// A run of a method on a simulated machine.
class RunOf {
 public:
  explicit RunOf(const LiveMethod& method, double speed_mm_s = 0) : method_{method} {
    set_up = withProbeFor(method, {});
    facts = factsOf(set_up, 0);
    if (speed_mm_s > 0) options_.speeds_mm_s[0] = speed_mm_s, options_.speed_count = 1;
    options_ = *completed({&method, options_}, facts);
    procedure::fill(plan, method, options_);
    using procedure::ProbeKind;
    procedure::takeReadings(plan, set_up.switch_repeatability_um ? ProbeKind::trigger : ProbeKind::scanning);
  }

  procedure::NeededRates needed() const {
    procedure::NeededRates most;
    for (std::size_t i = 0; i < plan.step_count; ++i) {
      const auto step = procedure::neededRates(plan.steps[i], facts);
      most.positions_hz = std::max(most.positions_hz, step.positions_hz);
      most.deflections_hz = std::max(most.deflections_hz, step.deflections_hz);
    }
    return most;
  }
  // Touches of some runs that the solver leaves out or refuses for want of samples.
  std::size_t lacking(double positions_hz, double deflections_hz) const {
    SetUp at = set_up;
    at.machine_rate_hz = positions_hz;
    at.probe_rate_hz = deflections_hz;
    std::size_t lacking = 0;
    for (std::uint64_t seed = 0; seed < 5; ++seed) {
      const auto run = simulatedRun(method_, options_, at, seed).solved;
      lacking += run ? static_cast<std::size_t>(
                           std::ranges::count(run->dropped, "too-few-samples", &metrology::Dropped::reason))
                     : 1;
    }
    return lacking;
  }

  SetUp set_up;
  procedure::Facts facts;
  procedure::Plan plan;

 private:
  const LiveMethod& method_;
  ProcedureOptions options_;
};

class NeededRatesOf : public testing::TestWithParam<const LiveMethod*> {};

INSTANTIATE_TEST_SUITE_P(Methods, NeededRatesOf,
                         testing::Values(&procedure::kDelayMultiSpeed, &procedure::kDelayKnownSphere,
                                         &procedure::kDelayInOut, &procedure::kPreTravel, &procedure::kDelayContour),
                         [](const auto& method) {
                           std::string name{method.param->name()};
                           std::erase(name, '-');
                           return name;
                         });

TEST_P(NeededRatesOf, AreEnoughAndAThirdIsNot) {
  const auto run = std::make_unique<RunOf>(*GetParam());  // large
  const auto [positions_hz, deflections_hz] = run->needed();
  ASSERT_GT(positions_hz, 0);
  EXPECT_EQ(run->lacking(positions_hz, run->set_up.probe_rate_hz), 0U) << positions_hz;
  EXPECT_GT(run->lacking(positions_hz / 3, run->set_up.probe_rate_hz), 0U) << positions_hz;
  if (deflections_hz == 0) return;
  EXPECT_EQ(run->lacking(run->set_up.machine_rate_hz, deflections_hz), 0U) << deflections_hz;
  EXPECT_GT(run->lacking(run->set_up.machine_rate_hz, deflections_hz / 3), 0U) << deflections_hz;
}

TEST(TooSlow, NamesTheSourceBothRatesAndASpeedThatWillDo) {
  const auto run = std::make_unique<RunOf>(procedure::kDelayMultiSpeed);
  const procedure::Rates good{{1000, 1000, 1000}, 2000};
  EXPECT_FALSE(procedure::whyTooSlow(run->plan, run->facts, good));
  auto slow = good;
  slow.positions_hz[1] = 100;
  const auto why = procedure::whyTooSlow(run->plan, run->facts, slow);
  ASSERT_TRUE(why);
  EXPECT_THAT(why->what, AllOf(HasSubstr("of Y"), HasSubstr("100 positions"), HasSubstr("40 mm/s"), HasSubstr("174"),
                               HasSubstr("23 mm/s"), HasSubstr("--speed"), HasSubstr("rate_hz")));
  // The speed that is named will do.
  const auto slower = std::make_unique<RunOf>(procedure::kDelayKnownSphere, 23);
  EXPECT_FALSE(procedure::whyTooSlow(slower->plan, slower->facts, slow));
  slow.positions_hz[1] = 1;
  EXPECT_THAT(procedure::whyTooSlow(run->plan, run->facts, slow)->what, Not(HasSubstr("--speed")))
      << "no touch is that slow";
  slow.positions_hz[1] = 0;
  EXPECT_THAT(procedure::whyTooSlow(run->plan, run->facts, slow)->what, HasSubstr("axis Y"));
  slow = good;
  slow.deflections_hz = 300;
  EXPECT_THAT(procedure::whyTooSlow(run->plan, run->facts, slow)->what,
              AllOf(HasSubstr("300"), HasSubstr("needs 572")));
}

TEST(TooSlow, PrintsRatesWithoutPowersOfTen) {
  const auto run = std::make_unique<RunOf>(procedure::kDelayMultiSpeed);
  EXPECT_THAT(procedure::whyTooSlow(run->plan, run->facts, {{12000, 12000, 12000}, 99.96})->what, HasSubstr("100"));
  for (std::size_t i = 0; i < run->plan.step_count; ++i) run->plan.steps[i].overtravel_mm = 0.01;
  EXPECT_THAT(procedure::whyTooSlow(run->plan, run->facts, {{1000, 1000, 1000}, 2000})->what,
              AllOf(HasSubstr("of X"), HasSubstr("1000")));
}

// Where a switch tells the contact no deflections are awaited.
TEST(TooSlow, IsNoProbeThatSwitches) {
  const auto run = std::make_unique<RunOf>(procedure::kPreTravel);
  EXPECT_FALSE(procedure::whyTooSlow(run->plan, run->facts, {{1000, 1000, 1000}, 0}));
}

}  // namespace
}  // namespace probebox::plan
