#pragma once
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <map>
#include <mutex>
#include <string>
#include <utility>

namespace probebox::view {

// Queues server-sent events for the pages. A page that falls behind loses the oldest, but of what holds until the next
// one of its kind (Lasts::until_next) it is told the newest, whenever that was.
class EventLog {
 public:
  static constexpr std::size_t kMost = 400;

  enum class Lasts { a_moment, until_next };

  void put(const std::string& kind, const std::string& json, Lasts lasts = Lasts::a_moment) {
    const std::lock_guard lock{mutex_};
    auto event = "id: " + std::to_string(next_) + "\nevent: " + kind + "\ndata: " + json + "\n\n";
    if (lasts == Lasts::until_next) lasting_[kind] = {next_, event};
    events_.push_back(std::move(event));
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
    std::string all;
    if (from < oldest) {
      all = lastingBetween(from, oldest);
      from = oldest;
    }
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
  struct Numbered {
    std::uint64_t number{};
    std::string event;
  };

  std::string lastingBetween(std::uint64_t from, std::uint64_t end) const {
    std::map<std::uint64_t, std::string> in_order;
    for (const auto& [kind, one] : lasting_)
      if (one.number >= from && one.number < end) in_order.emplace(one.number, one.event);
    std::string all;
    for (const auto& [number, event] : in_order) all += event;
    return all;
  }

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::string> events_;
  std::map<std::string, Numbered> lasting_;  // by kind
  std::uint64_t next_{};
  bool ended_{};
};

}  // namespace probebox::view
