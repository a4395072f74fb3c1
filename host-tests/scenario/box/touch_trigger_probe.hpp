#pragma once
#include <gtest/gtest.h>

#include "drivers/world/config.hpp"
#include "drivers/world/random.hpp"
#include "firmware/app/results/result_events.hpp"
#include "firmware/metrology/methods.hpp"
#include "host-tests/emulation/scenario.hpp"

namespace probebox::scenario {

// The switch of a touch-trigger probe with some pre-travel, late by some time, that chatters.
inline world::TouchTriggerConfig someSwitch(world::Random& random) {
  return {.fitted = true,
          .pre_travel_mm = random.uniform(0.005, 0.015),
          .lobe_mm = random.uniform(-0.004, 0.004),
          .axial_mm = random.uniform(0.001, 0.006),
          .hysteresis_mm = 0.0002,
          .repeatability_um = 0.4,
          .late_s = random.uniform(0.0002, 0.002),
          .chatter_probability = 0.2,
          .chatter_s = 0.0008};
}

// Of the run that was done last; accepted, as the box would take it from its store.
inline procedure::PreTravel acceptedPreTravel(const Scenario& scenario, const metrology::Result& result) {
  store::Record record{};
  record.id = 42;
  record.binding.subject = metrology::subjectOf(scenario.dataset());
  record.content = result;
  EXPECT_EQ(record.binding.subject, app::kPreTravelSubject);
  EXPECT_TRUE(app::activationOf(record, {})->empty()) << "the core does not use it";
  return app::preTravelOf(record).value();
}

}  // namespace probebox::scenario
