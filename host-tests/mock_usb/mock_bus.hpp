#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "protocol/usb/interface.hpp"

namespace probebox::usb {

// A USB bus as the kernel shows it to libusb (sysfs, uevents, usbfs nodes and their ioctls), so that the real libusb
// runs unchanged. The test plays the firmware of what is plugged in.
class MockBus {
 public:
  // As a device controller would number them: in no order.
  static constexpr std::uint8_t kDataIn = 0x85, kDataOut = 0x02, kControlIn = 0x83, kControlOut = 0x01;
  static constexpr std::uint8_t kSamplesIn = 0x86;  // of a receiver
  static constexpr std::size_t kPacketBytes = 512;

  struct Device {
    std::string path{"1-1"};
    std::uint8_t address{5};
    std::string serial_number{"PB-0001"};
    std::string product{"probebox"};
    InterfaceClass interface_class{kLink};
    std::vector<std::uint8_t> endpoints{kDataIn, kDataOut, kControlIn, kControlOut};  // all bulk
    // Answers control transfers to the device: what it sends back, or nothing for a stall. Without it all are stalled.
    std::function<std::optional<std::vector<std::byte>>(std::span<const std::byte, 8> setup,
                                                        std::span<const std::byte> data)>
        control{};
    std::string held_by{};  // the driver of whoever has the interface before anybody sees the device, if any
  };

  virtual ~MockBus() = default;

  virtual void plug(const Device& device) = 0;
  // In mid-transfer: what is in flight comes back, and the node is dead.
  virtual void unplug(const std::string& path) = 0;

  // The functions below take the path of a device that is plugged in; for another they do nothing and return nothing.

  // One write of the firmware, which waits at the device for the host's transfers.
  virtual void send(const std::string& path, std::uint8_t endpoint, std::span<const std::byte> bytes) = 0;
  // Bytes that wait there for the host.
  virtual std::size_t waiting(const std::string& path, std::uint8_t endpoint) = 0;
  // What the host has sent to that endpoint since the last call.
  virtual std::vector<std::byte> received(const std::string& path, std::uint8_t endpoint) = 0;
  // The firmware leaves that OUT endpoint full; or reads it again.
  virtual void stopReading(const std::string& path, std::uint8_t endpoint) = 0;
  virtual void readAgain(const std::string& path, std::uint8_t endpoint) = 0;
  // The next transfer of that endpoint comes back with this status of the kernel (-EPIPE, -EPROTO, -EOVERFLOW).
  virtual void spoil(const std::string& path, std::uint8_t endpoint, int status) = 0;

  // The host controller has died: nothing comes back any more, cancelled or not.
  virtual void freeze(const std::string& path) = 0;

  // Transfers that the host has in flight.
  virtual std::size_t inFlight(const std::string& path, std::uint8_t endpoint) = 0;
  // OUT transfers of whole packets that nothing ended: the firmware would wait for more.
  virtual std::size_t endless(const std::string& path) = 0;
  // How often alternate setting 0 was selected: each empties the device.
  virtual std::size_t resets(const std::string& path) = 0;
  // Another number after each of them, whatever device it is; 0 before the first one.
  virtual std::size_t session(const std::string& path) = 0;
  virtual bool claimed(const std::string& path) = 0;

  // Another program, or a driver of the kernel, has the interface ("usbfs" is a program's).
  virtual void claimElsewhere(const std::string& path, const std::string& driver) = 0;
  // What users but root may do with the node, such as 0600.
  virtual void setMode(const std::string& path, unsigned mode) = 0;
};

// Nothing where this machine cannot mock devices (no libumockdev-dev at the build).
std::unique_ptr<MockBus> makeMockBus();

}  // namespace probebox::usb
