#include "host-tests/support/no_alloc.hpp"

#include <gtest/gtest.h>

#include "drivers/world/world.hpp"
#include "streams.hpp"

namespace probebox::world {
namespace {

using testing::seconds;

TEST(World, TakesNoMemoryOnceItStands) {
  Config config = testing::usual();
  config.clock.missing_probability = config.clock.doubled_probability = config.clock.spurious_probability = 0.01;
  config.trigger_line = true;
  config.axes.home_mm = {10, -20, 60};
  for (const bool as_events : {true, false}) {
    config.edges_as_events = as_events;
    World world{config, 1};
    std::array<Event, 64> events;
    std::array<PhysicalEdge, 64> edges;
    std::size_t handed_out = 0;
    const support::NoAlloc guard;
    world.inject({.kind = FaultKind::edges_doubled, .at = seconds(1), .duration = std::chrono::seconds{1}});
    for (int ms = 0; ms < 20'000; ms += 10) {
      const MonoTime now = seconds(1e-3 * ms);
      const bool down = ms % 2000 < 1000;
      if (ms % 1000 == 0) world.machine().moveTo({10, -20, down ? 45.2 : 60.0}, 50, now);
      world.advanceTo(now);
      for (std::size_t n = world.poll(events); n > 0; n = world.poll(events)) handed_out += n;
      for (std::size_t n = world.pollEdges(edges); n > 0; n = world.pollEdges(edges)) handed_out += n;
    }
    EXPECT_EQ(guard.allocations(), 0U);
    EXPECT_GT(handed_out, 60'000U);
    EXPECT_EQ(world.machine().stylus().contactCount(), 10U);
  }
}

}  // namespace
}  // namespace probebox::world
