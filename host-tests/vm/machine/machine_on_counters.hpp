#pragma once
#include <filesystem>
#include <system_error>

#include "box_on_a_machine.hpp"
#include "counters_and_converter.hpp"

namespace probebox::vm {

// Edges from gpio-sim, counts from the kernel's counters, deflections from a converter of its industrial I/O, a screw's
// sensor from its dummy device.
class MachineOnCounters : public BoxOnAMachine {
 protected:
  explicit MachineOnCounters(bool homes = true) : BoxOnAMachine{homes} { std::filesystem::create_directory(kScrew); }
  ~MachineOnCounters() override {
    machine.stop();
    std::error_code ignored;
    std::filesystem::remove(kScrew, ignored);
  }
  void start() {
    BoxRights::settle();
    box.start();
    machine.start(sensors);
    ASSERT_TRUE(eventually([this] { return mayBegin(); })) << status().dump(1) << axes().dump(1) << box.log();
  }

  static constexpr const char* kScrew = "/sys/kernel/config/iio/devices/dummy/screw";
  CountersAndConverter sensors{config};
};

}  // namespace probebox::vm
