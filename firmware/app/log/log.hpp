#pragma once
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "protocol/units/time.hpp"

namespace probebox::app {

// Writes lines to stderr, with priority prefixes when the systemd journal reads them. Not for the tick path.
void logInfo(std::string_view text);
void logWarning(std::string_view text);
void logError(std::string_view text);

// Writes from the calling thread, ahead of lines that wait for the worker. For reports of a worker that hangs.
void logErrorAtOnce(std::string_view text);

void leaveLogToWorker();
void drainLog();
// At exit: writes waiting lines, and writes later ones directly.
void writeLogHere();

// Limits warnings that an outside cause can repeat without end to one line per `pause`; suppressed lines are counted
// and reported. One thread.
class LimitedWarning {
 public:
  // say: writes one line; tests replace it.
  explicit LimitedWarning(Nanoseconds pause, std::function<void(std::string_view)> say = logWarning)
      : pause_{pause}, say_{std::move(say)} {}

  void warn(MonoTime now, std::string_view text);
  // Reports suppressed lines once the pause is over. Call periodically.
  void look(MonoTime now);

 private:
  Nanoseconds pause_;
  std::function<void(std::string_view)> say_;
  std::optional<MonoTime> said_;
  std::uint64_t left_out_{};
  std::string last_left_out_;
};

}  // namespace probebox::app
