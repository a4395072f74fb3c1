#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>

#include "adc_sim.hpp"
#include "counter_sim.hpp"
#include "played_machine.hpp"

namespace probebox::vm {

// Encoders on counters of the kernel, latched at the tick, and the probe on a converter of its industrial I/O.
class CountersAndConverter : public PlayedSensors {
 public:
  explicit CountersAndConverter(const world::Config& config) : truth_{config} {}

  static constexpr int kQuillInput = 3;
  static constexpr double kQuillCountsPerMm = -50'000;  // it counts down

  void play(const world::Machine& machine) override;
  // W, along Z, on a counter of its own: it goes to and fro all the time, and the slide against it.
  void putQuill() { quill_.emplace(kQuillInput); }
  const Truth& truth() const { return truth_; }
  CounterSim& counter(std::size_t input) { return counters_.at(input); }
  CounterSim& quill() { return *quill_; }
  AdcSim& converter() { return converter_; }

  Wiring wiring;

 private:
  std::int64_t countsAt(const world::Machine& machine, std::size_t input, MonoTime at);
  void passMark(const world::Machine& machine, MonoTime at);

  Truth truth_;
  std::array<CounterSim, 3> counters_{CounterSim{0}, CounterSim{1}, CounterSim{2}};
  std::optional<CounterSim> quill_;
  AdcSim converter_;
  double x_mm_{};
};

}  // namespace probebox::vm
