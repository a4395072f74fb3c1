#pragma once
#include <cstdint>
#include <string>

namespace probebox::vm {

// A counter of counter-sim/counter-sim.c: a real device of the kernel's counter core, whose counts and events the test
// makes. Needs root and the module counter-sim. Throws std::system_error when the kernel refuses.
class CounterSim {
 public:
  static constexpr int kDevices = 4;

  // 0 to kDevices - 1; found by its name, "counter-sim.0", because numbers change when devices come and go.
  explicit CounterSim(int number);
  ~CounterSim() { close(); }
  CounterSim(const CounterSim&) = delete;
  CounterSim& operator=(const CounterSim&) = delete;

  // The count wraps at 32 bits.
  void count(std::int64_t counts);
  // Latches the count, an event that the kernel stamps before this returns.
  void capture();
  void index();

  // It forgets its count.
  void unplug();
  void plugIn();
  bool isPlugged() const { return count_ >= 0; }

 private:
  void open();
  void close();
  void put(int fd, const char* text, int size) const;

  std::string name_;
  int count_{-1};
  int capture_{-1};
  int index_{-1};
};

}  // namespace probebox::vm
