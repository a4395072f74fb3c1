#include "host-tests/campaign/runner.hpp"

#include <algorithm>
#include <array>
#include <csignal>
#include <cstring>
#include <poll.h>
#include <stdexcept>
#include <sys/wait.h>
#include <unistd.h>
#include <utility>

#include "firmware/app/log/log.hpp"
#include "host-tests/support/temporary_folder.hpp"

namespace probebox::campaign {
namespace {

using Clock = std::chrono::steady_clock;

void send(int descriptor, std::string_view text) {
  while (!text.empty()) {
    const auto sent = ::write(descriptor, text.data(), text.size());
    if (sent <= 0) return;
    text.remove_prefix(static_cast<std::size_t>(sent));
  }
}

[[noreturn]] void performAndSend(const Play& play, const Rules& rules, int descriptor) {
  // A box under faults logs every one of them.
  [[maybe_unused]] const auto* const silenced = std::freopen("/dev/null", "w", stderr);
  {
    const support::TemporaryFolder folder;
    send(descriptor, toJson(Stage{play, folder.path(), rules}.run()));
  }
  ::_exit(0);
}

}  // namespace

Runner::~Runner() {
  for (const auto& each : running_) {
    ::kill(each.process, SIGKILL);
    ::waitpid(each.process, nullptr, 0);
    ::close(each.answer);
  }
}

void Runner::start(Play play) {
  std::array<int, 2> ends{};
  if (::pipe(ends.data()) != 0) throw std::runtime_error{std::string{"No pipe: "} + std::strerror(errno)};
  const pid_t process = ::fork();
  if (process < 0) throw std::runtime_error{std::string{"No process: "} + std::strerror(errno)};
  if (process == 0) {
    ::close(ends[0]);
    performAndSend(play, rules_, ends[1]);
  }
  ::close(ends[1]);
  running_.push_back(
      {.play = std::move(play), .process = process, .answer = ends[0], .text = {}, .since = Clock::now()});
}

Runner::Done Runner::next() {
  while (true) {
    std::vector<pollfd> waiting;
    for (const auto& each : running_) waiting.push_back({.fd = each.answer, .events = POLLIN, .revents = 0});
    ::poll(waiting.data(), waiting.size(), 1000);
    for (std::size_t i = 0; i < running_.size(); ++i) {
      auto& each = running_[i];
      const bool hangs = Clock::now() - each.since > kPatience;
      if (hangs) ::kill(each.process, SIGKILL);
      if ((waiting[i].revents & (POLLIN | POLLHUP)) == 0 && !hangs) continue;
      std::array<char, 4096> bytes{};
      const auto count = ::read(each.answer, bytes.data(), bytes.size());
      if (count > 0) {
        each.text.append(bytes.data(), static_cast<std::size_t>(count));
        continue;
      }
      int status = 0;
      ::waitpid(each.process, &status, 0);
      ::close(each.answer);
      Done done{.play = each.play, .verdict = verdictOf(each, status)};
      running_.erase(running_.begin() + static_cast<std::ptrdiff_t>(i));
      return done;
    }
  }
}

Verdict Runner::verdictOf(const Running& ended, int status) {
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) {
    if (const auto verdict = verdictFrom(ended.text)) return *verdict;
  }
  const std::string how = WIFSIGNALED(status) ? std::string{"died of "} + ::strsignal(WTERMSIG(status))
                                              : "ended with status " + std::to_string(WEXITSTATUS(status));
  Verdict verdict;
  verdict.tally.plays = 1;
  verdict.violation = Violation{.at = ended.play.length, .what = "the process of the box " + how};
  return verdict;
}

Verdict perform(const Play& play, const Rules& rules) {
  Runner runner{rules};
  runner.start(play);
  return runner.next().verdict;
}

// Delta debugging (Zeller and Hildebrandt 2002): leave out ever smaller parts for as long as a violation is left.
Shrunk shrink(const Play& play, const Verdict& of, std::size_t most_attempts, const Rules& rules,
              const std::function<void(std::size_t)>& attempt) {
  Shrunk best{.play = play, .verdict = of};
  const auto cut = [](Play& shorter, Nanoseconds at) {
    shorter.length = std::min(shorter.length, at + std::chrono::seconds{1});
    std::erase_if(shorter.acts, [&](const Act& act) { return act.at > shorter.length; });
  };
  cut(best.play, of.violation->at);
  for (std::size_t part = std::max<std::size_t>(1, best.play.acts.size() / 2); part > 0 && most_attempts > 0;) {
    bool shorter_found = false;
    for (std::size_t from = 0; from < best.play.acts.size() && most_attempts > 0;) {
      auto candidate = best.play;
      const auto first = candidate.acts.begin() + static_cast<std::ptrdiff_t>(from);
      const auto count = std::min(part, candidate.acts.size() - from);
      candidate.acts.erase(first, first + static_cast<std::ptrdiff_t>(count));
      --most_attempts;
      if (attempt) attempt(candidate.acts.size());
      const auto verdict = perform(candidate, rules);
      if (!verdict.violation) {
        from += part;
        continue;
      }
      cut(candidate, verdict.violation->at);
      best = {.play = std::move(candidate), .verdict = verdict};
      shorter_found = true;
    }
    if (!shorter_found || part > best.play.acts.size())
      part = part == 1 && !shorter_found ? 0 : std::max<std::size_t>(1, part / 2);
  }
  return best;
}

}  // namespace probebox::campaign
