#include <cmath>
#include <gtest/gtest.h>
#include <string>

#include "firmware/procedure/methods/methods.hpp"
#include "host-tests/emulation/scenario.hpp"

// A machine or a probe that goes wrong in the middle of a calibration: an answer that is right within what it states,
// or a refusal with its reason. Never a wrong number.
namespace probebox::scenario {
namespace {

using namespace std::chrono_literals;
using world::FaultKind;

struct Trouble {
  const char* name;
  FaultKind kind;
  Nanoseconds lasts;
  Nanoseconds jump{};
};

void PrintTo(const Trouble& trouble, std::ostream* out) {
  *out << trouble.name;
}

class InMidCalibration : public testing::TestWithParam<Trouble> {};

TEST_P(InMidCalibration, IsRefusedOrStillRight) {
  std::size_t answers = 0;
  for (int round = 0; round < 8; ++round) {
    Scenario scenario{usualWorld(), static_cast<std::uint64_t>(round) + 1};
    scenario.recorder().keeps_bytes = false;
    scenario.run(2s);
    const auto run = scenario.start(procedure::kDelayMultiSpeed);
    scenario.inject(GetParam().kind, 1s + round * 437ms, GetParam().lasts, GetParam().jump);
    const auto solved = scenario.finish(run);
    EXPECT_TRUE(scenario.recorded().contiguous);
    if (!solved) continue;  // the run was given up, which says why in the status
    if (!solved->ok()) {
      EXPECT_FALSE(solved->error().reason.empty());
      continue;
    }
    ++answers;
    const auto* tau = solved->value().find("tau_s");
    ASSERT_NE(tau, nullptr);
    EXPECT_LT(std::abs(tau->value() - scenario.truth().tau_s[0]), 5 * tau->standardDeviation().value()) << round;
  }
  EXPECT_GE(answers, 6U);  // of eight: troubles this short cost a touch, seldom the run
}

INSTANTIATE_TEST_SUITE_P(Faults, InMidCalibration,
                         testing::Values(Trouble{"SilentProbe", FaultKind::probe_silent, 120ms},
                                         Trouble{"FrozenProbe", FaultKind::probe_frozen, 60ms},
                                         Trouble{"NoisyProbe", FaultKind::probe_noisy, 300ms},
                                         Trouble{"SilentEncoders", FaultKind::encoders_silent, 120ms},
                                         Trouble{"StuckEncoders", FaultKind::encoders_stuck, 150ms},
                                         Trouble{"SilentSync", FaultKind::sync_silent, 2s},
                                         Trouble{"LostEdges", FaultKind::edges_lost, 500ms},
                                         Trouble{"DoubledEdges", FaultKind::edges_doubled, 500ms},
                                         Trouble{"JumpingClock", FaultKind::clock_jumps, 1s, 300us}),
                         [](const auto& of_one) { return std::string{of_one.param.name}; });

}  // namespace
}  // namespace probebox::scenario
