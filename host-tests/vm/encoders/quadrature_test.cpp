#include "drivers/gpio/quadrature.hpp"

#include <array>
#include <chrono>
#include <cstdio>
#include <ctime>
#include <gmock/gmock.h>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "drivers/gpio/linux_gpio.hpp"
#include "gpio_sim.hpp"

// An encoder on two lines of the kernel's gpio simulator, counted by the real driver.
namespace probebox::gpio {
namespace {

using namespace std::chrono_literals;

constexpr const char* kLabel = "encoder";

MonoTime now() {
  timespec time{};
  clock_gettime(CLOCK_MONOTONIC, &time);
  return monoTime(std::int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec);
}

class LinesOfAnEncoder : public testing::Test {
 protected:
  LinesOfAnEncoder() {
    auto lines = std::make_unique<LinuxGpio>(
        quadratureLines({.name = "A", .chip = kLabel, .line = 0U}, {.name = "B", .chip = kLabel, .line = 1U}));
    const auto acquired = lines->acquire();
    EXPECT_TRUE(acquired) << acquired.error().what;
    source = std::make_unique<QuadratureSource>(
        std::move(lines), QuadratureConfig{.axis = 5, .interval = 1ms, .maximum_edge_rate_hz = 20'000});
    read();
  }
  void step(int direction) {
    count += direction;
    const auto quarter = count & 3;
    chip.drive(0, quarter == 1 || quarter == 2);
    chip.drive(1, quarter == 2 || quarter == 3);
  }
  void read() {
    std::array<Event, 64> batch;
    while (const std::size_t got = source->read(batch, now()))
      events.insert(events.end(), batch.begin(), batch.begin() + static_cast<std::ptrdiff_t>(got));
  }
  void wait(Nanoseconds duration) {
    for (const auto until = now() + duration; now() < until;) read();
  }

  vm::GpioSim chip{kLabel, {"A", "B"}};
  std::unique_ptr<QuadratureSource> source;
  std::int64_t count{};
  std::vector<Event> events;
};

TEST_F(LinesOfAnEncoder, CountEveryTransitionBothWays) {
  for (int i = 0; i < 3000; ++i) {
    step(i < 2000 ? 1 : -1);
    if (i % 16 == 0) wait(1ms);
  }
  wait(20ms);
  EXPECT_EQ(source->decoder().count(), 1000);
  EXPECT_EQ(source->decoder().illegal(), 0U);
  EXPECT_EQ(source->decoder().missed(), 0U);
  ASSERT_FALSE(events.empty());
  const auto* const last = std::get_if<AngleCount>(&events.back());
  ASSERT_NE(last, nullptr);
  EXPECT_EQ(last->counts, 1000);
}

// As fast as the test can move the wires, read every 64 edges: what the driver follows without a loss.
TEST_F(LinesOfAnEncoder, FollowARateThatIsSaid) {
  constexpr int kEdges = 20'000;
  const auto begin = now();
  for (int i = 0; i < kEdges; ++i) {
    step(1);
    if (i % 64 == 0) read();
  }
  const double rate_hz = kEdges / toSeconds(now() - begin);
  read();
  std::printf("%d edges at %.0f edges/s: %llu missed, %llu illegal\n", kEdges, rate_hz,
              static_cast<unsigned long long>(source->decoder().missed()),
              static_cast<unsigned long long>(source->decoder().illegal()));
  EXPECT_EQ(source->decoder().missed(), 0U);
  EXPECT_EQ(source->decoder().count(), kEdges);
}

}  // namespace
}  // namespace probebox::gpio
