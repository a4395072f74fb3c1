#include <algorithm>
#include <gtest/gtest.h>
#include <ostream>

#include "board/describe/parse.hpp"
#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/plan/readiness.hpp"
#include "host-tests/emulation/scenario.hpp"

// The emulated machine goes where its axes can: its park position, the ways between features, touches and sweeps.
namespace probebox::scenario {
namespace {

using namespace std::chrono_literals;
using procedure::LiveMethod;

struct Run {
  const LiveMethod* method{};
  std::uint8_t axis{};  // of a sweep
  procedure::ReadBy by{};
};

void PrintTo(const Run& run, std::ostream* out) {
  *out << run.method->name();
  if (run.by == procedure::ReadBy::head) *out << " by the sensor head";
  if (run.by == procedure::ReadBy::shank) *out << " by tip and shank";
  if (run.axis != 0)
    *out << " of "
         << "XYZ"[run.axis - 1];
}

class Travel : public testing::TestWithParam<Run> {
 protected:
  static ProcedureOptions options() {
    ProcedureOptions options{.axis = GetParam().axis};
    if (GetParam().method->takes_tool) options.tool = 4;
    const auto described = procedure::described(*GetParam().method, options, usualFacts(), GetParam().by);
    EXPECT_TRUE(described.ok());
    return described ? *described : options;
  }
};

TEST_P(Travel, IsNeverLeft) {
  const auto axes = board::simDescriptions()->machine.axes;
  Scenario scenario{warmingWorld()};
  scenario.recorder().keeps_bytes = false;
  world::Vector3 lowest = scenario.machine().positionAt(scenario.now()), highest = lowest;
  scenario.around = [&](const Event&) {
    const auto at = scenario.machine().positionAt(scenario.now());
    for (std::size_t i = 0; i < 3; ++i) {
      lowest[i] = std::min(lowest[i], at[i]);
      highest[i] = std::max(highest[i], at[i]);
    }
  };
  scenario.run(2s);
  scenario.activateDelay(scenario.truth().tau_s);
  const auto run = scenario.start(*GetParam().method, options());
  const auto park = scenario.machine().commandedPosition();
  // Its later steps come from what the earlier ones have measured.
  if (GetParam().method == &procedure::kCentrelineBySteps) scenario.finish(run);
  const auto isOver = [&] {
    const auto& progress = scenario.state().procedure;
    return progress.run == run && progress.step == progress.steps &&
           scenario.controller().activity() == world::Activity::asking &&
           scenario.machine().commandedPosition() == park;
  };
  ASSERT_TRUE(scenario.runUntil(isOver, 300s));
  EXPECT_EQ(scenario.controller().abandonedSteps(), 0U);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_GE(lowest[i], axes[i].travel_min_mm) << "XYZ"[i];
    EXPECT_LE(highest[i], axes[i].travel_max_mm) << "XYZ"[i];
  }
}

INSTANTIATE_TEST_SUITE_P(
    Methods, Travel,
    testing::Values(Run{&procedure::kDelayMultiSpeed}, Run{&procedure::kDelayKnownSphere},
                    Run{&procedure::kDelayPlates}, Run{&procedure::kDelayPlates, 2}, Run{&procedure::kDelayPlates, 3},
                    Run{&procedure::kDelayCylinder}, Run{&procedure::kDelayCube}, Run{&procedure::kDelayPerAxis},
                    Run{&procedure::kDelayNonNormal}, Run{&procedure::kDelayInOut}, Run{&procedure::kCentreline},
                    Run{&procedure::kJoint}, Run{&procedure::kCAxisAlignment}, Run{&procedure::kSelftest},
                    Run{&procedure::kScrewCalibration, 1}, Run{&procedure::kScrewCalibration, 2},
                    Run{&procedure::kScrewCalibration, 3}, Run{&procedure::kSpindleOffset2x2},
                    Run{&procedure::kSpindleOffsetFour}, Run{&procedure::kCentrelineLimitedAccess},
                    Run{&procedure::kPeriodicCheck}, Run{&procedure::kTablePivot}, Run{&procedure::kSwivelError},
                    Run{&procedure::kHeadPivot}, Run{&procedure::kAAxisAlignment}, Run{&procedure::kToolSetter},
                    Run{&procedure::kToolAssembly}, Run{&procedure::kSensorHeadCalibration},
                    Run{&procedure::kCentrelineBySteps}, Run{&procedure::kRotaryAxisErrors, 0, procedure::ReadBy::head},
                    Run{&procedure::kAAxisAlignment, 0, procedure::ReadBy::shank},
                    Run{&procedure::kSwivelError, 0, procedure::ReadBy::shank}));

}  // namespace
}  // namespace probebox::scenario
