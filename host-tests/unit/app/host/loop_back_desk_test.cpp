#include "firmware/app/host/loop_back_desk.hpp"

#include <gtest/gtest.h>

#include "drivers/gpio/loop_back_emulator.hpp"
#include "protocol/messages/self_test.hpp"

namespace probebox::app {
namespace {

LoopBackDesk desk() {
  const auto late = []() -> std::optional<Nanoseconds> { return Nanoseconds{20'000}; };
  return LoopBackDesk{board::LoopBack{}, std::make_unique<gpio::EmulatedLoopBack>(late)};
}

// However a measurement ends, the next one may begin.
TEST(LoopBackDesk, TakesOneMeasurementAtATime) {
  for (const bool allowed : {true, false}) {
    auto desk = app::desk();
    ASSERT_TRUE(desk.begin());
    EXPECT_FALSE(desk.begin()) << "it takes seconds";
    const auto reply =
        desk.answer(messages::encoded(messages::LoopBack::Request{.pulses = 20}), {.allow_calibrate = allowed});
    EXPECT_EQ(reply.code, allowed ? messages::ErrorCode::ok : messages::ErrorCode::not_permitted);
    EXPECT_TRUE(desk.begin());
    desk.end();
    EXPECT_TRUE(desk.begin());
  }
}

}  // namespace
}  // namespace probebox::app
