#include "adc_sim.hpp"

#include <cerrno>
#include <cstdio>
#include <fcntl.h>
#include <filesystem>
#include <string_view>
#include <unistd.h>
#include <utility>

#include "fail.hpp"
#include "kernel_files.hpp"

namespace probebox::vm {
namespace {

constexpr const char* kDriver = "/sys/bus/platform/drivers/adc-sim";

}  // namespace

void AdcSim::convert(const std::array<std::int32_t, 3>& steps) {
  std::array<char, 48> text{};
  const int size = std::snprintf(text.data(), text.size(), "%d %d %d", steps[0], steps[1], steps[2]);
  if (pwrite(convert_, text.data(), static_cast<std::size_t>(size), 0) != size) fail(kName);
}

void AdcSim::unplug() {
  close();
  writeTo(std::string{kDriver} + "/unbind", kName);
}

void AdcSim::plugIn() {
  writeTo(std::string{kDriver} + "/bind", kName);
  open();
}

void AdcSim::open() {
  for (const auto& device : std::filesystem::directory_iterator{"/sys/bus/iio/devices"}) {
    const std::string folder = device.path();
    if (readFrom(folder + "/name") != kName) continue;
    convert_ = ::open((folder + "/convert").c_str(), O_WRONLY | O_CLOEXEC);
    if (convert_ < 0) fail(folder + "/convert");
    return;
  }
  errno = ENODEV;
  fail(kName);
}

void AdcSim::close() {
  if (convert_ >= 0) ::close(std::exchange(convert_, -1));
}

}  // namespace probebox::vm
