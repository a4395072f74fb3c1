#include "firmware/app/threads/event_queue.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <utility>
#include <variant>

namespace probebox::app {
namespace {

// Before each event stands its number in the variant. Both are multiples of this, so none begins in the middle of
// another.
constexpr std::size_t kAlign = alignof(std::size_t);

constexpr std::size_t stored(std::size_t event_bytes) {
  return kAlign + (event_bytes + kAlign - 1) / kAlign * kAlign;
}

}  // namespace

EventQueue::EventQueue(std::size_t at_least_bytes)
    : capacity_{std::bit_ceil(std::max(at_least_bytes, stored(sizeof(Event))))},
      bytes_{std::make_unique<std::byte[]>(capacity_)} {}

bool EventQueue::push(const Event& event) {
  return std::visit(
      [&](const auto& alternative) {
        const std::size_t tail = tail_.load(std::memory_order_relaxed);
        const std::size_t size = stored(sizeof(alternative));
        if (tail + size - head_seen_ > capacity_) {
          head_seen_ = head_.load(std::memory_order_acquire);
          if (tail + size - head_seen_ > capacity_) return false;
        }
        const std::size_t number = event.index();
        write(tail, &number, sizeof(number));
        write(tail + kAlign, &alternative, sizeof(alternative));
        pushed_.store(pushed_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
        tail_.store(tail + size, std::memory_order_release);
        return true;
      },
      event);
}

template <std::size_t Alternative>
std::size_t EventQueue::popAs(std::size_t position, Event& event) const {
  auto& alternative = event.emplace<Alternative>();
  read(position, &alternative, sizeof(alternative));
  return sizeof(alternative);
}

bool EventQueue::pop(Event& event) {
  const std::size_t head = head_.load(std::memory_order_relaxed);
  if (head == tail_seen_) {
    tail_seen_ = tail_.load(std::memory_order_acquire);
    if (head == tail_seen_) return false;
  }
  using Pop = std::size_t (EventQueue::*)(std::size_t, Event&) const;
  static constexpr auto kPops = []<std::size_t... Alternatives>(std::index_sequence<Alternatives...>) {
    return std::array<Pop, sizeof...(Alternatives)>{&EventQueue::popAs<Alternatives>...};
  }
  (std::make_index_sequence<std::variant_size_v<Event>>());
  std::size_t number = 0;
  read(head, &number, sizeof(number));
  const std::size_t size = (this->*kPops.at(number))(head + kAlign, event);
  popped_.store(popped_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
  head_.store(head + stored(size), std::memory_order_release);
  return true;
}

std::size_t EventQueue::size() const {
  const std::size_t popped = popped_.load(std::memory_order_relaxed);
  const std::size_t pushed = pushed_.load(std::memory_order_relaxed);
  return pushed > popped ? pushed - popped : 0;
}

void EventQueue::write(std::size_t position, const void* from, std::size_t count) {
  const std::size_t before_end = std::min(count, capacity_ - (position & (capacity_ - 1)));
  std::memcpy(at(position), from, before_end);
  std::memcpy(at(0), static_cast<const std::byte*>(from) + before_end, count - before_end);
}

void EventQueue::read(std::size_t position, void* into, std::size_t count) const {
  const std::size_t before_end = std::min(count, capacity_ - (position & (capacity_ - 1)));
  std::memcpy(into, at(position), before_end);
  std::memcpy(static_cast<std::byte*>(into) + before_end, at(0), count - before_end);
}

}  // namespace probebox::app
