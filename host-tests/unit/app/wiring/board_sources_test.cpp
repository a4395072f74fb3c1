#include "firmware/app/wiring/board_sources.hpp"

#include <gmock/gmock.h>
#include <string>
#include <variant>
#include <vector>

namespace probebox::app {
namespace {

using ::testing::AllOf;
using ::testing::Contains;

board::GpioLine line(const std::string& name, unsigned number) {
  return {name, "gpiochip1", number, board::ActiveLevel::high};
}

board::EncoderDescription quadrature(const std::string& name, unsigned first) {
  return {.by = board::QuadratureEncoder{.a = line(name + " a", first), .b = line(name + " b", first + 1)},
          .rate_hz = 100};
}

// The loop-back never drives one of them, whatever its name is.
TEST(WatchedLines, AreThoseOfEncodersToo) {
  auto box = board::simDescriptions()->box;
  box.devices.encoders = "axes";
  box.sync.name = "sync";
  box.devices.encoders_by_axis[5] = quadrature("encoder C", 12);
  box.devices.secondary_encoders[2] = quadrature("encoder W", 20);
  std::vector<std::string> names;
  for (const auto& chip : watchedLines(box))
    for (const auto& watched : chip.lines) names.push_back(chip.chip + " " + gpio::lineText(watched));
  EXPECT_THAT(names, AllOf(Contains("gpiochip1 line 12 (encoder C a)"), Contains("gpiochip1 line 13 (encoder C b)"),
                           Contains("gpiochip1 line 20 (encoder W a)"), Contains("gpiochip1 line 21 (encoder W b)"),
                           Contains(box.sync.chip + " " + gpio::lineText(box.sync.line, "sync"))));
}

}  // namespace
}  // namespace probebox::app
