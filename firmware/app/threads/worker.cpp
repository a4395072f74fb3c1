#include "firmware/app/threads/worker.hpp"

#include <algorithm>
#include <chrono>
#include <pthread.h>
#include <utility>

namespace probebox::app {
namespace {

constexpr std::size_t kMostJobs = 256;
constexpr std::chrono::milliseconds kNowAndThen{100};

}  // namespace

Worker::Worker(std::function<void()> on_wake) : on_wake_{std::move(on_wake)}, thread_{[this] { run(); }} {
  pthread_setname_np(thread_.native_handle(), "worker");
}

void Worker::stop() {
  if (!thread_.joinable()) return;
  stopping_ = true;
  wake_up_.notify();
  thread_.join();
}

bool Worker::post(std::function<void()> job, Rank rank) {
  {
    const std::lock_guard lock{mutex_};
    auto& into = jobs_[static_cast<std::size_t>(rank)];
    if (into.size() >= kMostJobs) return false;
    into.push_back(std::move(job));
  }
  wake_up_.notify();
  return true;
}

std::function<void()> Worker::take() {
  const std::lock_guard lock{mutex_};
  const auto from = std::ranges::find_if_not(jobs_, &Jobs::empty);
  if (from == jobs_.end()) return {};
  auto job = std::move(from->front());
  from->pop_front();
  return job;
}

void Worker::run() {
  for (bool last = false; !last;) {
    // Read before the round: what was posted before stopping is still done.
    last = stopping_;
    if (!last) wake_up_.wait(kNowAndThen, also_);
    on_wake_();
    while (const auto job = take()) {
      job();
      on_wake_();
    }
  }
}

}  // namespace probebox::app
