#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <vector>

#include "protocol/units/time.hpp"

namespace probebox::command {

// Keeps the extremes of a channel over the last 10 s in slots of 0.1 s, so that a peak between two frames still shows.
class PeakHistory {
 public:
  static constexpr std::int64_t kSlot_ns = 100'000'000;
  static constexpr std::size_t kSlots = 100;
  struct Extent {
    double low{};
    double high{};
    bool any{};
  };

  void add(MonoTime at, double value) {
    const auto slot = toNs(at) / kSlot_ns;
    if (!slots_.empty() && slot < slots_.back().number) slots_.clear();  // the box was restarted
    if (slots_.empty() || slot > slots_.back().number) slots_.push_back({slot, {value, value, true}});
    auto& extent = slots_.back().extent;
    extent.low = std::min(extent.low, value);
    extent.high = std::max(extent.high, value);
    while (slots_.front().number + static_cast<std::int64_t>(kSlots) <= slot) slots_.pop_front();
  }

  // Returns the 10 s in `count` columns, the newest last.
  std::vector<Extent> columns(std::size_t count) const {
    std::vector<Extent> all(count);
    if (slots_.empty() || count == 0) return all;
    const auto begin = slots_.back().number - static_cast<std::int64_t>(kSlots) + 1;
    for (const auto& [number, extent] : slots_) {
      // A slot that is wider than a column fills all that it covers.
      const auto at = static_cast<std::size_t>(number - begin);
      const auto first = at * count / kSlots;
      const auto last = std::max(first, ((at + 1) * count + kSlots - 1) / kSlots - 1);
      for (auto k = first; k <= last && k < count; ++k) {
        auto& column = all[k];
        column =
            column.any ? Extent{std::min(column.low, extent.low), std::max(column.high, extent.high), true} : extent;
      }
    }
    return all;
  }

  // The largest magnitude in the 10 s.
  double peak() const {
    double most = 0;
    for (const auto& [number, extent] : slots_) most = std::max({most, -extent.low, extent.high});
    return most;
  }
  void clear() { slots_.clear(); }

 private:
  struct Slot {
    std::int64_t number{};
    Extent extent;
  };
  std::deque<Slot> slots_;
};

}  // namespace probebox::command
