#pragma once
#include <algorithm>
#include <cstdint>
#include <gtest/gtest.h>
#include <memory>
#include <string>
#include <vector>

#include "box_process.hpp"
#include "gpio_sim.hpp"
#include "host-tests/host/test_host.hpp"
#include "line_holder.hpp"
#include "pulse_train.hpp"

namespace probebox::vm {

// Lines of board/vm, by their offsets.
inline constexpr const char* kChip = "probebox-vm";
inline constexpr unsigned kSync = 0;
inline constexpr unsigned kTouch = 1;
inline constexpr unsigned kOvertravel = 2;
inline constexpr unsigned kIndexX = 3;
inline constexpr unsigned kSkip = 4;
inline constexpr unsigned kLoopOut = 5;
inline constexpr unsigned kLoopIn = 6;
inline const std::vector<std::string> kLines{"", "TOUCH", "OVERTRAVEL", "INDEX_X", "", "LOOP_OUT", "LOOP_IN"};

inline constexpr const char* kUri = "tcp:127.0.0.1:7627";
inline constexpr std::chrono::milliseconds kTick{1};

// The whole daemon on board/vm, without privileges, and a host that speaks to it over TCP.
class BoxOnLines : public testing::Test {
 protected:
  static std::unique_ptr<GpioSim> plugged(std::vector<std::string> lines = kLines) {
    auto chip = std::make_unique<GpioSim>(kChip, std::move(lines));
    // A box at rest: what is active low is high.
    chip->drive(kOvertravel, true);
    chip->drive(kSkip, true);
    return chip;
  }
  std::unique_ptr<support::TestHost> connect(link::StreamListener* listener = nullptr) {
    return support::TestHost::connect(kUri, listener);
  }
  void start() {
    box.start();
    host = connect();
    ASSERT_TRUE(host) << box.log();
  }
  messages::Status::Answer status() { return host->ask<messages::Status>(); }
  // By its name in box.toml.
  messages::LineStatus line(const std::string& name) {
    for (const auto& line : status().lines) {
      if (line.name == name) return line;
    }
    ADD_FAILURE() << "no line " << name;
    return {};
  }
  std::string problemOf(const std::string& name) {
    for (const auto& source : status().sources) {
      if (source.name.find("(" + name + ")") != std::string::npos) return source.problem;
    }
    ADD_FAILURE() << "no source " << name;
    return {};
  }
  bool allIsWell() {
    const auto sources = status().sources;
    return std::all_of(sources.begin(), sources.end(), [](const auto& source) { return source.problem.empty(); });
  }
  int timesInLog(const std::string& text) {
    const auto log = box.log();
    int times = 0;
    for (auto at = log.find(text); at != std::string::npos; at = log.find(text, at + 1)) ++times;
    return times;
  }

  BoxProcess box{BOARD_VM};
  std::unique_ptr<support::TestHost> host;
};

}  // namespace probebox::vm
