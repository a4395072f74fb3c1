#pragma once
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <mutex>
#include <string>

namespace probebox::view {

// Queues server-sent events for the pages. A page that falls behind loses the oldest.
class EventLog {
 public:
  static constexpr std::size_t kMost = 400;

  void put(const std::string& kind, const std::string& json) {
    const std::lock_guard lock{mutex_};
    events_.push_back("id: " + std::to_string(next_) + "\nevent: " + kind + "\ndata: " + json + "\n\n");
    ++next_;
    if (events_.size() > kMost) events_.pop_front();
    changed_.notify_all();
  }
  std::uint64_t next() const {
    const std::lock_guard lock{mutex_};
    return next_;
  }
  // Returns the events since number `from` and advances it. Waits up to 0.5 s for the first one; empty if none came.
  std::string since(std::uint64_t& from) {
    std::unique_lock lock{mutex_};
    if (from > next_) from = 0;  // of another run
    changed_.wait_for(lock, std::chrono::milliseconds{500}, [&] { return next_ > from || ended_; });
    const auto oldest = next_ - events_.size();
    if (from < oldest) from = oldest;
    std::string all;
    for (; from < next_; ++from) all += events_[static_cast<std::size_t>(from - oldest)];
    return all;
  }
  void end() {
    const std::lock_guard lock{mutex_};
    ended_ = true;
    changed_.notify_all();
  }
  bool ended() const {
    const std::lock_guard lock{mutex_};
    return ended_;
  }

 private:
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::string> events_;
  std::uint64_t next_{};
  bool ended_{};
};

}  // namespace probebox::view
