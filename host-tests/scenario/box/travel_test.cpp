#include <algorithm>
#include <gtest/gtest.h>
#include <ostream>

#include "board/describe/parse.hpp"
#include "firmware/procedure/dataset/sweep.hpp"
#include "firmware/procedure/facts/readiness.hpp"
#include "firmware/procedure/plan/methods.hpp"
#include "host-tests/emulation/scenario.hpp"

// The emulated machine goes where its axes can: its park position, the ways between features, touches and sweeps.
namespace probebox::scenario {
namespace {

using namespace std::chrono_literals;
using procedure::Method;

struct Run {
  Method method{};
  std::uint8_t axis{};  // of a sweep
  procedure::ReadBy by{};
};

void PrintTo(const Run& run, std::ostream* out) {
  *out << procedure::nameOf(run.method);
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
    if (procedure::measuresATool(GetParam().method)) options.tool = 4;
    if (options.axis == 0) return procedure::described(GetParam().method, options, usualFacts(), GetParam().by);
    const auto sweep = procedure::sweepOptions(options, 0, usualFacts());
    EXPECT_TRUE(sweep.ok());
    return sweep ? *sweep : options;
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
  const auto run = scenario.start(GetParam().method, options());
  const auto park = scenario.machine().commandedPosition();
  // Its later steps come from what the earlier ones have measured.
  if (GetParam().method == Method::centreline_by_steps) scenario.finish(run);
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
    testing::Values(Run{Method::delay_multi_speed}, Run{Method::delay_known_sphere}, Run{Method::delay_plates},
                    Run{Method::delay_per_axis}, Run{Method::delay_non_normal}, Run{Method::delay_in_out},
                    Run{Method::centreline}, Run{Method::c_axis_alignment}, Run{Method::selftest},
                    Run{Method::screw_calibration, 1}, Run{Method::screw_calibration, 2},
                    Run{Method::screw_calibration, 3}, Run{Method::spindle_offset_2x2},
                    Run{Method::spindle_offset_four}, Run{Method::centreline_limited_access},
                    Run{Method::periodic_check}, Run{Method::table_pivot}, Run{Method::swivel_error},
                    Run{Method::head_pivot}, Run{Method::a_axis_alignment}, Run{Method::tool_setter},
                    Run{Method::tool_assembly}, Run{Method::sensor_head_calibration}, Run{Method::centreline_by_steps},
                    Run{Method::rotary_axis_errors, 0, procedure::ReadBy::head},
                    Run{Method::a_axis_alignment, 0, procedure::ReadBy::shank},
                    Run{Method::swivel_error, 0, procedure::ReadBy::shank}));

}  // namespace
}  // namespace probebox::scenario
