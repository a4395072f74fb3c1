#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <malloc.h>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <unistd.h>
#include <utility>

#include "box_process.hpp"
#include "drivers/usb_host/hot_plug.hpp"
#include "drivers/usb_host/usb_link.hpp"
#include "tools/link/client.hpp"
#include "usb_gadget.hpp"

// A box that is plugged in a thousand times keeps nothing of it, and neither does its host.
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
    auto file = std::filesystem::read_symlink(entry.path(), gone).string();
    file.resize(std::min(file.size(), file.find(":[")));  // without the inode, which may be another
    // A device gets another number each time that it is plugged in.
    if (file.starts_with("/dev/bus/usb/")) file = "/dev/bus/usb";
    held.files.insert(file);
  }
  return held;
}

// A host that has shaken hands, within ten seconds; null when none could.
std::unique_ptr<link::Client> host() {
  for (int tries = 0; tries < 500; ++tries, std::this_thread::sleep_for(20ms)) {
    auto connection = usb_host::openUsbLink("");
    if (!connection) continue;
    auto client = std::make_unique<link::Client>(std::move(*connection), link::ClientOptions{});
    if (client->connect(link::patience(5s))) return client;
  }
  return nullptr;
}

bool losesItsBox(link::Client& client) {
  const auto wait = link::patience(10s);
  while (client.state() != link::LinkState::lost && client.round(wait)) {
  }
  return client.state() == link::LinkState::lost;
}

// The least of each in some seconds: a link that the emulated controller has given up and made anew is there twice for
// a while.
Held settled(pid_t box, link::Client& client) {
  Held least = heldBy(box);
  for (int look = 0; look < 25; ++look) {
    const auto wait = link::patience(200ms);
    while (client.round(wait)) {
    }
    Held now = heldBy(box);
    least.private_kb = std::min(least.private_kb, now.private_kb);
    if (now.files.size() < least.files.size()) least.files = std::move(now.files);
  }
  return least;
}

// Of the host, which is this process. It runs without malloc's caches of free chunks, which would count as held.
struct HostHeld {
  std::size_t heap_bytes{mallinfo2().uordblks};
  std::multiset<std::string> files{heldBy(::getpid()).files};
};

TEST(PlugCycles, LeaveNothingBehind) {
  constexpr int kWarmUp = 20, kCycles = 1000;
  UsbGadget gadget;
  BoxProcess box{PROBEBOX_SIM_BOARD};
  box.start({"--link", "usb", "--time-scale", "0.01"});  // the emulated machine shall not take the time
  const auto plug = usb_host::HotPlug::watch(usb::kLink);
  ASSERT_TRUE(plug) << plug.error().what;
  Held before, after;
  std::optional<HostHeld> host_before, host_after;
  for (int cycle = 0; cycle <= kWarmUp + kCycles; ++cycle) {
    const auto client = host();
    ASSERT_NE(client, nullptr) << "cycle " << cycle << '\n' << box.log();
    (*plug)->poll();
    if (cycle == kWarmUp) before = settled(box.pid(), *client);
    (cycle == kWarmUp ? host_before : host_after).emplace();
    if (cycle == kWarmUp + kCycles) {
      after = settled(box.pid(), *client);
      break;
    }
    gadget.unbind();
    ASSERT_TRUE(losesItsBox(*client)) << "cycle " << cycle;
    gadget.bind();
  }
  EXPECT_EQ(after.files, before.files);
  EXPECT_LE(after.private_kb, before.private_kb + 64);
  EXPECT_EQ(host_after->files, host_before->files);
  EXPECT_LE(host_after->heap_bytes, host_before->heap_bytes + 4 * 1024);
  std::printf(
      "%d cycles: %ld kB and %zu descriptors before, %ld kB and %zu after; of the host %zu kB and %zu, %zu and %zu\n",
      kCycles, before.private_kb, before.files.size(), after.private_kb, after.files.size(),
      host_before->heap_bytes / 1024, host_before->files.size(), host_after->heap_bytes / 1024,
      host_after->files.size());
}

}  // namespace
}  // namespace probebox::vm
