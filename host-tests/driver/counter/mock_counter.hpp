#pragma once
#include <cstdint>
#include <linux/counter.h>
#include <memory>
#include <string>
#include <vector>

namespace probebox::counter {

// A counter device as the kernel shows it, /dev/counter3 and its folder in sysfs, so that the driver runs unchanged.
class MockCounter {
 public:
  static constexpr const char* kName = "48300180.counter";

  virtual ~MockCounter() = default;

  // An attribute of count0, such as "count" or "ceiling".
  virtual void set(const std::string& attribute, const std::string& text) = 0;
  // The kernel queues an event.
  virtual void push(const counter_event& event) = 0;
  // Its driver does not know the event, or the node may not be opened.
  virtual void refuseWatches(int code) = 0;
  virtual std::vector<counter_watch> watches() const = 0;  // those that are enabled
  virtual void unplug() = 0;
  virtual void plugIn() = 0;
};

// Nothing where this machine cannot mock devices (no libumockdev-dev at the build).
std::unique_ptr<MockCounter> makeMockCounter();

}  // namespace probebox::counter
