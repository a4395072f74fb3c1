#include "tools/probebox/cli/json_of.hpp"

#include <array>
#include <cstdint>
#include <gtest/gtest.h>

#include "protocol/messages/structure_name.hpp"
#include "protocol/state/snapshot.hpp"

// One line of a fields() list is all that a new value takes: bytes and JSON follow.
namespace probebox::command {
namespace {

struct Pump {
  std::uint32_t strokes{};
  bool has_pressure{};
  double pressure_bar{};
  std::array<published::Health, 2> valves{};
  static constexpr void fields(auto& self, auto&& field) {
    field("strokes", self.strokes, "since the box started");
    field("pressure_bar", self.pressure_bar, "bar", published::NullUnless{self.has_pressure});
    field("valves", self.valves, "0 not configured, 1 good, 2 held, 3 invalid");
  }
};

struct Machine {
  Pump pump{};
  bool has_spare{};
  Pump spare{};
  Tick tick{};
  static constexpr void fields(auto& self, auto&& field) {
    field("pump", self.pump, "in use");
    field("spare", self.spare, "where one is fitted", published::OmittedUnless{self.has_spare});
    field("tick", self.tick, "latest tick");
  }
};

TEST(AMadeUpValue, TravelsAndIsShownByItsLineAlone) {
  Machine machine;
  machine.pump.strokes = 7;
  machine.pump.valves = {published::Health::good, published::Health::held};
  machine.tick = Tick{12};
  const auto decoded = messages::decode<Machine>(messages::encoded(machine));
  ASSERT_TRUE(decoded.ok());
  EXPECT_EQ(jsonOf(*decoded).dump(),
            R"({"pump":{"strokes":7,"pressure_bar":null,"valves":["good","held"]},"tick":12})");
  machine.pump.has_pressure = machine.has_spare = true;
  machine.pump.pressure_bar = 5.5;
  EXPECT_EQ(jsonOf(machine).dump(),
            R"({"pump":{"strokes":7,"pressure_bar":5.5,"valves":["good","held"]},)"
            R"("spare":{"strokes":0,"pressure_bar":null,"valves":["not configured","not configured"]},"tick":12})");
  EXPECT_EQ(messages::structureName<Machine>(), "Machine");
}

}  // namespace
}  // namespace probebox::command
