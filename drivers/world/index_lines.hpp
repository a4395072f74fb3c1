#pragma once
#include <array>
#include <cstdint>

#include "drivers/world/config.hpp"
#include "drivers/world/machine.hpp"
#include "drivers/world/screws.hpp"
#include "drivers/world/truth.hpp"
#include "protocol/events/event.hpp"

namespace probebox::world {

// Emulates a reference mark on each encoder: its line becomes active when the axis passes it in either direction.
class IndexLines {
 public:
  explicit IndexLines(const Config& config);

  // Finds the passes up to `now`.
  void prepare(MonoTime now, const Machine& machine, const Screws& screws);
  MonoTime nextAt() const { return first_ == end_ ? MonoTime::max() : passes_[first_ % kWaiting].at; }
  bool take(Event& event, Ledger& ledger);

 private:
  static constexpr std::size_t kWaiting = 64;
  struct Pass {
    std::size_t axis{};
    MonoTime at{};
  };

  void insert(const Pass& pass);

  std::array<bool, 3> fitted_{};
  std::array<double, 3> mark_mm_{};
  Nanoseconds lateness_;
  MonoTime searched_;
  std::array<std::uint32_t, 3> edges_{};
  std::array<Pass, kWaiting> passes_{};
  std::size_t first_{}, end_{};
};

}  // namespace probebox::world
