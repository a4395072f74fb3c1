#pragma once
#include <algorithm>
#include <chrono>
#include <gtest/gtest.h>
#include <optional>
#include <vector>

#include "host-tests/emulation/scenario.hpp"
#include "host-tests/support/temporary_folder.hpp"
#include "pulls.hpp"
#include "tools/case/case_folder.hpp"

// Runs of methods that read balls.
namespace probebox::scenario {

// A saved case has every digit of the run.
inline void expectTheSameFrom(const metrology::Dataset& dataset, const metrology::Result& result) {
  const support::TemporaryFolder folder;
  ASSERT_TRUE(casefolder::writeCase(dataset, folder.path() / "case"));
  const auto read = casefolder::readCase(folder.path() / "case");
  ASSERT_TRUE(read);
  const auto again = metrology::solve(*read);
  ASSERT_TRUE(again);
  ASSERT_EQ(again->estimates.size(), result.estimates.size());
  for (std::size_t i = 0; i < result.estimates.size(); ++i) {
    EXPECT_EQ(again->estimates[i].values, result.estimates[i].values) << result.estimates[i].key;
    EXPECT_EQ(again->estimates[i].sd, result.estimates[i].sd) << result.estimates[i].key;
  }
}

// The first components of a value against the truth.
inline void add(Pulls& pulls, const metrology::Result& result, const char* key, const std::vector<double>& truth,
                double most_sd) {
  const auto* found = result.find(key);
  ASSERT_NE(found, nullptr) << key;
  ASSERT_GE(found->values.size(), truth.size());
  for (std::size_t i = 0; i < truth.size(); ++i) {
    EXPECT_LT(found->sd[i], most_sd);
    pulls.add(found->values[i], truth[i], found->sd[i]);
  }
}

// The tool that has number 4, in whatever config.
auto& toolFour(auto& config) {
  return *std::ranges::find(config.further_tools, 4U, &board::WorldTool::number);
}

// With the true delay in force. Nothing but the touches that were asked for may happen.
inline std::optional<metrology::Result> measured(Scenario& scenario, const procedure::LiveMethod& method,
                                                 const ProcedureOptions& options = {}) {
  scenario.recorder().keeps_bytes = false;
  scenario.run(std::chrono::seconds{2});
  scenario.activateDelay(scenario.truth().tau_s);
  const auto solved = scenario.calibrate(method, options);
  EXPECT_TRUE(solved && solved->ok()) << (solved ? solved->error().reason
                                                 : capture::explain(scenario.state().procedure.last_fault));
  if (!solved || !solved->ok()) return std::nullopt;
  EXPECT_EQ(scenario.machine().crashes(), 0U);
  EXPECT_EQ(scenario.machine().stylus().contactCount(), scenario.state().procedure.steps);
  return solved->value();
}

}  // namespace probebox::scenario
