#pragma once
#include <cstdint>

#include "protocol/units/time.hpp"

namespace probebox::counter {

// Unwraps counts. Each step is taken as the shorter of the two possible ones, so it must be less than half the range;
// after `longest_unread` an axis may have moved further.
class Unwrap {
 public:
  struct Count {
    std::int64_t counts{};
    bool goes_on{};  // continues the last count; false for the first, and for one that came too late to be unwrapped
  };

  // range: number of values of the count; 0 for 2^64.
  Unwrap(std::uint64_t range, Nanoseconds longest_unread) : range_{range}, longest_unread_{longest_unread} {}

  // A count that does not continue the last one is taken unchanged.
  Count push(std::uint64_t raw, MonoTime at) {
    const std::uint64_t value = range_ == 0 ? raw : raw % range_;
    const bool goes_on = has_last_ && at - at_ <= longest_unread_;
    count_ = static_cast<std::int64_t>(goes_on ? static_cast<std::uint64_t>(count_) + shorterWay(value) : value);
    has_last_ = true;
    at_ = at;
    value_ = value;
    return {count_, goes_on};
  }
  bool hasLast() const { return has_last_; }

 private:
  // The shorter step modulo 2^64: a negative one is a large number.
  std::uint64_t shorterWay(std::uint64_t value) const {
    const std::uint64_t up = value >= value_ || range_ == 0 ? value - value_ : range_ - (value_ - value);
    return range_ != 0 && up > range_ / 2 ? up - range_ : up;
  }

  std::uint64_t range_;
  Nanoseconds longest_unread_;
  bool has_last_{};
  std::uint64_t value_{};
  std::int64_t count_{};
  MonoTime at_{};
};

}  // namespace probebox::counter
