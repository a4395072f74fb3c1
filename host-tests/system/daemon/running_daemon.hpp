#pragma once
#include <chrono>
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <memory>
#include <string>
#include <unistd.h>
#include <utility>
#include <vector>

#include "board/describe/sim_files.hpp"
#include "firmware/app/wiring/daemon.hpp"
#include "host-tests/host/test_host.hpp"
#include "host-tests/support/sanitized.hpp"

namespace probebox::app {

using namespace std::chrono_literals;
using support::Balances;
using support::TestHost;

// A daemon with the emulated machine in this process, and a host that speaks to it over TCP.
class RunningDaemon : public testing::Test {
 protected:
  RunningDaemon() {
    std::filesystem::create_directories(folder);
    setenv("PROBEBOX_RENDEZVOUS", folder.c_str(), 1);
    options.state = folder / "state";
    options.links = {"tcp:127.0.0.1:0"};
    options.time_scale = 4;
  }
  ~RunningDaemon() override {
    daemon.reset();
    std::filesystem::remove_all(folder);
  }

  void start(std::vector<PassedSocket> passed = {}) {
    auto loaded = loadDescriptions(options);
    ASSERT_TRUE(loaded) << loaded.error().what;
    descriptions = *loaded;
    auto started = Daemon::start(options, descriptions, std::move(passed));
    ASSERT_TRUE(started) << started.error().what;
    daemon = std::move(*started);
  }
  // For runs, which wait for the machine: four times as fast as the others where the computer can follow.
  void startForRuns() {
    if (!support::kSanitized) options.time_scale *= 4;
    start();
  }
  // The emulated board with one text exchanged for another.
  void overrule(const char* file, const std::string& from, const std::string& to) {
    options.config = folder / "config";
    std::filesystem::create_directories(options.config);
    std::string text{board::simFile(file)};
    const auto at = text.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    std::ofstream{options.config / file} << text.replace(at, from.size(), to);
  }
  std::unique_ptr<TestHost> connect(link::StreamListener* listener = nullptr) {
    return TestHost::connect(daemon->uris().front(), listener);
  }

  const std::filesystem::path folder =
      std::filesystem::path{testing::TempDir()} / ("probeboxd-" + std::to_string(getpid()));
  Options options;
  board::Descriptions descriptions;
  std::unique_ptr<Daemon> daemon;
};

}  // namespace probebox::app
