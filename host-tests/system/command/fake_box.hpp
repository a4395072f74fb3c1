#pragma once
#include <atomic>
#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "drivers/io/byte_pipe.hpp"
#include "protocol/messages/types.hpp"

namespace probebox::command {

struct FakeReply {
  messages::ErrorCode code{};
  std::string text;
  std::vector<std::byte> body;
};

// How the box of a test behaves.
struct FakeBoxOptions {
  bool refuses_run{};        // the calibration ends in a refusal
  bool busy{};               // no calibration can be started
  bool forbids_accepting{};  // accepting over a link is off
  bool by_hand{};            // steps wait for markers
  bool cut_is_on{};          // nothing comes into force
  bool loses_at_source{true};
  bool triggers{};                     // one every fourth block; each seventh is lost on its way to the links
  bool unlocked{};                     // its master clock
  bool joined{};                       // it has a loop-back
  std::uint32_t lost_pulses{};         // of the loop-back, of 500 pulses
  bool only_looks{};                   // its runs give no result to accept
  bool at_another_run{};               // another host starts a run right after this one
  std::function<void()> when_asked{};  // to start a run, or about it
  bool endless{};                      // its lists repeat forever, always announcing more
  unsigned older_results{};            // stored ones with the ids 1, 2, ...
  double in_force_tau_s{};             // of a result in force before; 0: there is none
  double u_s{};                        // combined uncertainty of its results; 0: a box of before, which sends none
  bool refused_before{};               // its first run was refused
  bool line_inhibits{};                // an inhibit line of the box is active
  // Answers before the script does, which answers where this does not.
  std::function<std::optional<FakeReply>(messages::Operation, std::span<const std::byte>)> answers_first{};
};

// The next host that waits, or an empty connection.
using NextHost = std::function<io::Connection()>;

// A box in this process: the firmware's own session over real TCP or another carrier, with made-up samples and scripted
// answers. Its samples have no true rate: 50 for each round of its thread.
class FakeBox {
 public:
  explicit FakeBox(const FakeBoxOptions& options = {}, unsigned port = 0);
  FakeBox(const FakeBoxOptions& options, NextHost accept);
  ~FakeBox();
  FakeBox(const FakeBox&) = delete;
  FakeBox& operator=(const FakeBox&) = delete;

  std::string uri() const;  // over TCP
  unsigned port() const;
  bool calibrating() const;  // a run was started
  bool streaming() const;    // a host receives samples

  // Cuts every connection, as an unplugged cable would; the box goes on and can be reached again.
  void cut() { cut_ = true; }

  static constexpr unsigned kResultId = 4711;
  static constexpr double kTau_s = 5.4471e-3;
  static constexpr double kSd_s = 5.0e-6;

 private:
  class Loop;
  void run();

  unsigned port_{};
  std::unique_ptr<Loop> loop_;
  std::atomic<bool> cut_{};
  std::jthread thread_;
};

}  // namespace probebox::command
