#pragma once
#include <chrono>
#include <cstdint>
#include <functional>
#include <gtest/gtest.h>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "protocol/messages/control.hpp"
#include "tools/link/client.hpp"
#include "tools/link/wait.hpp"

namespace probebox::support {

// A host connected to the box under test, with the requests that tests share. Waits are generous: a test fails by the
// answers of the box, not by their time.
class TestHost {
 public:
  // uri: as for probebox, such as tcp:127.0.0.1:7627. Tries until the box answers; if it never does, the test fails and
  // the result is null.
  static std::unique_ptr<TestHost> connect(const std::string& uri, link::StreamListener* listener = nullptr);

  link::Client& client() { return *client_; }

  // Sends a request and returns its answer; the test fails without one.
  template <class Operation>
  typename Operation::Answer ask(const typename Operation::Request& request = {}) {
    auto answer = client_->request<Operation>(request, patience());
    EXPECT_TRUE(answer) << answer.error().what;
    return answer ? std::move(*answer) : typename Operation::Answer{};
  }
  // Sends a request that the box must refuse and returns the refusal.
  template <class Operation>
  link::Failure refusal(const typename Operation::Request& request = {}) {
    auto answer = client_->request<Operation>(request, patience());
    EXPECT_FALSE(answer);
    return answer ? link::Failure{} : answer.error();
  }

  // Ends the samples and returns the final balance of received and lost ones.
  link::Balance finish();
  // Serves the link for this time.
  void linger(std::chrono::milliseconds duration);
  // Serves the link until the condition holds; false after a generous time-out, or when the link is lost.
  bool eventually(const std::function<bool()>& is_so);
  bool waitForLock();
  // Starts delay-multi-speed and waits for its end, whatever that is.
  messages::ProcedureStatus::Answer calibrate();
  // calibrate(), which must succeed, and acceptance. The id of the result.
  std::uint64_t calibrateAndAccept();

 private:
  explicit TestHost(std::unique_ptr<link::Client> client) : client_{std::move(client)} {}
  static link::Wait patience() { return link::patience(std::chrono::seconds{20}); }

  std::unique_ptr<link::Client> client_;
};

// Counts the heartbeats whose ledger balances to the sample.
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

}  // namespace probebox::support
