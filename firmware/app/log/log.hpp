#pragma once
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "protocol/units/time.hpp"

namespace probebox::app {

// Lines to stderr, with the priority prefix that the journal understands when it is the one that reads. Not for the
// tick path.
void logInfo(std::string_view text);
void logWarning(std::string_view text);
void logError(std::string_view text);

// Written by the caller itself, past what waits for the worker: for the case that the worker stands still.
void logErrorAtOnce(std::string_view text);

void leaveLogToWorker();
void drainLog();
// At the end: what waits is written, and later lines are written where they arise.
void writeLogHere();

// Warnings that somebody outside can cause without end: one line in `pause` at most; what was left out meanwhile is
// counted and said. One thread.
class LimitedWarning {
 public:
  // say: writes one line; logWarning() but in tests.
  explicit LimitedWarning(Nanoseconds pause, std::function<void(std::string_view)> say = logWarning)
      : pause_{pause}, say_{std::move(say)} {}

  void warn(MonoTime now, std::string_view text);
  // Says what was left out once the pause is over. To be called now and then.
  void look(MonoTime now);

 private:
  Nanoseconds pause_;
  std::function<void(std::string_view)> say_;
  std::optional<MonoTime> said_;
  std::uint64_t left_out_{};
  std::string last_left_out_;
};

}  // namespace probebox::app
