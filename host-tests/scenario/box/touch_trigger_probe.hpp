#pragma once
#include <chrono>
#include <gtest/gtest.h>
#include <optional>
#include <vector>

#include "drivers/world/config.hpp"
#include "drivers/world/random.hpp"
#include "firmware/app/results/result_events.hpp"
#include "firmware/metrology/dataset/subject.hpp"
#include "firmware/metrology/methods.hpp"
#include "firmware/procedure/methods/methods.hpp"
#include "host-tests/emulation/scenario.hpp"
#include "pulls.hpp"

namespace probebox::scenario {

// The switch of a touch-trigger probe with some pre-travel, late by some time, that chatters.
inline board::WorldTouchTrigger someSwitch(world::Random& random) {
  return {.pre_travel_mm = random.uniform(0.005, 0.015),
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
  record.id =
      42 + parseSubject(metrology::subjectOf(scenario.dataset()), SubjectKind::pre_travel).value_or(Subject{}).of;
  record.binding.subject = metrology::subjectOf(scenario.dataset());
  record.content = result;
  EXPECT_TRUE(isAbout(record.binding.subject, SubjectKind::pre_travel)) << record.binding.subject;
  EXPECT_TRUE(app::activationOf(record, {})->empty()) << "the core does not use it";
  return app::preTravelOf(record).value();
}

inline std::optional<metrology::Result> runWithSwitch(Scenario& scenario, const procedure::LiveMethod& method,
                                                      const ProcedureOptions& options = {}) {
  const auto contacts = scenario.machine().stylus().contactCount();
  const auto solved = scenario.calibrate(method, options);
  EXPECT_TRUE(solved && solved->ok()) << method.name() << ": "
                                      << (solved ? solved->error().reason
                                                 : capture::explain(scenario.state().procedure.last_fault));
  if (!solved || !solved->ok()) return std::nullopt;
  EXPECT_EQ(scenario.machine().crashes(), 0U);
  EXPECT_EQ(scenario.machine().stylus().contactCount() - contacts, scenario.state().procedure.steps);
  return solved->value();
}

// No delay is in force, as none is needed.
inline std::optional<metrology::Result> qualified(Scenario& scenario, std::uint32_t tool = 0) {
  scenario.recorder().keeps_bytes = false;
  scenario.run(std::chrono::seconds{2});
  const auto result = runWithSwitch(scenario, procedure::kPreTravel, {.tool = tool});
  if (result) scenario.facts.trigger_probe->pre_travels.push_back(acceptedPreTravel(scenario, *result));
  return result;
}

// With its whole uncertainty: that of the pre-travel is common to all readings.
inline void addWhole(Pulls& pulls, const metrology::Result& result, const char* key, const std::vector<double>& truth,
                     double most_mm) {
  const auto* found = result.find(key);
  ASSERT_NE(found, nullptr) << key;
  ASSERT_GE(found->uncertainty.size(), truth.size()) << key;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    EXPECT_LT(found->uncertainty[i], most_mm) << key;
    pulls.add(found->values[i], truth[i], found->uncertainty[i]);
  }
}

}  // namespace probebox::scenario
