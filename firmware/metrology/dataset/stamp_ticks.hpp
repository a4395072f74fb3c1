#pragma once
#include "firmware/metrology/dataset/dataset.hpp"

namespace probebox::metrology {

// The ticks of the clock that stamped a stream.
struct StampTicks {
  double tick_s{};  // of which the distances of all stamps are multiples; 0 where there is none above 1 us
  bool shown{};     // by samples that take two or more, and not all the same number: with one tick a sample, and
                    // samples that are lost, a steady rate is as likely
};

// Of column t_s; column touch or scan says which samples follow each other.
StampTicks ticksOf(const Table& table);

}  // namespace probebox::metrology
