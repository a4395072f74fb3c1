#pragma once
#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <sys/types.h>
#include <vector>

#include "host-tests/campaign/stage.hpp"

namespace probebox::campaign {

// Performs plays in processes of their own, so that a crash or a hang is a finding like any other.
class Runner {
 public:
  // A play that takes longer than this in real time counts as hanging.
  static constexpr std::chrono::seconds kPatience{600};

  struct Done {
    Play play;
    Verdict verdict;
  };

  explicit Runner(const Rules& rules = {}) : rules_{rules} {}
  ~Runner();
  Runner(const Runner&) = delete;
  Runner& operator=(const Runner&) = delete;

  void start(Play play);
  std::size_t running() const { return running_.size(); }
  // Waits for the next play that ends.
  Done next();

 private:
  struct Running {
    Play play;
    pid_t process{};
    int answer{-1};  // read end of a pipe
    std::string text;
    std::chrono::steady_clock::time_point since;
  };
  static Verdict verdictOf(const Running& ended, int status);

  Rules rules_;
  std::vector<Running> running_;
};

Verdict perform(const Play& play, const Rules& rules = {});

// The shortest play with a violation that was found by omitting acts, within so many attempts. of: its verdict.
// attempt: called with the number of remaining acts.
struct Shrunk {
  Play play;
  Verdict verdict;
};
Shrunk shrink(const Play& play, const Verdict& of, std::size_t most_attempts, const Rules& rules = {},
              const std::function<void(std::size_t)>& attempt = {});

}  // namespace probebox::campaign
