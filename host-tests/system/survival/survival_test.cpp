#include <chrono>
#include <cmath>
#include <filesystem>
#include <functional>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <memory>
#include <random>
#include <signal.h>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>

#include "drivers/serial/emulator.hpp"
#include "drivers/tcp/linux_tcp.hpp"
#include "host-tests/host/test_host.hpp"
#include "tools/tour/process.hpp"

// The real programs, killed and fed with garbage: the others go on, and nothing that was accepted is lost.
namespace probebox {
namespace {

using namespace std::chrono_literals;
using messages::ProcedureState;
using support::Balances;
using support::TestHost;
using tour::Process;

class Survival : public testing::Test {
 protected:
  Survival() {
    std::filesystem::create_directories(folder);
    setenv("PROBEBOX_RENDEZVOUS", folder.c_str(), 1);
    const auto listener = tcp::Listener::open({.host = "127.0.0.1", .port = 0});
    box = listener->address();
  }
  ~Survival() override {
    daemon.reset();
    std::filesystem::remove_all(folder);
  }

  void start(std::vector<std::string> more = {}) {
    std::vector<std::string> command{PROBEBOXD, "--board", "sim",          "--state", (folder / "state").string(),
                                     "--link",  uri(),     "--time-scale", "6"};
    command.insert(command.end(), more.begin(), more.end());
    auto started = Process::start(command, (folder / "log").string());
    ASSERT_TRUE(started) << started.error().what;
    daemon = std::make_unique<Process>(std::move(*started));
  }
  std::string uri() const { return "tcp:" + tcp::describe(box); }

  std::unique_ptr<TestHost> connect(link::StreamListener* listener = nullptr) const {
    return TestHost::connect(uri(), listener);
  }

  const std::filesystem::path folder =
      std::filesystem::path{testing::TempDir()} / ("survival-" + std::to_string(getpid()));
  tcp::Address box;
  std::unique_ptr<Process> daemon;
};

TEST_F(Survival, AnAcceptedResultOutlivesAKilledDaemon) {
  start();
  auto host = connect();
  ASSERT_TRUE(host && host->waitForLock());
  const auto id = host->calibrateAndAccept();
  daemon->kill(SIGKILL);  // at once after the acknowledgement
  start();
  host = connect();
  ASSERT_TRUE(host);
  EXPECT_TRUE(host->eventually([&] {
    const auto active = host->ask<messages::Status>().active_results;
    return active.size() == 1 && active[0] == id;
  }));
  EXPECT_TRUE(host->eventually([&] { return host->ask<messages::Corrections>().delay_calibrated; }));
}

TEST_F(Survival, KilledCommandsDoNotDisturbTheOthers) {
  start();
  Balances balances;
  auto host = connect(&balances);
  ASSERT_TRUE(host && host->waitForLock());
  host->client().start({});
  for (int i = 0; i < 5; ++i) {
    const auto recording = (folder / ("cut-" + std::to_string(i) + ".pbx")).string();
    auto command =
        Process::start({PROBEBOX, "-u", uri(), "record", "-o", recording, "--for", "60"}, (folder / "out").string());
    ASSERT_TRUE(command);
    ASSERT_TRUE(host->eventually(
        [&] { return std::filesystem::exists(recording) && std::filesystem::file_size(recording) > 20'000; }));
    command->kill(SIGKILL);
    // What was written until then can be read.
    const auto exported = tour::outputOf({PROBEBOX, "export", recording, "-o", recording + ".csv"});
    EXPECT_TRUE(exported) << exported.error().what;
  }
  const auto closing = host->finish();
  EXPECT_TRUE(closing.exact);
  EXPECT_GT(closing.account.received, 0U);
  EXPECT_GT(balances.heartbeats, 0);
  EXPECT_EQ(balances.exact, balances.heartbeats);
  EXPECT_TRUE(daemon->running());
}

TEST_F(Survival, GarbageOnAllPortsIsCountedAndDisturbsNobody) {
  const auto box_port = folder / "box-serial";
  const auto host_port = folder / "host-serial";
  auto cable = serial::EmulatedCable::open(box_port, host_port);
  ASSERT_TRUE(cable);
  start({"--link", "serial:" + box_port.string()});
  Balances balances;
  auto host = connect(&balances);
  ASSERT_TRUE(host && host->waitForLock());
  host->client().start({});

  std::mt19937_64 random{11};
  std::vector<std::byte> noise(2048);
  std::vector<std::unique_ptr<io::BytePipe>> vandals(3);
  for (int burst = 0; burst < 600; ++burst) {
    for (auto& byte : noise) byte = static_cast<std::byte>(random());
    cable->inject(serial::EmulatedCable::End::a, std::span{noise}.first(64 + random() % 1900));
    cable->pump(0ms);
    auto& vandal = vandals[random() % vandals.size()];
    if (!vandal || random() % 20 == 0) {
      auto pipe = tcp::connectTcp(box, 5s);
      vandal = pipe ? std::move(*pipe) : nullptr;
    }
    if (vandal && vandal->write(noise).state == io::PipeState::closed) vandal.reset();
    host->linger(5ms);
  }
  const auto closing = host->finish();
  EXPECT_TRUE(closing.exact);
  EXPECT_GT(balances.heartbeats, 10);
  EXPECT_EQ(balances.exact, balances.heartbeats);
  EXPECT_TRUE(daemon->running());
  EXPECT_GT(closing.account.received, 0U);
  const auto counted = host->ask<messages::Status>().from_hosts;
  EXPECT_GT(counted.bad_cobs + counted.bad_crc + counted.bad_length + counted.oversize, 100U);
  EXPECT_GT(counted.discarded_bytes, 100'000U);
  EXPECT_EQ(host->ask<messages::ListResults>().results.size(), 0U);
  EXPECT_EQ(host->ask<messages::ProcedureStatus>().state, ProcedureState::idle);
}

TEST_F(Survival, MuteConnectionsDoNotLockOthersOut) {
  start();
  ASSERT_TRUE(connect());
  std::vector<std::unique_ptr<io::BytePipe>> mute;
  for (int i = 0; i < 12; ++i) {
    if (auto pipe = tcp::connectTcp(box, 5s)) mute.push_back(std::move(*pipe));
  }
  ASSERT_GE(mute.size(), 8U);
  const auto host = connect();  // tries until the mute ones have lost their places
  ASSERT_TRUE(host);
  EXPECT_TRUE(host->waitForLock());
}

TEST_F(Survival, TakesNoTimeScaleThatIsNone) {
  for (const auto* scale : {"nan", "inf", "-1", "0", "1e9", "4x", ""}) {
    const auto refused = tour::outputOf({PROBEBOXD, "--board", "sim", "--check", "--time-scale", scale});
    ASSERT_FALSE(refused) << scale;
    EXPECT_THAT(refused.error().what, testing::HasSubstr("0.01 to 100")) << scale;
  }
}

TEST_F(Survival, OneDaemonAtATimeHasAFolderOfResults) {
  start();
  ASSERT_TRUE(connect());
  const auto second = tour::outputOf(
      {PROBEBOXD, "--board", "sim", "--state", (folder / "state").string(), "--link", "tcp:127.0.0.1:0"});
  ASSERT_FALSE(second);
  EXPECT_THAT(second.error().what, testing::HasSubstr("--state"));
}

}  // namespace
}  // namespace probebox
