#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

#include "protocol/units/time.hpp"

namespace probebox::latch {

// The last stamped values of one source, oldest first, of which the oldest ones fall out as samples pass them.
template <class Value, std::size_t kCapacity>
class Trace {
 public:
  struct Point {
    MonoTime at{};
    Value value{};
  };

  bool empty() const { return count_ == 0; }
  bool full() const { return count_ == kCapacity; }
  std::size_t size() const { return count_; }
  const Point& operator[](std::size_t i) const { return points_[(first_ + i) % kCapacity]; }
  const Point& front() const { return points_[first_]; }
  const Point& back() const { return (*this)[count_ - 1]; }

  // The caller makes room first.
  void push(const Point& point) { points_[(first_ + count_++) % kCapacity] = point; }
  // The same for points of several sources: keeps the order of time, and of arrival at equal times.
  void insert(const Point& point) {
    std::size_t place = count_++;
    for (; place > 0 && (*this)[place - 1].at > point.at; --place) at(place) = at(place - 1);
    at(place) = point;
  }
  // Moves every point in time.
  void shift(Nanoseconds by) {
    for (std::size_t i = 0; i < count_; ++i) at(i).at += by;
  }
  void pop() { first_ = (first_ + 1) % kCapacity, --count_; }

 private:
  Point& at(std::size_t i) { return points_[(first_ + i) % kCapacity]; }

  std::array<Point, kCapacity> points_{};
  std::size_t first_{};
  std::size_t count_{};
};

}  // namespace probebox::latch
