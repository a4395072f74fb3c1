#pragma once
#include <cstddef>
#include <map>
#include <memory>
#include <span>
#include <string>

namespace probebox::iio {

// A device of industrial I/O as the kernel shows it: a folder in sysfs, and a node whose frames the test sends.
class MockDevice {
 public:
  static constexpr const char* kNumber = "iio:device3";

  virtual ~MockDevice() = default;

  // Attributes by their names below the device's folder. One that the driver wrote reads as it wrote it.
  virtual void set(const std::string& attribute, const std::string& text) = 0;
  virtual std::string get(const std::string& attribute) const = 0;
  virtual void remove(const std::string& attribute) = 0;
  // A second device, with these attributes.
  virtual void addAnother(const std::string& number, const std::map<std::string, std::string>& attributes) = 0;

  // What the node gives to read next.
  virtual void send(std::span<const std::byte> bytes) = 0;
  virtual void unplug() = 0;
  virtual void plugIn() = 0;
};

// Nothing where this machine cannot mock devices (no libumockdev-dev at the build).
std::unique_ptr<MockDevice> makeMockDevice(const std::map<std::string, std::string>& attributes);

}  // namespace probebox::iio
