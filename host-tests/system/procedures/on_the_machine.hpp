#pragma once
#include <gtest/gtest.h>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "firmware/app/wiring/daemon.hpp"
#include "host-tests/support/sanitized.hpp"
#include "in_process.hpp"
#include "runtime_directory.hpp"

namespace probebox::command {

using namespace std::chrono_literals;

// A daemon with the emulated machine, faster than real time, and the command that speaks to it.
class OnTheMachine : public testing::Test {
 protected:
  explicit OnTheMachine(double time_scale = support::kSanitized ? 10 : 20) : time_scale_{time_scale} {
    start([](board::Descriptions&) {});
  }
  // Anew, with descriptions that somebody has changed.
  void start(const auto& change) {
    app::Options options;
    daemon_.reset();
    options.state = directory_.file("state");
    options.links = {"tcp:127.0.0.1:0"};
    options.time_scale = time_scale_;
    options.solver = PROBEBOXD;
    auto descriptions = app::loadDescriptions(options);
    ASSERT_TRUE(descriptions) << descriptions.error().what;
    descriptions_ = *descriptions;
    change(descriptions_);
    auto daemon = app::Daemon::start(options, descriptions_);
    ASSERT_TRUE(daemon) << daemon.error().what;
    daemon_ = std::move(*daemon);
    for (int attempt = 0; attempt < 600 && !isReady(); ++attempt) std::this_thread::sleep_for(50ms);
    EXPECT_TRUE(isReady());
  }
  Finished box(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"-u", daemon_->uris().front()});
    return probebox(arguments);
  }
  // The clock is locked, and the control has homed its axes: a run in which they are homed ends.
  bool isReady() {
    return box({"status", "--json"}).out.find("\"locked\"") != std::string::npos &&
           box({"corrections", "--json"}).object()["referenced"] == true;
  }

  double time_scale_;
  RuntimeDirectory directory_;
  board::Descriptions descriptions_;
  std::unique_ptr<app::Daemon> daemon_;
};

}  // namespace probebox::command
