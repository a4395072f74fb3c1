#pragma once
#include <cstdint>
#include <string>
#include <vector>

namespace probebox::vm {

// A chip of the kernel's own gpio simulator: a real gpio device, whose lines are pulled up and down by the test. Needs
// root and the module gpio-sim. Throws std::system_error when the kernel refuses: nothing can be tested then.
class GpioSim {
 public:
  // A line for each name; "" is a line without a name. All are low.
  GpioSim(std::string label, const std::vector<std::string>& line_names);
  ~GpioSim();
  GpioSim(const GpioSim&) = delete;
  GpioSim& operator=(const GpioSim&) = delete;

  const std::string& label() const { return label_; }
  // "gpiochip0"; may be another after plugging in again.
  const std::string& chip() const { return chip_; }

  // The chip goes away, and comes back with all lines low. Returns when those who held lines have let go: not in the
  // thread of one of them.
  void unplug();
  void plugIn();
  // Gives the device to the box's group, as a udev rule would; plugIn() does so unless told otherwise.
  void grant() const;
  void plugInWithoutRights();

  // The wire goes to this level. When it was at the other one, that is an edge for whoever watches the line, stamped
  // before this returns (in a guest with one processor).
  void drive(unsigned line, bool high);
  // What is on the line now: what the box drives, where it has made an output of it, and the wire's level elsewhere.
  bool isHigh(unsigned line) const;
  void pulse(unsigned line) {
    drive(line, true);
    drive(line, false);
  }

 private:
  std::string folder_;  // in configfs
  std::string label_;
  std::string chip_;
  std::vector<int> pulls_;  // of every line, open
  std::vector<int> values_;
};

}  // namespace probebox::vm
