#include "firmware/app/threads/capture_thread.hpp"

#include <algorithm>
#include <array>
#include <pthread.h>
#include <utility>

#include "firmware/app/threads/real_time.hpp"

namespace probebox::app {
namespace {

constexpr std::size_t kBatch = 256;
constexpr int kBatchesInTurn = 64;
constexpr Nanoseconds kPoll = std::chrono::milliseconds{1};
// A slow emulated machine needs no more, and many of them share a computer.
constexpr Nanoseconds kLongestPoll = std::chrono::milliseconds{20};
// Later than this is late enough for a kernel buffer to fill up.
constexpr Nanoseconds kDeadline = std::chrono::milliseconds{50};

}  // namespace

CaptureThread::CaptureThread(std::vector<std::unique_ptr<io::EventSource>> sources, TimeSource& time, EventQueue& queue,
                             WakeUp& core, Counters& counters, SourceTable& table)
    : sources_{std::move(sources)},
      time_{time},
      queue_{queue},
      core_{core},
      counters_{counters},
      table_{table},
      told_(sources_.size()) {
  for (const auto& source : sources_) table_.add(source->name(), source->faultNames());
  waiting_.reserve(sources_.size());
  thread_ = std::thread{[this] { run(); }};
  pthread_setname_np(thread_.native_handle(), "capture");
}

CaptureThread::~CaptureThread() {
  stopping_ = true;
  thread_.join();
}

void CaptureThread::run() {
  askForRealTime();
  MonoTime last_said = time_.now();
  while (!stopping_) {
    waitForSources();
    // Read before the sources are: all they hold is at or before what is said next about time.
    const MonoTime now = time_.advance(queue_.isHalfFull());
    for (const auto& source : sources_) drain(*source, now);
    tellProblems();
    if (now - last_said >= kTimeAdvances) {
      if (time_.kernelDuration(now - last_said) > kDeadline) ++counters_.deadline_misses;
      push(TimeAdvanced{now}, now);
      last_said = now;
    }
    core_.notify();
    ++counters_.progress.capture;
  }
}

void CaptureThread::waitForSources() {
  waiting_.clear();
  for (const auto& source : sources_) {
    if (source->descriptor() >= 0) waiting_.push_back({source->descriptor(), POLLIN, 0});
  }
  const auto longest = std::clamp(time_.kernelDuration(kPoll), kPoll, kLongestPoll);
  poll(waiting_.data(), waiting_.size(), static_cast<int>(longest / std::chrono::milliseconds{1}));
}

void CaptureThread::drain(io::EventSource& source, MonoTime now) {
  std::array<Event, kBatch> batch;
  // Bounded: a line that chatters for ever must not starve the other sources, or time.
  for (int turn = 0; turn < kBatchesInTurn; ++turn) {
    const std::size_t count = source.read(batch, now);
    if (count == 0) return;
    for (std::size_t i = 0; i < count; ++i) push(batch[i], now);
  }
}

void CaptureThread::push(const Event& event, MonoTime now) {
  const bool has_room = dropped_.report([this](const Event& earlier) { return queue_.push(earlier); }, now);
  if (!(has_room && queue_.push(event)) && !dropped_.keep(event)) ++counters_.queue_lost_events;
  const auto filled = static_cast<std::uint32_t>(queue_.size());
  if (filled > counters_.queue_high_water) counters_.queue_high_water = filled;
}

void CaptureThread::tellProblems() {
  for (std::size_t i = 0; i < sources_.size(); ++i) {
    const auto& source = *sources_[i];
    auto& [problem, faults, unusable] = told_[i];
    if (source.problem() != problem) {
      problem = source.problem();
      table_.tell(i, problem);
    }
    if (source.faults() != faults) {
      faults = source.faults();
      table_.tellFaults(i, faults);
    }
    if (source.unusable() != unusable) {
      unusable = source.unusable();
      table_.tellUnusable(i, unusable);
    }
  }
}

}  // namespace probebox::app
