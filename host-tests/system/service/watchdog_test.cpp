#include <array>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <functional>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <memory>
#include <sstream>
#include <sys/socket.h>
#include <sys/un.h>
#include <thread>
#include <unistd.h>

#include "drivers/io/descriptor.hpp"
#include "drivers/serial/emulator.hpp"
#include "host-tests/support/held_thread.hpp"
#include "tools/tour/process.hpp"

// The real daemon and what it tells the manager that started it; the test is the manager.
namespace probebox {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;
using tour::Process;

class ManagedDaemon : public testing::Test {
 protected:
  ManagedDaemon() {
    std::filesystem::create_directories(folder);
    sockaddr_un address{.sun_family = AF_UNIX, .sun_path = {}};
    const auto path = (folder / "notify").string();
    path.copy(static_cast<char*>(address.sun_path), sizeof address.sun_path - 1);
    inbox = io::Descriptor{socket(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0)};
    EXPECT_EQ(bind(inbox.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    setenv("NOTIFY_SOCKET", path.c_str(), 1);
    setenv("WATCHDOG_USEC", "4000000", 1);
    setenv("PROBEBOX_RENDEZVOUS", folder.c_str(), 1);
  }
  ~ManagedDaemon() override {
    daemon.reset();
    for (const auto* name : {"NOTIFY_SOCKET", "WATCHDOG_USEC", "PROBEBOX_RENDEZVOUS"}) unsetenv(name);
    std::filesystem::remove_all(folder);
  }

  void start() {
    auto opened = serial::EmulatedCable::open(folder / "box", folder / "cnc");
    ASSERT_TRUE(opened) << opened.error().what;
    cable = std::make_unique<serial::EmulatedCable>(std::move(*opened));
    auto started = Process::start({PROBEBOXD, "--board", "sim", "--state", (folder / "state").string(), "--link",
                                   "tcp:127.0.0.1:0", "--cnc", "modbus:" + (folder / "box").string()},
                                  (folder / "log").string());
    ASSERT_TRUE(started) << started.error().what;
    daemon = std::make_unique<Process>(std::move(*started));
  }

  // What has been said since the last call: one message a line.
  std::vector<std::string> messages() {
    std::vector<std::string> all;
    std::array<char, 4096> buffer{};
    for (ssize_t size = 0; (size = recv(inbox.get(), buffer.data(), buffer.size(), 0)) > 0;)
      all.emplace_back(buffer.data(), static_cast<std::size_t>(size));
    return all;
  }
  bool hear(const std::string& message) {
    return eventually([&] { return std::ranges::count(messages(), message) > 0; });
  }
  std::string log() const {
    std::ostringstream text;
    text << std::ifstream{folder / "log"}.rdbuf();
    return text.str();
  }
  static bool eventually(const std::function<bool()>& condition) {
    for (int i = 0; i < 12'000; ++i) {
      if (condition()) return true;
      std::this_thread::sleep_for(10ms);
    }
    return false;
  }

  const std::filesystem::path folder =
      std::filesystem::path{testing::TempDir()} / ("managed-" + std::to_string(getpid()));
  io::Descriptor inbox;
  std::unique_ptr<serial::EmulatedCable> cable;
  std::unique_ptr<Process> daemon;
};

TEST_F(ManagedDaemon, SaysThatItIsReadyAndHowItIsAndFeedsTheWatchdog) {
  start();
  EXPECT_TRUE(hear("READY=1"));
  EXPECT_TRUE(hear("STATUS=Master clock locked, 1 host"));  // the emulated controller
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(hear("WATCHDOG=1"));
  EXPECT_THAT(log(), testing::Not(HasSubstr("Stages not progressing")));
}

struct Stop {
  const char* thread;
  const char* named;
  friend void PrintTo(const Stop& stop, std::ostream* text) { *text << stop.thread; }
};
class ThreadOfManagedDaemon : public ManagedDaemon, public testing::WithParamInterface<Stop> {};

TEST_P(ThreadOfManagedDaemon, IsNamedWhenItStandsStillAndStarvesTheWatchdogUntilItGoesOn) {
  start();
  ASSERT_TRUE(hear("WATCHDOG=1"));
  {
    const auto held = support::HeldThread::hold(daemon->pid(), GetParam().thread);
    if (!held) GTEST_SKIP() << "a thread cannot be held here: " << held.error().what;
    const auto named = "Stages not progressing, the first is the cause: " + std::string{GetParam().named};
    std::vector<std::string> heard;
    ASSERT_TRUE(eventually([&] {
      for (auto& message : messages()) heard.push_back(std::move(message));
      return log().find(named) != std::string::npos;
    })) << log();
    EXPECT_TRUE(eventually([&] {
      for (auto& message : messages()) heard.push_back(std::move(message));
      return std::ranges::any_of(heard, [&](const auto& message) { return message.starts_with("STATUS=" + named); });
    }));
    EXPECT_LE(std::ranges::count(heard, "WATCHDOG=1"), 1) << "one may have been on its way";
  }
  EXPECT_TRUE(hear("WATCHDOG=1"));
  EXPECT_TRUE(
      eventually([&] { return log().find("All stages of the chain are running again.") != std::string::npos; }));
}

INSTANTIATE_TEST_SUITE_P(Each, ThreadOfManagedDaemon,
                         testing::Values(Stop{"capture", "capture, core, published state, links"},
                                         Stop{"core", "core, published state, links"}, Stop{"links", "links"},
                                         Stop{"worker", "worker"}, Stop{"cnc", "CNC line "}),
                         [](const auto& stop) { return std::string{stop.param.thread}; });

}  // namespace
}  // namespace probebox
