#include "firmware/app/host/loop_back_request_handler.hpp"

#include <gtest/gtest.h>

#include "drivers/gpio/loop_back_emulator.hpp"
#include "protocol/messages/self_test.hpp"

namespace probebox::app {
namespace {

LoopBackRequestHandler handler() {
  const auto late = []() -> std::optional<Nanoseconds> { return Nanoseconds{20'000}; };
  return LoopBackRequestHandler{board::LoopBack{}, std::make_unique<gpio::EmulatedLoopBack>(late)};
}

// However a measurement ends, the next one may begin.
TEST(LoopBackRequestHandler, TakesOneMeasurementAtATime) {
  for (const bool allowed : {true, false}) {
    auto handler = app::handler();
    ASSERT_TRUE(handler.begin());
    EXPECT_FALSE(handler.begin()) << "it takes seconds";
    const auto reply =
        handler.answer(messages::encoded(messages::LoopBack::Request{.pulses = 20}), {.allow_calibrate = allowed});
    EXPECT_EQ(reply.code, allowed ? messages::ErrorCode::ok : messages::ErrorCode::not_permitted);
    EXPECT_TRUE(handler.begin());
    handler.end();
    EXPECT_TRUE(handler.begin());
  }
}

}  // namespace
}  // namespace probebox::app
