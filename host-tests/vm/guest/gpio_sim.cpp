#include "gpio_sim.hpp"

#include <fcntl.h>
#include <filesystem>
#include <string_view>
#include <sys/stat.h>
#include <unistd.h>
#include <utility>

#include "box_user.hpp"
#include "fail.hpp"
#include "kernel_files.hpp"

namespace probebox::vm {
GpioSim::GpioSim(std::string label, const std::vector<std::string>& line_names)
    : folder_{"/sys/kernel/config/gpio-sim/" + label}, label_{std::move(label)} {
  const auto bank = folder_ + "/bank";
  std::filesystem::create_directories(bank);
  writeTo(bank + "/label", label_);
  writeTo(bank + "/num_lines", std::to_string(line_names.size()));
  for (std::size_t i = 0; i < line_names.size(); ++i) {
    if (line_names[i].empty()) continue;
    const auto line = bank + "/line" + std::to_string(i);
    std::filesystem::create_directory(line);
    writeTo(line + "/name", line_names[i]);
  }
  pulls_.assign(line_names.size(), -1);
  values_.assign(line_names.size(), -1);
  plugIn();
}

GpioSim::~GpioSim() {
  if (pulls_.front() >= 0) unplug();
  // configfs: folders go one by one, from the inside.
  const auto bank = folder_ + "/bank";
  for (std::size_t i = 0; i < pulls_.size(); ++i) rmdir((bank + "/line" + std::to_string(i)).c_str());
  rmdir(bank.c_str());
  rmdir(folder_.c_str());
}

void GpioSim::plugInWithoutRights() {
  writeTo(folder_ + "/live", "1");
  chip_ = readFrom(folder_ + "/bank/chip_name");
  const auto device = "/sys/devices/platform/" + readFrom(folder_ + "/dev_name") + "/" + chip_;
  for (std::size_t i = 0; i < pulls_.size(); ++i) {
    const auto line = device + "/sim_gpio" + std::to_string(i);
    pulls_[i] = open((line + "/pull").c_str(), O_WRONLY | O_CLOEXEC);
    values_[i] = open((line + "/value").c_str(), O_RDONLY | O_CLOEXEC);
    if (pulls_[i] < 0 || values_[i] < 0) fail(line);
  }
}

void GpioSim::plugIn() {
  plugInWithoutRights();
  grant();
}

void GpioSim::grant() const {
  const auto node = "/dev/" + chip_;
  if (chown(node.c_str(), 0, kBoxGroup) != 0 || chmod(node.c_str(), 0660) != 0) fail(node);
}

void GpioSim::unplug() {
  for (int& pull : pulls_) close(std::exchange(pull, -1));
  for (int& value : values_) close(std::exchange(value, -1));
  writeTo(folder_ + "/live", "0");
}

void GpioSim::drive(unsigned line, bool high) {
  const std::string_view pull = high ? "pull-up" : "pull-down";
  if (pwrite(pulls_.at(line), pull.data(), pull.size(), 0) < 0) fail(label_ + ", line " + std::to_string(line));
}

bool GpioSim::isHigh(unsigned line) const {
  char value = '0';
  if (pread(values_.at(line), &value, 1, 0) != 1) fail(label_ + ", line " + std::to_string(line));
  return value == '1';
}

}  // namespace probebox::vm
