#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <string>
#include <vector>

#include "firmware/app/results/values_in_use.hpp"

// The pre-travels of a touch-trigger probe that methods use: one a tool.
namespace probebox::app {
namespace {

using testing::ElementsAre;

std::vector<std::string> unknownOf(const procedure::Facts& described, const std::vector<InForceAbout>& in_force) {
  std::vector<std::string> names;
  for (const auto& value : valuesInUse(described, in_force))
    if (value.source == messages::ValueSource::unknown) names.push_back(value.name);
  return names;
}

TEST(PreTravelInUse, IsThatOfTheToolThatItWasMeasuredWith) {
  procedure::Facts described;
  described.trigger_probe = procedure::TriggerProbe{};
  described.probe_tools = {.count = 2, .numbers = {1, 2}, .lengths_mm = {150, 200}};
  EXPECT_THAT(unknownOf(described, {}), ElementsAre("pre-travel")) << "a delay could not be measured with it";
  described.swivel_head = procedure::HeadFacts{};
  EXPECT_THAT(unknownOf(described, {}), ElementsAre("pre-travel", "pre-travel-1", "pre-travel-2"));
  EXPECT_THAT(unknownOf(described, {{"pre-travel-2", 7}}), ElementsAre("pre-travel", "pre-travel-1"));

  store::Record record{};
  record.id = 7;
  record.binding.subject = "pre-travel-2";
  metrology::Result result;
  result.method = "pre-travel";
  result.estimates = {metrology::Estimate::vector("pre_travel_mm", {0.01, 0.002, 0, 0.004}, {1e-4, 1e-4, 1e-4, 2e-4})};
  record.content = result;
  MeasuredFacts measured;
  addFacts(record, measured);
  described.trigger_probe->pre_travels = measured.pre_travels;
  ASSERT_NE(described.preTravelOf(2), nullptr);
  EXPECT_EQ(described.preTravelOf(2)->result_id, 7U);
  EXPECT_EQ(described.preTravelOf(1), nullptr);
  EXPECT_EQ(described.preTravelOf(0), nullptr) << "no tool is named there";
}

}  // namespace
}  // namespace probebox::app
