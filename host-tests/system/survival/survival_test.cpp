#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <functional>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <memory>
#include <mutex>
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
  EXPECT_TRUE(host->eventually([&] { return host->ask<messages::Corrections>().delay.calibrated; }));
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
    ASSERT_FALSE(exported);
    EXPECT_THAT(exported.error().what, testing::HasSubstr("its stream"));
    EXPECT_GT(std::filesystem::file_size(recording + ".csv"), 1000U);
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
  const auto status = host->ask<messages::Status>();
  const auto& on_serial_line = status.from_hosts;
  EXPECT_GT(on_serial_line.bad_cobs + on_serial_line.bad_crc + on_serial_line.bad_length + on_serial_line.oversize,
            100U);
  EXPECT_GT(on_serial_line.discarded_bytes, 100'000U);
  EXPECT_GT(status.not_let_in.strangers, 20U);
  EXPECT_EQ(host->ask<messages::ListResults>().results.size(), 0U);
  EXPECT_EQ(host->ask<messages::ProcedureStatus>().state, RunState::idle);
}

TEST_F(Survival, MuteConnectionsDoNotLockOthersOut) {
  start();
  ASSERT_TRUE(connect());
  std::vector<std::unique_ptr<io::BytePipe>> mute;
  for (int i = 0; i < 100; ++i) {
    if (auto pipe = tcp::connectTcp(box, 5s)) mute.push_back(std::move(*pipe));
    // At the first attempt, however many are mute.
    if (i % 10 != 9) continue;
    EXPECT_TRUE(tour::outputOf({PROBEBOX, "-u", uri(), "status"})) << i;
  }
  const auto host = connect();
  ASSERT_TRUE(host);
  EXPECT_TRUE(host->waitForLock());
  EXPECT_TRUE(host->eventually([&] { return host->ask<messages::Status>().not_let_in.silent >= mute.size(); }));
  std::array<std::byte, 1> byte{};
  for (auto& pipe : mute) EXPECT_EQ(pipe->read(byte).state, io::PipeState::closed);
}

// A page in a browser can make it post anything to a port of this computer, with its own lines in front.
TEST_F(Survival, WebPagesCommandNothing) {
  start();
  auto host = connect();
  ASSERT_TRUE(host && host->waitForLock());
  ASSERT_TRUE(host->eventually([&] { return host->ask<messages::ProcedureStatus>().referenced; }));
  const auto framed = [](messages::MessageType type, const std::vector<std::byte>& payload) {
    std::vector<std::byte> scratch(frame::bareSize(payload.size())), coded(frame::delimitedMaxSize(payload.size()));
    coded.resize(frame::encodeDelimited({.type = static_cast<std::uint8_t>(type)}, payload, scratch, coded));
    return coded;
  };
  const auto request = [&](std::uint32_t id, messages::Operation operation, const std::vector<std::byte>& body) {
    return framed(messages::MessageType::request, messages::encoded(messages::Request{id, operation, body}));
  };
  std::vector<std::byte> body{frame::kDelimiter};
  for (const auto& part :
       {framed(messages::MessageType::hello, messages::encoded(messages::Hello::current())),
        request(1, messages::Operation::set_inhibit, messages::encoded(messages::SetInhibit::Request{.active = true})),
        request(2, messages::Operation::enable_sources,
                messages::encoded(messages::EnableSources::Request{.mask = 0}))})
    body.insert(body.end(), part.begin(), part.end());
  const auto before = host->ask<messages::Corrections>();
  for (const auto* method : {"POST", "PUT", "\r\nPOST"}) {
    const auto head = std::string{method} +
                      " / HTTP/1.1\r\nHost: localhost\r\nContent-Length: " + std::to_string(body.size()) + "\r\n\r\n";
    std::vector<std::byte> bytes(head.size());
    std::ranges::transform(head, bytes.begin(), [](char c) { return static_cast<std::byte>(c); });
    bytes.insert(bytes.end(), body.begin(), body.end());
    auto page = tcp::connectTcp(box, 5s);
    ASSERT_TRUE(page);
    (*page)->write(bytes);
    std::array<std::byte, 256> answer{};
    io::Transfer got;
    EXPECT_TRUE(host->eventually([&] {
      got = (*page)->read(answer);
      return got.bytes > 0 || got.state == io::PipeState::closed;
    }));
    EXPECT_EQ(got.bytes, 0U) << "nothing is said to it";
  }
  const auto after = host->ask<messages::Corrections>();
  EXPECT_FALSE(after.inhibited);
  EXPECT_EQ(after.mask, before.mask);
  EXPECT_EQ(host->ask<messages::Status>().not_let_in.strangers, 3U);
}

TEST_F(Survival, AHostWithoutAFreeLinkIsToldTheLimit) {
  start();
  std::mutex mutex;
  std::vector<std::unique_ptr<TestHost>> hosts;
  while (hosts.size() < 7) {  // and the emulated controller
    hosts.push_back(connect());
    ASSERT_TRUE(hosts.back());
    for (const auto& host : hosts) host->linger(1ms);
  }
  const std::jthread signs_of_life{[&](const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      const std::lock_guard lock{mutex};
      for (const auto& host : hosts) host->linger(1ms);
    }
  }};
  const auto one_too_many = tour::outputOf({PROBEBOX, "-u", uri(), "status"});
  ASSERT_FALSE(one_too_many);
  EXPECT_THAT(one_too_many.error().what, testing::HasSubstr("all 8"));
  {
    const std::lock_guard lock{mutex};
    hosts.pop_back();
  }
  bool let_in = false;
  for (int i = 0; i < 100 && !let_in; ++i) let_in = tour::outputOf({PROBEBOX, "-u", uri(), "status"}).ok();
  EXPECT_TRUE(let_in);
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
