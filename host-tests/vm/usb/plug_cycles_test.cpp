#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <set>
#include <string>
#include <thread>

#include "box_process.hpp"
#include "drivers/usb_host/usb_link.hpp"
#include "tools/link/client.hpp"
#include "usb_gadget.hpp"

// A box that is plugged in a thousand times keeps nothing of it.
namespace probebox::vm {
namespace {

using namespace std::chrono_literals;

// What the daemon holds. Anonymous memory that is its own; files that are open.
struct Held {
  long private_kb{};
  std::multiset<std::string> files;
};

Held heldBy(pid_t pid) {
  const auto process = "/proc/" + std::to_string(pid);
  Held held;
  std::ifstream status{process + "/status"};
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with("VmData:")) held.private_kb = std::strtol(line.c_str() + 7, nullptr, 10);
  }
  for (const auto& entry : std::filesystem::directory_iterator{process + "/fd"}) {
    std::error_code gone;
    const auto file = std::filesystem::read_symlink(entry.path(), gone).string();
    held.files.insert(file.substr(0, file.find(":[")));  // without the inode, which may be another
  }
  return held;
}

// A host comes, shakes hands and leaves, within ten seconds.
bool visited() {
  for (int tries = 0; tries < 500; ++tries, std::this_thread::sleep_for(20ms)) {
    auto connection = usb_host::openUsbLink("");
    if (!connection) continue;
    link::Client client{std::move(*connection), {}};
    if (client.connect(link::patience(5s))) return true;
  }
  return false;
}

TEST(PlugCycles, LeaveNothingBehind) {
  constexpr int kWarmUp = 20, kCycles = 1000;
  UsbGadget gadget;
  BoxProcess box{PROBEBOX_SIM_BOARD};
  box.start({"--link", "usb", "--time-scale", "0.01"});  // the emulated machine shall not take the time
  Held before;
  for (int cycle = 0; cycle < kWarmUp + kCycles; ++cycle) {
    ASSERT_TRUE(visited()) << "cycle " << cycle << '\n' << box.log();
    if (cycle == kWarmUp) before = heldBy(box.pid());
    gadget.unbind();
    gadget.bind();
  }
  ASSERT_TRUE(visited());
  const auto after = heldBy(box.pid());
  EXPECT_EQ(after.files, before.files);
  EXPECT_LE(after.private_kb, before.private_kb + 64);
  std::printf("%d cycles: %ld kB and %zu descriptors before, %ld kB and %zu after\n", kCycles, before.private_kb,
              before.files.size(), after.private_kb, after.files.size());
}

}  // namespace
}  // namespace probebox::vm
