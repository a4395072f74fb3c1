#include "drivers/gpio/quadrature_emulator.hpp"

#include <cmath>
#include <cstdlib>
#include <utility>

namespace probebox::gpio {

void EmulatedQuadrature::turnTo(std::int64_t count, MonoTime at) {
  const std::int64_t from = count_, steps = std::abs(count - from);
  const auto taken_ns = static_cast<double>((at - at_).count());
  for (std::int64_t step = 1; step <= steps; ++step) {
    count_ += count > from ? 1 : -1;
    const auto when =
        at_ + Nanoseconds{std::llround(taken_ns * static_cast<double>(step) / static_cast<double>(steps))};
    // Up is A high, B high, A low, B low.
    const auto quarter = count_ & 3;
    const std::size_t a = exchanged_ ? 1 : 0;
    drive(a, quarter == 1 || quarter == 2, when);
    drive(1 - a, quarter == 2 || quarter == 3, when);
  }
  at_ = at;
}

Edge EmulatedQuadrature::edgeOf(std::size_t line, MonoTime at) const {
  return {LineRole::trigger, static_cast<std::uint8_t>(line), high_.at(line) ? Level::active : Level::inactive,
          sequence_.at(line), at};
}

void EmulatedQuadrature::drive(std::size_t line, bool high, MonoTime at) {
  if (std::exchange(high_.at(line), high) == high || !is_connected_) return;
  if (to_hide_ > 0) {
    --to_hide_;
    return;
  }
  ++sequence_.at(line);
  if (queue_.size() == most_edges_) {
    queue_.pop_front();
    ++lost_edges_;
  }
  queue_.push_back(edgeOf(line, at));
}

void EmulatedQuadrature::disconnect() {
  is_connected_ = false;
  loss_unreported_ = true;
  queue_.clear();
}

std::size_t EmulatedQuadrature::read(std::span<Event> into, MonoTime now) {
  std::size_t count = 0;
  if (loss_unreported_ && count < into.size()) {
    loss_unreported_ = false;
    into[count++] = SourceLost{Source::trigger, LossReason::disconnected, 0, now};
  }
  if (levels_unreported_ && is_connected_ && count + 2 <= into.size()) {
    levels_unreported_ = false;
    // Those before the edges that wait.
    auto before = *this;
    for (auto edge = queue_.rbegin(); edge != queue_.rend(); ++edge) {
      before.high_.at(edge->line) = edge->level != Level::active;
      before.sequence_.at(edge->line) = edge->line_sequence - 1;
    }
    const MonoTime at = queue_.empty() ? now : std::min(now, queue_.front().at);
    for (const std::size_t line : {0U, 1U}) into[count++] = before.edgeOf(line, at);
  }
  while (count < into.size() && !queue_.empty() && queue_.front().at <= now) {
    into[count++] = queue_.front();
    queue_.pop_front();
  }
  return count;
}

}  // namespace probebox::gpio
