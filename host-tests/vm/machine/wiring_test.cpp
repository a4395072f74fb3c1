#include <fstream>
#include <gmock/gmock.h>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "machine_on_counters.hpp"

// What the selftest says about encoders that are wired otherwise than described.
namespace probebox::vm {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::StartsWith;

// Its control homes nothing, so that a mark alone references an axis.
class WiredMachine : public MachineOnCounters {
 protected:
  WiredMachine() : MachineOnCounters{false} {}
  // By a mark that X passes in its jog.
  void referenceXByItsMark() {
    const auto file = box.board() / "machine.toml";
    std::ostringstream text;
    text << std::ifstream{file}.rdbuf();
    std::string content = text.str();
    const std::string homing = "reference = \"homing\"";
    std::ofstream{file} << content.replace(content.find(homing), homing.size(), "reference = \"index\"");
  }
  // What the selftest finds wrong: "name: sentence".
  std::vector<std::string> wrong() {
    auto selftest = command({"selftest"});
    selftest.status();
    std::vector<std::string> found;
    for (const auto& finding : selftest.objects()) {
      if (finding.contains("good") && !finding["good"])
        found.push_back(finding["name"].get<std::string>() + ": " + finding["what"].get<std::string>());
    }
    const bool has_concluded = !selftest.objects().empty() && selftest.objects().back().contains("findings");
    EXPECT_TRUE(has_concluded) << selftest.out() << selftest.err();
    return found;
  }
};

TEST_F(WiredMachine, PassesTheSelftestWhenItIsWiredAsDescribed) {
  referenceXByItsMark();
  start();
  EXPECT_THAT(wrong(), IsEmpty());
}

TEST_F(WiredMachine, IsFoundToHaveAAndBExchanged) {
  sensors.wiring.sense[1] *= -1;
  start();
  EXPECT_THAT(wrong(), ElementsAre(StartsWith("sense-wrong: ")));
}

TEST_F(WiredMachine, IsFoundToCountTheWrongAxis) {
  std::swap(sensors.wiring.axis_at_input[0], sensors.wiring.axis_at_input[2]);
  start();
  EXPECT_THAT(wrong(), ElementsAre(StartsWith("axes-exchanged: "), StartsWith("axes-exchanged: ")));
}

TEST_F(WiredMachine, IsFoundToHaveNoIndex) {
  referenceXByItsMark();
  sensors.wiring.index = false;
  start();
  EXPECT_THAT(wrong(), ElementsAre(StartsWith("index-missing: ")));
}

}  // namespace
}  // namespace probebox::vm
