#pragma once
#include <array>
#include <cstdint>
#include <string>

namespace probebox::vm {

// The converter of iio-sim/adc-sim.c: a real device of the kernel's industrial I/O, whose inputs and conversions the
// test makes. Needs root and the module adc-sim. Throws std::system_error when the kernel refuses.
class AdcSim {
 public:
  static constexpr const char* kName = "adc-sim.0";
  static constexpr const char* kTrigger = "adc-sim-ready";
  static constexpr double kMillivoltsPerStep = 0.001;

  AdcSim() { open(); }
  ~AdcSim() { close(); }
  AdcSim(const AdcSim&) = delete;
  AdcSim& operator=(const AdcSim&) = delete;

  // One frame of these inputs, stamped by the kernel before this returns (in a guest with one processor).
  void convert(const std::array<std::int32_t, 3>& steps);

  // Readers get an error, and nothing can be converted until it is there again.
  void unplug();
  void plugIn();
  bool isPlugged() const { return convert_ >= 0; }

 private:
  void open();
  void close();

  int convert_{-1};
};

}  // namespace probebox::vm
