#include <chrono>
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "firmware/app/results/calibrations.hpp"
#include "firmware/procedure/methods/methods.hpp"
#include "host-tests/emulation/scenario.hpp"
#include "host-tests/support/temporary_folder.hpp"

// A run whose touches are complete, at a box that ends before it is solved.
namespace probebox::scenario {
namespace {

using namespace std::chrono_literals;

// A solver that takes longer than anybody waits.
std::filesystem::path slowSolver(const support::TemporaryFolder& folder) {
  const std::filesystem::path program = folder.file("solver");
  std::ofstream{program} << "#!/bin/sh\nexec sleep 60\n";
  std::filesystem::permissions(program, std::filesystem::perms::owner_all);
  return program;
}

class UnfinishedRun : public testing::Test {
 protected:
  void SetUp() override {
    scenario_.start(procedure::kDelayMultiSpeed, {});
    ASSERT_TRUE(scenario_.runUntil([this] { return scenario_.recorder().run_to_solve.has_value(); }, 300s));
  }
  void solve() {
    const auto& box = scenario_.box();
    calibrations_.solve(*scenario_.recorder().run_to_solve, box.plan(), box.recording(), box.scales());
  }
  void expectKept() {
    const auto record = calibrations_.find(1);
    ASSERT_TRUE(record) << record.error().what;
    EXPECT_EQ(record->state, store::State::refused);
    ASSERT_NE(record->refusal(), nullptr);
    EXPECT_EQ(record->refusal()->name, "solver-ended");
    const auto data = calibrations_.datasetOf(record->id);
    EXPECT_TRUE(data && data->size() > 1000U);
    ASSERT_EQ(told_.size(), 1U);
    const auto* solved = std::get_if<Solved>(told_.data());
    ASSERT_NE(solved, nullptr);
    EXPECT_TRUE(solved->refused);
    EXPECT_EQ(solved->run, scenario_.recorder().run_to_solve);
  }

  Scenario scenario_{usualWorld(), 1};
  support::TemporaryFolder folder_;
  std::vector<Event> told_;
  app::Calibrations calibrations_{
      store::Store::open(folder_.file("results.db")).value(),
      {.probe_serial_number = "1", .machine = "mill", .mounting = "spindle", .travel = usualTravel()},
      usualFacts(),
      [this] { return scenario_.now(); },
      [](std::span<const Event>) { return std::optional<Error>{}; },
      [this](const Event& event) {
        told_.push_back(event);
        return true;
      },
      slowSolver(folder_)};
};

TEST_F(UnfinishedRun, IsKeptAsARefusal) {
  solve();
  calibrations_.finishSolving(20ms);
  expectKept();
}

TEST_F(UnfinishedRun, IsKeptBehindAProposalThatIsBeingSolved) {
  bool answered = false;
  calibrations_.propose({.method = "delay-multi-speed", .config = {}, .tables = {}}, "Ada",
                        [&](const auto&) { answered = true; });
  ASSERT_TRUE(calibrations_.isProposing());
  solve();
  calibrations_.finishSolving(20ms);
  expectKept();
  EXPECT_FALSE(answered) << "a proposal is cancelled";
}

}  // namespace
}  // namespace probebox::scenario
