#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "drivers/iio/decode.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::iio {

// A device of the kernel's industrial I/O in sysfs. Everything reads the files anew, because the device may go at any
// time.
class LinuxDevice {
 public:
  // name: as its driver calls it, its label, or "iio:device0". Errors: none of that name, two of them.
  static Outcome<LinuxDevice> find(const std::string& name);

  const std::string& name() const { return name_; }
  // "/dev/iio:device0"
  std::string node() const { return "/dev/" + folder_.filename().string(); }

  bool has(std::string_view attribute) const;
  Outcome<std::string> read(std::string_view attribute) const;
  // A number that the kernel wrote as a decimal.
  Outcome<double> number(std::string_view attribute) const;
  // nullopt when it was written.
  std::optional<Error> write(std::string_view attribute, std::string_view value) const;
  // Writes unless the attribute says so already: a box without the right to write may have been set up by others.
  std::optional<Error> ensure(std::string_view attribute, std::string_view value) const;

  // "scale" or "offset" of a channel such as "voltage0": its own, or the one that it shares with others of its kind;
  // `otherwise` when the device has neither.
  Outcome<double> channelNumber(const std::string& channel, const char* what, double otherwise) const;
  // Switches off what was enabled for the buffer.
  std::optional<Error> disableScanElements() const;

 private:
  LinuxDevice(std::filesystem::path folder, std::string name) : folder_{std::move(folder)}, name_{std::move(name)} {}

  std::filesystem::path folder_;
  std::string name_;
};

// The number and unit of a channel, with um_per_unit and zero_unit of its description.
Outcome<Conversion> conversionOf(const LinuxDevice& device, const std::string& channel, double um_per_unit,
                                 double zero_unit);

}  // namespace probebox::iio
