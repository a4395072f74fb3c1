#include "usb_gadget.hpp"

#include <cstdlib>
#include <stdexcept>

#include "box_user.hpp"
#include "kernel_files.hpp"

namespace probebox::vm {
namespace {

void setUp(const std::string& arguments) {
  const auto command = std::string{PROBEBOX_USB_SETUP} + " " + arguments;
  if (std::system(command.c_str()) != 0) throw std::runtime_error{"failed: " + command};
}

}  // namespace

UsbGadget::UsbGadget(const std::string& board) {
  setUp("up --user " + std::to_string(kBoxUser) + ":" + std::to_string(kBoxGroup) + " --daemon '" + PROBEBOXD +
        " --board " + board + "'");
}

UsbGadget::~UsbGadget() {
  const auto command = std::string{PROBEBOX_USB_SETUP} + " down";
  if (std::system(command.c_str()) != 0) return;  // the guest ends anyway
}

void UsbGadget::unbind() {
  writeTo(std::string{kFolder} + "/UDC", "\n");
}

void UsbGadget::bind() {
  writeTo(std::string{kFolder} + "/UDC", kController);
}

// The soft_connect of dummy_hcd's controller would be shorter, but no device comes back after it.
constexpr const char* kPort = "/sys/bus/usb/devices/usb1/1-0:1.0/usb1-port1/disable";

void UsbGadget::unplug() {
  writeTo(kPort, "1");
}

void UsbGadget::plugIn() {
  writeTo(kPort, "0");
}

std::string UsbGadget::boundTo() const {
  return readFrom(std::string{kFolder} + "/UDC");
}

}  // namespace probebox::vm
