#include "counter_sim.hpp"

#include <array>
#include <cerrno>
#include <cstdio>
#include <fcntl.h>
#include <filesystem>
#include <unistd.h>
#include <utility>

#include "fail.hpp"
#include "kernel_files.hpp"

namespace probebox::vm {
namespace {

constexpr const char* kCounterDriver = "/sys/bus/platform/drivers/counter-sim";

}  // namespace

CounterSim::CounterSim(int number) : name_{"counter-sim." + std::to_string(number)} {
  open();
}

void CounterSim::put(int fd, const char* text, int size) const {
  if (pwrite(fd, text, static_cast<std::size_t>(size), 0) != size) fail(name_);
}

void CounterSim::count(std::int64_t counts) {
  std::array<char, 24> text{};
  put(count_, text.data(), std::snprintf(text.data(), text.size(), "%u", static_cast<std::uint32_t>(counts)));
}

void CounterSim::capture() {
  put(capture_, "0", 1);
}

void CounterSim::index() {
  put(index_, "0", 1);
}

void CounterSim::unplug() {
  close();
  writeTo(std::string{kCounterDriver} + "/unbind", name_);
}

void CounterSim::plugIn() {
  writeTo(std::string{kCounterDriver} + "/bind", name_);
  open();
}

void CounterSim::open() {
  for (const auto& device : std::filesystem::directory_iterator{"/sys/bus/counter/devices"}) {
    const std::string folder = device.path();
    if (readFrom(folder + "/name") != name_) continue;
    count_ = ::open((folder + "/count0/count").c_str(), O_WRONLY | O_CLOEXEC);
    capture_ = ::open((folder + "/capture_pulse").c_str(), O_WRONLY | O_CLOEXEC);
    index_ = ::open((folder + "/index_pulse").c_str(), O_WRONLY | O_CLOEXEC);
    if (count_ < 0 || capture_ < 0 || index_ < 0) fail(folder);
    return;
  }
  errno = ENODEV;
  fail(name_);
}

void CounterSim::close() {
  for (int* const fd : {&count_, &capture_, &index_}) {
    if (*fd >= 0) ::close(std::exchange(*fd, -1));
  }
}

}  // namespace probebox::vm
