#include <cstdio>
#include <filesystem>
#include <iterator>
#include <malloc.h>

#include "on_a_bus.hpp"

// A receiver that is plugged in a thousand times leaves nothing behind in its driver, which is in this process.
namespace probebox::vm {
namespace {

namespace fs = std::filesystem;

// Without malloc's caches of free chunks, which would count as held (see CMakeLists.txt).
struct Held {
  std::size_t heap_bytes{mallinfo2().uordblks};
  std::ptrdiff_t descriptors{std::distance(fs::directory_iterator{"/proc/self/fd"}, fs::directory_iterator{})};
};

using ReceiverPlugCycles = ReceiverOnABus;

TEST_F(ReceiverPlugCycles, LeaveNothingBehind) {
  constexpr std::uint64_t kWarmUp = 20, kCycles = 1000;
  play();
  ReceiverGadget::grant();
  Held before, after;
  for (std::uint64_t cycle = 0; cycle <= kWarmUp + kCycles; ++cycle) {
    ASSERT_TRUE(readSamples(20)) << "cycle " << cycle << ": " << source.problem();
    (cycle <= kWarmUp ? before : after) = Held{};
    gadget.unbind();
    ASSERT_TRUE(readUntil([&] { return losses == cycle + 1; })) << "cycle " << cycle;
    gadget.bind();
    ReceiverGadget::grant();
  }
  EXPECT_EQ(after.descriptors, before.descriptors);
  EXPECT_LE(after.heap_bytes, before.heap_bytes + 4 * 1024);
  std::printf("%d cycles: %zu kB and %td descriptors before, %zu kB and %td after\n", static_cast<int>(kCycles),
              before.heap_bytes / 1024, before.descriptors, after.heap_bytes / 1024, after.descriptors);
  ASSERT_TRUE(readSamples(20)) << source.problem();
  expectExactCounts();
}

}  // namespace
}  // namespace probebox::vm
