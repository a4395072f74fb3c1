// Runs that no recording can hold, against what a simulated one then holds.
#include "firmware/procedure/plan/capacity.hpp"

#include <algorithm>
#include <gtest/gtest.h>
#include <memory>

#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/plan/plan.hpp"
#include "tools/plan/completed.hpp"
#include "tools/plan/forecast.hpp"
#include "tools/plan/simulated_facts.hpp"
#include "tools/plan/simulated_run.hpp"

namespace probebox::plan {
namespace {

constexpr procedure::Rates kUsualRates{{1000, 1000, 1000}, 2000};

ProcedureOptions optionsOf(std::initializer_list<double> speeds_mm_s) {
  ProcedureOptions options;
  options.speed_count = static_cast<std::uint8_t>(speeds_mm_s.size());
  std::ranges::copy(speeds_mm_s, options.speeds_mm_s.begin());
  const auto all = completed({&procedure::kSpindleOffset2x2, options}, factsOf({}, 0));
  EXPECT_TRUE(all) << all.error().reason;
  return *all;
}

std::optional<Error> refusalOf(const ProcedureOptions& options, const procedure::Rates& rates = kUsualRates) {
  const auto plan = std::make_unique<procedure::Plan>();
  procedure::fill(*plan, procedure::kSpindleOffset2x2, options);
  return procedure::whyTooLongToRecord(*plan, rates);
}

TEST(Capacity, RefusesAtItsStartARunThatNoRecordingHolds) {
  const auto slow = refusalOf(optionsOf({1, 2, 3, 4}));
  ASSERT_TRUE(slow);
  EXPECT_EQ(slow->what, procedure::kExceedsCapacity);
  EXPECT_FALSE(refusalOf(optionsOf({2, 3, 4, 5})));
  EXPECT_TRUE(refusalOf(optionsOf({2, 3, 4, 5}), {{4000, 4000, 4000}, 2000})) << "more positions in the same time";
  EXPECT_TRUE(refusalOf(optionsOf({2, 3, 4, 5}), {{1000, 1000, 1000}, 8000}));
  EXPECT_FALSE(refusalOf(optionsOf({1.5, 3, 4, 5})));
  EXPECT_TRUE(refusalOf(optionsOf({1.5, 3, 4, 5}), {{1000, 1000, 1000}, 5})) << "more time for rows of the free probe";
}

// Any that fits into a recording is let begin.
TEST(Capacity, IsNotExceededByRunsThatFit) {
  for (const double factor : {1.0, 1.02, 1.04, 1.06, 1.08, 1.1, 1.15, 1.2, 1.3}) {
    const auto options = optionsOf({factor, 2 * factor, 3 * factor, 4 * factor});
    const bool fits = simulatedRun(procedure::kSpindleOffset2x2, options, {}, 1).steps == 100;
    EXPECT_FALSE(fits && refusalOf(options)) << factor;
  }
}

}  // namespace
}  // namespace probebox::plan
