#include "drivers/iio/linux_device.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fcntl.h>
#include <system_error>
#include <unistd.h>
#include <utility>
#include <vector>

#include "drivers/io/descriptor.hpp"

namespace probebox::iio {
namespace {

constexpr const char* kFolder = "/sys/bus/iio/devices";

std::string trimmed(std::string text) {
  while (!text.empty() && (text.back() == '\n' || text.back() == ' ')) text.pop_back();
  return text;
}

// Explains by errno why an attribute could not be read or written.
Error failure(const std::filesystem::path& file, int code) {
  std::string remedy;
  if (code == EACCES || code == EPERM || code == EROFS)
    remedy = ": no permission; install 60-probeboxd.rules (docs/service.md), and plug the device in again";
  else if (code == EBUSY)
    remedy = ": another program uses its buffer; stop that program";
  else if (code == ENOENT || code == ENODEV)
    remedy = ": there is no such file, the device has gone or cannot do this";
  else
    remedy = std::string{": "} + std::strerror(code);
  return Error{file.string() + remedy};
}

Outcome<std::string> contentOf(const std::filesystem::path& file) {
  const io::Descriptor fd{::open(file.c_str(), O_RDONLY | O_CLOEXEC)};
  if (!fd) return failure(file, errno);
  std::array<char, 256> text{};
  const auto size = ::read(fd.get(), text.data(), text.size());
  if (size < 0) return failure(file, errno);
  return trimmed({text.data(), static_cast<std::size_t>(size)});
}

struct Found {
  std::filesystem::path folder;
  std::string name;   // as its driver calls it
  std::string label;  // as the device tree calls it; may be empty
};

std::vector<Found> allDevices() {
  std::vector<Found> all;
  std::error_code error;
  auto entries = std::filesystem::directory_iterator{kFolder, error};
  for (; !error && entries != std::filesystem::directory_iterator{}; entries.increment(error)) {
    if (!entries->path().filename().string().starts_with("iio:device")) continue;
    const auto name = contentOf(entries->path() / "name");
    const auto label = contentOf(entries->path() / "label");
    all.push_back({entries->path(), name ? *name : "", label ? *label : ""});
  }
  std::ranges::sort(all, {}, &Found::folder);
  return all;
}

std::string inWords(const std::vector<Found>& devices) {
  std::string text;
  for (const auto& device : devices)
    text += (text.empty() ? "" : ", ") + device.folder.filename().string() + " (" + device.name +
            (device.label.empty() ? "" : ", label " + device.label) + ")";
  return text;
}

// "voltage0-voltage1" -> "voltage-voltage" -> "voltage": what a number may be shared by.
std::vector<std::string> namesOf(const std::string& channel) {
  std::string without_digits;
  std::ranges::remove_copy_if(channel, std::back_inserter(without_digits), [](char c) { return c >= '0' && c <= '9'; });
  const auto kind = without_digits.substr(0, without_digits.find_first_of("-_"));
  return {"in_" + channel + "_", "in_" + without_digits + "_", "in_" + kind + "_", "in_", ""};
}

}  // namespace

Outcome<LinuxDevice> LinuxDevice::find(const std::string& name) {
  const auto all = allDevices();
  std::vector<Found> matching;
  std::ranges::copy_if(all, std::back_inserter(matching), [&](const Found& device) {
    return name == device.name || name == device.label || name == device.folder.filename();
  });
  if (matching.size() == 1) return LinuxDevice{matching[0].folder, name};
  if (matching.size() > 1)
    return Error{"iio device " + name + ": there are " + inWords(matching) +
                 "; name one of them in box.toml by its label (a property of the device tree), or as iio:deviceN"};
  return Error{"iio device " + name + ": there is none of this name" +
               (all.empty() ? "; check its driver and the device tree" : "; there are " + inWords(all))};
}

bool LinuxDevice::has(std::string_view attribute) const {
  return ::access((folder_ / attribute).c_str(), F_OK) == 0;
}

Outcome<std::string> LinuxDevice::read(std::string_view attribute) const {
  return contentOf(folder_ / attribute);
}

Outcome<double> LinuxDevice::number(std::string_view attribute) const {
  TRY(const auto text, read(attribute));
  double value = 0;
  const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (code != std::errc{} || end != text.data() + text.size() || !std::isfinite(value))
    return Error{(folder_ / attribute).string() + ": \"" + text + "\" is not a number"};
  return value;
}

std::optional<Error> LinuxDevice::write(std::string_view attribute, std::string_view value) const {
  const auto file = folder_ / attribute;
  const io::Descriptor fd{::open(file.c_str(), O_WRONLY | O_CLOEXEC)};
  if (!fd || ::write(fd.get(), value.data(), value.size()) != static_cast<ssize_t>(value.size()))
    return failure(file, errno);
  return std::nullopt;
}

std::optional<Error> LinuxDevice::ensure(std::string_view attribute, std::string_view value) const {
  const auto present = read(attribute);
  if (present && *present == value) return std::nullopt;
  return write(attribute, value);
}

Outcome<double> LinuxDevice::channelNumber(const std::string& channel, const char* what, double otherwise) const {
  for (const auto& prefix : namesOf(channel)) {
    if (has(prefix + what)) return number(prefix + what);
  }
  return otherwise;
}

std::optional<Error> LinuxDevice::disableScanElements() const {
  std::error_code error;
  auto entries = std::filesystem::directory_iterator{folder_ / "scan_elements", error};
  if (error)
    return Error{"iio device " + name_ +
                 ": it has no buffer (no scan_elements in sysfs); take a device that can be triggered"};
  for (; !error && entries != std::filesystem::directory_iterator{}; entries.increment(error)) {
    const auto attribute = entries->path().filename().string();
    if (!attribute.ends_with("_en")) continue;
    if (const auto refused = ensure("scan_elements/" + attribute, "0")) return refused;
  }
  return std::nullopt;
}

Outcome<Conversion> conversionOf(const LinuxDevice& device, const std::string& channel, double um_per_unit,
                                 double zero_unit) {
  TRY(const auto offset, device.channelNumber(channel, "offset", 0));
  TRY(const auto scale, device.channelNumber(channel, "scale", 1));
  return Conversion{.offset = offset, .scale = scale, .um_per_unit = um_per_unit, .zero_unit = zero_unit};
}

}  // namespace probebox::iio
