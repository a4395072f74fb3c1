#include "drivers/world/index_lines.hpp"

#include <algorithm>
#include <cmath>

namespace probebox::world {
namespace {

constexpr Nanoseconds kStep = std::chrono::milliseconds{1};

// On which side of its mark an encoder was.
class Side {
 public:
  Side(const Machine& machine, const Screws& screws, std::size_t axis, double mark_mm)
      : machine_{machine}, screws_{screws}, axis_{axis}, mark_mm_{mark_mm} {}

  bool below(MonoTime at) const {
    return screws_.motorPosition_mm(axis_, machine_.positionAt(at)[axis_], at) < mark_mm_;
  }
  // When it changed between two times, to a nanosecond.
  MonoTime changed(MonoTime before, MonoTime after) const {
    const bool was_below = below(before);
    while (after - before > Nanoseconds{1}) {
      const MonoTime middle = before + (after - before) / 2;
      (below(middle) == was_below ? before : after) = middle;
    }
    return after;
  }

 private:
  const Machine& machine_;
  const Screws& screws_;
  std::size_t axis_;
  double mark_mm_;
};

}  // namespace

IndexLines::IndexLines(const Config& config)
    : lateness_{std::llround(1e9 * config.delays.tau_probe_s + 1e3 * config.clock.bias_us)}, searched_{config.start} {
  for (std::size_t axis = 0; axis < fitted_.size(); ++axis) {
    fitted_[axis] = config.machine.axes[axis].reference.has_index;
    mark_mm_[axis] = config.machine.axes[axis].reference.index_mm;
  }
}

void IndexLines::prepare(MonoTime now, const Machine& machine, const Screws& screws) {
  for (; searched_ + lateness_ + kStep <= now; searched_ += kStep) {
    for (std::size_t axis = 0; axis < fitted_.size(); ++axis) {
      if (!fitted_[axis]) continue;
      const MonoTime until = searched_ + kStep;
      const Side side{machine, screws, axis, mark_mm_[axis]};
      if (side.below(searched_) != side.below(until)) insert({axis, side.changed(searched_, until) + lateness_});
    }
  }
}

// In the order of time; a machine cannot pass more marks than there is room for within a step.
void IndexLines::insert(const Pass& pass) {
  std::size_t place = end_++;
  for (; place > first_ && passes_[(place - 1) % kWaiting].at > pass.at; --place)
    passes_[place % kWaiting] = passes_[(place - 1) % kWaiting];
  passes_[place % kWaiting] = pass;
}

bool IndexLines::take(Event& event, Ledger& ledger) {
  const Pass& pass = passes_[first_++ % kWaiting];
  event = Edge{LineRole::index, static_cast<std::uint8_t>(pass.axis), Level::active, ++edges_[pass.axis], pass.at};
  ++ledger.index_edges;
  return true;
}

}  // namespace probebox::world
