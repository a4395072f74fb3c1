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
  report(edgeToSample(kUri, chip, 0, 1, 300), "TCP", 300);
}

}  // namespace
}  // namespace probebox::vm
