#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

#include "protocol/events/event.hpp"
#include "protocol/state/snapshot.hpp"
#include "protocol/units/time.hpp"

namespace probebox::corrections {

using published::Nanometres;
using published::Served;

// Remembers served corrections, so that an edge that arrives late finds the one that was active at its stamp.
class ServedHistory {
 public:
  static constexpr std::size_t kRemembered = 256;  // 2.5 s of continuously changing values

  void push(const Served& served) { entries_[count_++ % kRemembered] = served; }

  // Newest entry not after `at`; the oldest one for earlier times, zeros before the first.
  const Served& at(MonoTime at) const {
    const std::size_t oldest = count_ > kRemembered ? count_ - kRemembered : 0;
    for (std::size_t i = count_; i > oldest; --i) {
      const Served& entry = entries_[(i - 1) % kRemembered];
      if (entry.from <= at || i - 1 == oldest) return entry;
    }
    return kNothing;
  }
  const Served& newest() const { return count_ == 0 ? kNothing : entries_[(count_ - 1) % kRemembered]; }

 private:
  static constexpr Served kNothing{};
  std::array<Served, kRemembered> entries_{};
  std::size_t count_{};
};

}  // namespace probebox::corrections
