#pragma once
#include <array>
#include <cstddef>
#include <memory>

#include "adc_sim.hpp"
#include "counter_sim.hpp"
#include "played_machine.hpp"

namespace probebox::vm {

// Encoders on counters of the kernel, latched at the tick, and the probe on a converter of its industrial I/O.
class CountersAndConverter : public PlayedSensors {
 public:
  explicit CountersAndConverter(const world::Config& config) : truth_{config} {}

  void play(const world::Machine& machine) override;
  const Truth& truth() const { return truth_; }
  CounterSim& counter(std::size_t input) { return counters_.at(input); }
  AdcSim& converter() { return converter_; }

  Wiring wiring;

 private:
  void passMark(const world::Machine& machine, MonoTime at);

  Truth truth_;
  std::array<CounterSim, 3> counters_{CounterSim{0}, CounterSim{1}, CounterSim{2}};
  AdcSim converter_;
  double x_mm_{};
};

}  // namespace probebox::vm
