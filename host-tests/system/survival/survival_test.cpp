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
#include "tools/link/client.hpp"
#include "tools/tour/process.hpp"

// The real programs, killed and fed with garbage: the others go on, and nothing that was accepted is lost.
namespace probebox {
namespace {

using namespace std::chrono_literals;
using messages::ProcedureState;
using tour::Process;

struct Exactness : link::StreamListener {
  int heartbeats{};
  int exact{};
  void onHeartbeat(const messages::Heartbeat&, const std::optional<link::Balance>& balance) override {
    if (!balance) return;
    ++heartbeats;
    exact += balance->exact ? 1 : 0;
  }
};

class Survival : public testing::Test {
 protected:
  Survival() {
    std::filesystem::create_directories(folder);
    setenv("XDG_RUNTIME_DIR", folder.c_str(), 1);
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

  std::unique_ptr<link::Client> connect(link::StreamListener* listener = nullptr) {
    for (int attempt = 0; attempt < 400; ++attempt) {
      auto pipe = tcp::connectTcp(box, 1s);
      if (pipe) {
        auto client = std::make_unique<link::Client>(std::move(*pipe), link::ClientOptions{}, listener);
        if (client->connect(link::patience(20s))) return client;
      }
      std::this_thread::sleep_for(50ms);
    }
    ADD_FAILURE() << "no box at " << uri();
    return nullptr;
  }
  template <class Operation>
  typename Operation::Answer ask(link::Client& client, const typename Operation::Request& request = {}) {
    auto answer = client.request<Operation>(request, link::patience(20s));
    EXPECT_TRUE(answer) << answer.error().what;
    return answer ? std::move(*answer) : typename Operation::Answer{};
  }
  bool eventually(link::Client& client, const std::function<bool()>& is_so) {
    const auto end = std::chrono::steady_clock::now() + 240s;
    while (!is_so()) {
      if (std::chrono::steady_clock::now() > end) return false;
      linger(client, 50ms);
    }
    return true;
  }
  static void linger(link::Client& client, std::chrono::milliseconds duration) {
    const auto wait = link::patience(duration);
    while (client.round(wait)) {
    }
  }
  bool waitForLock(link::Client& client) {
    return eventually(client, [&] { return ask<messages::Status>(client).clock.state == ClockState::locked; });
  }
  std::uint64_t calibrateAndAccept(link::Client& client) {
    const auto run = ask<messages::StartProcedure>(client, {.method = "delay-multi-speed"}).run;
    messages::ProcedureStatus::Answer status;
    EXPECT_TRUE(eventually(client, [&] {
      status = ask<messages::ProcedureStatus>(client);
      return status.run == run && status.state >= ProcedureState::proposed;
    }));
    EXPECT_EQ(status.state, ProcedureState::proposed) << status.refusal;
    ask<messages::AcceptResult>(client, {.id = status.result_id, .by = "somebody"});
    return status.result_id;
  }

  const std::filesystem::path folder =
      std::filesystem::path{testing::TempDir()} / ("survival-" + std::to_string(getpid()));
  tcp::Address box;
  std::unique_ptr<Process> daemon;
};

TEST_F(Survival, AnAcceptedResultOutlivesAKilledDaemon) {
  start();
  auto client = connect();
  ASSERT_TRUE(client && waitForLock(*client));
  const auto id = calibrateAndAccept(*client);
  daemon->kill(SIGKILL);  // at once after the acknowledgement
  start();
  client = connect();
  ASSERT_TRUE(client);
  EXPECT_TRUE(eventually(*client, [&] {
    const auto active = ask<messages::Status>(*client).active_results;
    return active.size() == 1 && active[0] == id;
  }));
  EXPECT_TRUE(eventually(*client, [&] { return ask<messages::Corrections>(*client).delay_calibrated; }));
}

TEST_F(Survival, KilledCommandsDoNotDisturbTheOthers) {
  start();
  Exactness exactness;
  auto client = connect(&exactness);
  ASSERT_TRUE(client && waitForLock(*client));
  client->start({});
  for (int i = 0; i < 5; ++i) {
    const auto recording = (folder / ("cut-" + std::to_string(i) + ".pbx")).string();
    auto command =
        Process::start({PROBEBOX, "-u", uri(), "record", "-o", recording, "--for", "60"}, (folder / "out").string());
    ASSERT_TRUE(command);
    ASSERT_TRUE(eventually(
        *client, [&] { return std::filesystem::exists(recording) && std::filesystem::file_size(recording) > 20'000; }));
    command->kill(SIGKILL);
    // What was written until then can be read.
    const auto exported = tour::outputOf({PROBEBOX, "export", recording, "-o", recording + ".csv"});
    EXPECT_TRUE(exported) << exported.error().what;
  }
  const auto closing = client->finish(link::patience(20s));
  ASSERT_TRUE(closing);
  EXPECT_TRUE(closing->exact);
  EXPECT_GT(closing->account.received, 0U);
  EXPECT_GT(exactness.heartbeats, 0);
  EXPECT_EQ(exactness.exact, exactness.heartbeats);
  EXPECT_TRUE(daemon->running());
}

TEST_F(Survival, GarbageOnAllPortsIsCountedAndDisturbsNobody) {
  const auto box_port = folder / "box-serial";
  const auto host_port = folder / "host-serial";
  auto cable = serial::EmulatedCable::open(box_port, host_port);
  ASSERT_TRUE(cable);
  start({"--link", "serial:" + box_port.string()});
  Exactness exactness;
  auto client = connect(&exactness);
  ASSERT_TRUE(client && waitForLock(*client));
  client->start({});

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
    linger(*client, 5ms);
  }
  const auto closing = client->finish(link::patience(20s));
  ASSERT_TRUE(closing);
  EXPECT_TRUE(closing->exact);
  EXPECT_GT(exactness.heartbeats, 10);
  EXPECT_EQ(exactness.exact, exactness.heartbeats);
  EXPECT_TRUE(daemon->running());
  EXPECT_GT(closing->account.received, 0U);
  const auto counted = ask<messages::Status>(*client).from_hosts;
  EXPECT_GT(counted.bad_cobs + counted.bad_crc + counted.bad_length + counted.oversize, 100U);
  EXPECT_GT(counted.discarded_bytes, 100'000U);
  EXPECT_EQ(ask<messages::ListResults>(*client).results.size(), 0U);
  EXPECT_EQ(ask<messages::ProcedureStatus>(*client).state, ProcedureState::idle);
}

TEST_F(Survival, MuteConnectionsDoNotLockOthersOut) {
  start();
  ASSERT_TRUE(connect());
  std::vector<std::unique_ptr<io::BytePipe>> mute;
  for (int i = 0; i < 12; ++i) {
    if (auto pipe = tcp::connectTcp(box, 5s)) mute.push_back(std::move(*pipe));
  }
  ASSERT_GE(mute.size(), 8U);
  const auto client = connect();  // tries until the mute ones have lost their places
  ASSERT_TRUE(client);
  EXPECT_TRUE(waitForLock(*client));
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
