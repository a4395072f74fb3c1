#include <gtest/gtest.h>

#include "box_process.hpp"
#include "latency.hpp"

// In the time of a guest whose every instruction takes 8 ns: a slow processor, and the same one on every machine. What
// is printed is the statement; what is asserted only keeps nonsense out.
namespace probebox::vm {
namespace {

TEST(Latency, OfAnEdgeToItsStampAndToTheSampleInTheHandOfAHostOnTcp) {
  constexpr const char* kUri = "tcp:127.0.0.1:7627";
  GpioSim chip{"probebox-vm", {"", "TOUCH", "OVERTRAVEL", "INDEX_X", ""}};
  const auto stamps = edgeToStamp(chip, 4, 2000);
  stamps.print("edge to the kernel's stamp");
  EXPECT_EQ(stamps.count(), 2000U);
  EXPECT_GT(stamps.us(0.5), 1);
  EXPECT_LT(stamps.us(0.99), 500);

  BoxProcess box{BOARD_VM};
  box.start({"--link", kUri});
  const auto through = edgeToSample(kUri, chip, 0, 1, 300);
  through.trigger_to_sample.print("trigger edge to the sample that tells of it, by TCP");
  through.tick_to_sample.print("tick to its sample, by TCP");
  EXPECT_EQ(through.trigger_to_sample.count(), 300U);
  EXPECT_GT(through.tick_to_sample.count(), 10'000U);
  for (const auto* latencies : {&through.trigger_to_sample, &through.tick_to_sample}) {
    EXPECT_GT(latencies->us(0.5), 100);
    EXPECT_LT(latencies->us(0.5), 60'000);
    EXPECT_LT(latencies->us(0.99), 150'000);
  }
}

}  // namespace
}  // namespace probebox::vm
