#pragma once
#include <bit>
#include <cstddef>
#include <vector>

#include "protocol/units/time.hpp"

namespace probebox::latch {

// Ring of the latest stamped values of one source, oldest first. Values leave it when samples have passed them.
// Allocates in the constructor only.
template <class Value>
class Trace {
 public:
  struct Point {
    MonoTime at{};
    Value value{};
  };

  // least: minimum capacity, rounded up to a power of two.
  explicit Trace(std::size_t least) : points_(std::bit_ceil(least)) {}

  bool empty() const { return count_ == 0; }
  bool full() const { return count_ == points_.size(); }
  std::size_t size() const { return count_; }
  const Point& operator[](std::size_t i) const { return points_[wrapped(first_ + i)]; }
  const Point& front() const { return points_[first_]; }
  const Point& back() const { return (*this)[count_ - 1]; }

  // The caller must make room first.
  void push(const Point& point) { points_[wrapped(first_ + count_++)] = point; }
  // Inserts a point in order of time; points with equal times keep their order of arrival.
  void insert(const Point& point) {
    std::size_t place = count_++;
    for (; place > 0 && (*this)[place - 1].at > point.at; --place) at(place) = at(place - 1);
    at(place) = point;
  }
  // Shifts every point in time.
  void shift(Nanoseconds by) {
    for (std::size_t i = 0; i < count_; ++i) at(i).at += by;
  }
  void pop() { first_ = wrapped(first_ + 1), --count_; }

 private:
  std::size_t wrapped(std::size_t i) const { return i & (points_.size() - 1); }
  Point& at(std::size_t i) { return points_[wrapped(first_ + i)]; }

  std::vector<Point> points_;
  std::size_t first_{};
  std::size_t count_{};
};

}  // namespace probebox::latch
