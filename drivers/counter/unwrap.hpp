#pragma once
#include <cstdint>

#include "protocol/units/time.hpp"

namespace probebox::counter {

// Continues counts that wrap. The way from one count to the next is the shorter one, so it must be less than half the
// range; after `longest_unread` an axis may have gone further.
class Unwrap {
 public:
  struct Count {
    std::int64_t counts{};
    bool goes_on{};  // from the last one; false for the first, and for one that came too late to tell
  };

  // range: how many values the count has; 0 for all of 64 bits.
  Unwrap(std::uint64_t range, Nanoseconds longest_unread) : range_{range}, longest_unread_{longest_unread} {}

  // A count that does not go on from the last one is taken as it is.
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
  // Modulo 2^64: down is a large number.
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
