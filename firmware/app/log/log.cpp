#include "firmware/app/log/log.hpp"

#include <cstdio>
#include <cstdlib>
#include <deque>
#include <mutex>
#include <string>
#include <systemd/sd-daemon.h>
#include <utility>

#include "protocol/units/wording.hpp"

namespace probebox::app {
namespace {

constexpr std::size_t kMostLines = 200;

struct Waiting {
  std::mutex mutex;
  bool for_worker{};
  std::deque<std::string> lines;
  std::size_t dropped{};
};

Waiting& waiting() {
  static Waiting all;
  return all;
}

// systemd sets JOURNAL_STREAM for services whose stderr it reads; a person needs no prefix.
std::string lineOf(const char* priority, std::string_view text) {
  static const bool for_journal = std::getenv("JOURNAL_STREAM") != nullptr;
  std::string all;
  // Lines after the first are indented: no name in a text can look like a line of its own.
  for (const char* prefix = "probeboxd: ";; prefix = "probeboxd:   ") {
    const auto line = text.substr(0, text.find('\n'));
    all.append(for_journal ? priority : "").append(prefix).append(shown(line)).append("\n");
    if (line.size() == text.size()) return all;
    text.remove_prefix(line.size() + 1);
  }
}

void log(const char* priority, std::string_view text) {
  std::string line = lineOf(priority, text);
  {
    auto& all = waiting();
    const std::lock_guard lock{all.mutex};
    if (all.for_worker) {
      if (all.lines.size() < kMostLines) {
        all.lines.push_back(std::move(line));
      } else {
        ++all.dropped;
      }
      return;
    }
  }
  std::fputs(line.c_str(), stderr);
}

void leaveTo(bool worker) {
  auto& all = waiting();
  const std::lock_guard lock{all.mutex};
  all.for_worker = worker;
}

}  // namespace

void logInfo(std::string_view text) {
  log(SD_INFO, text);
}
void logWarning(std::string_view text) {
  log(SD_WARNING, text);
}
void logError(std::string_view text) {
  log(SD_ERR, text);
}

void logErrorAtOnce(std::string_view text) {
  std::fputs(lineOf(SD_ERR, text).c_str(), stderr);
}

void leaveLogToWorker() {
  leaveTo(true);
}

void drainLog() {
  std::deque<std::string> lines;
  std::size_t dropped = 0;
  {
    auto& all = waiting();
    const std::lock_guard lock{all.mutex};
    lines.swap(all.lines);
    dropped = std::exchange(all.dropped, 0);
  }
  if (dropped != 0) lines.push_back(lineOf(SD_WARNING, std::to_string(dropped) + " lines found no room in the log"));
  for (const auto& line : lines) std::fputs(line.c_str(), stderr);
}

void writeLogHere() {
  leaveTo(false);
  drainLog();
}

void LimitedWarning::warn(MonoTime now, std::string_view text) {
  look(now);
  if (said_ && now - *said_ < pause_) {
    ++left_out_;
    last_left_out_ = text;
    return;
  }
  said_ = now;
  say_(text);
}

void LimitedWarning::look(MonoTime now) {
  if (left_out_ == 0 || now - *said_ < pause_) return;
  said_ = now;
  say_(last_left_out_ + " (" + std::to_string(left_out_) + (left_out_ == 1 ? " line" : " lines") +
       " like this since the last one)");
  left_out_ = 0;
}

}  // namespace probebox::app
