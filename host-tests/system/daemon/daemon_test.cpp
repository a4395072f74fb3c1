#include "firmware/app/daemon.hpp"

#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <memory>
#include <thread>
#include <unistd.h>

#include "drivers/tcp/linux_tcp.hpp"
#include "tools/link/client.hpp"

namespace probebox::app {
namespace {

using namespace std::chrono_literals;
using messages::ProcedureState;

// A daemon with the emulated machine in this process, and a host that speaks to it over TCP.
class RunningDaemon : public testing::Test {
 protected:
  RunningDaemon() {
    std::filesystem::create_directories(folder);
    setenv("XDG_RUNTIME_DIR", folder.c_str(), 1);
    options.state = folder / "state";
    options.links = {"tcp:127.0.0.1:0"};
    options.time_scale = 4;
  }
  ~RunningDaemon() override {
    daemon.reset();
    std::filesystem::remove_all(folder);
  }

  void start() {
    auto loaded = loadDescriptions(options);
    ASSERT_TRUE(loaded) << loaded.error().what;
    descriptions = *loaded;
    auto started = Daemon::start(options, descriptions);
    ASSERT_TRUE(started) << started.error().what;
    daemon = std::move(*started);
  }
  std::unique_ptr<link::Client> connect(link::StreamListener* listener = nullptr) {
    const auto address = tcp::parseAddress(daemon->uris().front().substr(4));
    auto pipe = tcp::connectTcp(*address, 5s);
    EXPECT_TRUE(pipe) << pipe.error().what;
    auto client = std::make_unique<link::Client>(std::move(*pipe), link::ClientOptions{}, listener);
    const auto welcome = client->connect(link::patience(20s));
    EXPECT_TRUE(welcome) << welcome.error().what;
    return client;
  }
  template <class Operation>
  typename Operation::Answer ask(link::Client& client, const typename Operation::Request& request = {}) {
    auto answer = client.request<Operation>(request, link::patience(20s));
    EXPECT_TRUE(answer) << answer.error().what;
    return answer ? std::move(*answer) : typename Operation::Answer{};
  }
  // Asks until it is so, or fails after a generous while.
  bool eventually(link::Client& client, const std::function<bool()>& is_so) {
    const auto end = std::chrono::steady_clock::now() + 240s;
    while (!is_so()) {
      if (std::chrono::steady_clock::now() > end) return false;
      const auto until = std::chrono::steady_clock::now() + 50ms;
      while (std::chrono::steady_clock::now() < until && client.round(link::patience(20ms))) {
      }
    }
    return true;
  }
  bool waitForLock(link::Client& client) {
    return eventually(client, [&] { return ask<messages::Status>(client).clock.state == ClockState::locked; });
  }
  messages::ProcedureStatus::Answer calibrate(link::Client& client) {
    const auto run = ask<messages::StartProcedure>(client, {.method = "delay-multi-speed"}).run;
    messages::ProcedureStatus::Answer status;
    EXPECT_TRUE(eventually(client,
                           [&] {
                             status = ask<messages::ProcedureStatus>(client);
                             return status.run == run && status.state >= ProcedureState::proposed;
                           }))
        << "state " << messages::nameOf(status.state) << ", " << status.prompt;
    return status;
  }

  const std::filesystem::path folder =
      std::filesystem::path{testing::TempDir()} / ("probeboxd-" + std::to_string(getpid()));
  Options options;
  board::Descriptions descriptions;
  std::unique_ptr<Daemon> daemon;
};

TEST_F(RunningDaemon, CalibratesTheDelayByTouchesAndRestoresItAfterARestart) {
  start();
  auto client = connect();
  ASSERT_TRUE(waitForLock(*client));
  const auto status = calibrate(*client);
  ASSERT_EQ(status.state, ProcedureState::proposed) << status.refusal;

  const auto results = ask<messages::ListResults>(*client).results;
  ASSERT_EQ(results.size(), 1U);
  EXPECT_EQ(results[0].id, status.result_id);
  EXPECT_EQ(results[0].state, messages::ResultState::proposed);
  const auto& tau = results[0].values.front();
  ASSERT_EQ(tau.key, "tau_s");
  const auto& delays = descriptions.world->delays;
  const double truth = delays.tau_machine_s[0] - delays.tau_probe_s;
  EXPECT_GT(tau.sd, 1e-7);
  EXPECT_LT(tau.sd, 5e-5);
  EXPECT_LT(std::abs(tau.value - truth), 5 * tau.sd);

  EXPECT_FALSE(ask<messages::Corrections>(*client).delay_calibrated);  // a result changes nothing by itself
  ask<messages::AcceptResult>(*client, {.id = status.result_id, .by = "somebody"});
  ASSERT_TRUE(eventually(*client, [&] { return ask<messages::Corrections>(*client).delay_calibrated; }));
  EXPECT_EQ(ask<messages::Corrections>(*client).tau_s[2], tau.value);

  client.reset();
  daemon.reset();
  start();
  client = connect();
  ASSERT_TRUE(eventually(*client, [&] { return ask<messages::Corrections>(*client).delay_calibrated; }));
  EXPECT_EQ(ask<messages::Corrections>(*client).tau_s[0], tau.value);
  EXPECT_FALSE(ask<messages::Corrections>(*client).valid);  // nothing is summed, so nothing may be used
}

struct Balances : link::StreamListener {
  void onBlock(const link::DecodedBlock& block) override { samples += block.header.count; }
  void onHeartbeat(const messages::Heartbeat&, const std::optional<link::Balance>& balance) override {
    if (!balance) return;
    ++heartbeats;
    exact += balance->exact ? 1 : 0;
  }
  std::uint64_t samples{};
  int heartbeats{};
  int exact{};
};

TEST_F(RunningDaemon, StreamsSamplesWithALedgerThatBalancesAtEveryHeartbeat) {
  start();
  Balances balances;
  auto client = connect(&balances);
  ASSERT_TRUE(waitForLock(*client));
  client->start({});
  ASSERT_TRUE(eventually(*client, [&] { return balances.heartbeats > 20 && balances.samples > 2000; }));
  const auto closing = client->finish(link::patience(20s));
  ASSERT_TRUE(closing) << closing.error().what;
  EXPECT_TRUE(closing->exact);
  EXPECT_EQ(closing->account.total(), closing->produced);
  EXPECT_EQ(balances.exact, balances.heartbeats);
}

TEST_F(RunningDaemon, RefusesWithAReasonWhatServiceTomlDoesNotAllow) {
  options.config = folder / "config";
  std::filesystem::create_directories(options.config);
  std::ofstream{options.config / "service.toml"} << "links = []\ncnc = []\n[access]\n[stream]\n";
  start();
  auto client = connect();
  ASSERT_TRUE(waitForLock(*client));
  const auto refused = client->request<messages::StartProcedure>({.method = "delay-multi-speed"}, link::patience(20s));
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, messages::ErrorCode::not_permitted);
  EXPECT_THAT(refused.error().what, testing::HasSubstr("allow_calibrate"));
}

TEST_F(RunningDaemon, RefusesAMethodThatItDoesNotHaveAndNamesThoseItHas) {
  start();
  auto client = connect();
  const auto refused = client->request<messages::StartProcedure>({.method = "delay-by-guess"}, link::patience(20s));
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, messages::ErrorCode::not_found);
  EXPECT_THAT(refused.error().what, testing::HasSubstr("delay-multi-speed"));
}

}  // namespace
}  // namespace probebox::app
