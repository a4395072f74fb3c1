#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "drivers/iio/decode.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::iio {

// A device of the kernel's industrial I/O in sysfs. Every call reads the files again, because the device may disappear
// at any time.
class LinuxDevice {
 public:
  // name: the driver's name, a label, or "iio:device0". Errors: no such device, or two of that name.
  static Outcome<LinuxDevice> find(const std::string& name);

  const std::string& name() const { return name_; }
  // "/dev/iio:device0"
  std::string node() const { return "/dev/" + folder_.filename().string(); }

  bool has(std::string_view attribute) const;
  Outcome<std::string> read(std::string_view attribute) const;
  // A number that the kernel wrote as a decimal.
  Outcome<double> number(std::string_view attribute) const;
  // Returns nullopt on success.
  std::optional<Error> write(std::string_view attribute, std::string_view value) const;
  // Writes unless the attribute has this value already: a box without write permission may have been set up by others.
  std::optional<Error> ensure(std::string_view attribute, std::string_view value) const;

  // Reads "scale" or "offset" of a channel such as "voltage0": its own attribute, or the one shared by channels of its
  // kind; `otherwise` when the device has neither.
  Outcome<double> channelNumber(const std::string& channel, const char* what, double otherwise) const;
  // Disables all channels that were enabled for the buffer.
  std::optional<Error> disableScanElements() const;

 private:
  LinuxDevice(std::filesystem::path folder, std::string name) : folder_{std::move(folder)}, name_{std::move(name)} {}

  std::filesystem::path folder_;
  std::string name_;
};

// Builds the conversion of a channel from sysfs and the um_per_unit and zero_unit of its description.
Outcome<Conversion> conversionOf(const LinuxDevice& device, const std::string& channel, double um_per_unit,
                                 double zero_unit);

}  // namespace probebox::iio
