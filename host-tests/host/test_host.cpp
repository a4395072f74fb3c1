#include "host-tests/host/test_host.hpp"

#include <thread>

#include "tools/link/uri.hpp"

namespace probebox::support {
namespace {

using namespace std::chrono_literals;

}  // namespace

std::unique_ptr<TestHost> TestHost::connect(const std::string& uri, link::StreamListener* listener) {
  const auto parsed = link::parseUri(uri);
  EXPECT_TRUE(parsed) << parsed.error().what;
  for (int attempt = 0; parsed && attempt < 400; ++attempt) {
    if (auto connection = link::open(*parsed, 1s)) {
      auto client = std::make_unique<link::Client>(std::move(*connection), link::ClientOptions{}, listener);
      if (client->connect(patience())) return std::unique_ptr<TestHost>{new TestHost{std::move(client)}};
    }
    std::this_thread::sleep_for(50ms);
  }
  ADD_FAILURE() << "no box at " << uri;
  return nullptr;
}

link::Balance TestHost::finish() {
  const auto closing = client_->finish(patience());
  EXPECT_TRUE(closing) << closing.error().what;
  return closing ? *closing : link::Balance{};
}

void TestHost::linger(std::chrono::milliseconds duration) {
  const auto wait = link::patience(duration);
  while (client_->round(wait)) {
  }
}

bool TestHost::eventually(const std::function<bool()>& is_so) {
  const auto end = std::chrono::steady_clock::now() + 240s;
  while (!is_so()) {
    if (std::chrono::steady_clock::now() > end || client_->state() == link::LinkState::lost) return false;
    linger(50ms);
  }
  return true;
}

bool TestHost::waitForLock() {
  return eventually([&] { return ask<messages::Status>().clock.state == ClockState::locked; });
}

messages::ProcedureStatus::Answer TestHost::calibrate() {
  const auto run = ask<messages::StartProcedure>({.method = "delay-multi-speed"}).run;
  messages::ProcedureStatus::Answer status;
  EXPECT_TRUE(eventually([&] {
    status = ask<messages::ProcedureStatus>();
    return status.run == run && status.state >= RunState::proposed;
  })) << "state "
      << messages::nameOf(status.state) << ", " << status.prompt;
  return status;
}

std::uint64_t TestHost::calibrateAndAccept() {
  const auto status = calibrate();
  EXPECT_EQ(status.state, RunState::proposed) << status.refusal;
  ask<messages::AcceptResult>({.id = status.result_id, .by = "somebody"});
  return status.result_id;
}

}  // namespace probebox::support
