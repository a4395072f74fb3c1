#pragma once
#include <cstddef>
#include <string>
#include <vector>

#include "gpio_sim.hpp"
#include "protocol/units/time.hpp"

namespace probebox::vm {

// How long something took, over many times.
class Latencies {
 public:
  void add(Nanoseconds latency) { all_.push_back(latency); }
  std::size_t count() const { return all_.size(); }
  // 0.5 is the median, 1 the longest.
  double us(double quantile) const;
  // One line of a table, in microseconds of the guest.
  void print(const std::string& what) const;

 private:
  std::vector<Nanoseconds> all_;
};

// From the write that moves the wire to the stamp that the kernel gave the edge.
Latencies edgeToStamp(GpioSim& chip, unsigned line, std::size_t edges);

struct BoxLatencies {
  Latencies
      trigger_to_sample;     // from an edge of a trigger line to the first sample that tells of it, in the host's hand
  Latencies tick_to_sample;  // from the time of a sample to the sample, in the host's hand
};

// Prints both, and fails the test on nonsense: what is printed is the statement.
void report(const BoxLatencies& latencies, const std::string& by, std::size_t edges);

// Through a box that runs already, over whatever link: ticks on one line, and now and then an edge on another.
BoxLatencies edgeToSample(const std::string& uri, GpioSim& chip, unsigned sync, unsigned trigger, std::size_t edges);

}  // namespace probebox::vm
