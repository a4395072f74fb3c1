#pragma once
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "host-tests/mock_usb/mock_bus.hpp"

struct usbdevfs_urb;

namespace probebox::usb {

// What the kernel keeps for one opened usbfs node: transfers in flight and those that have come back. The host's
// descriptor is writable while one of the latter waits, and in error after an unplug, as the kernel's is: it is the
// writing end of a pipe.
class MockFile {
 public:
  ~MockFile();
  MockFile() = default;
  MockFile(const MockFile&) = delete;
  MockFile& operator=(const MockFile&) = delete;

  // The host has opened the node as `descriptor`.
  void opened(int descriptor);
  void unplugged();

  // Each answers as the ioctl does: 0, or an errno.
  int claim();
  int release();
  int selectAlternate(std::size_t new_session);
  int submit(usbdevfs_urb& urb);
  int reap(usbdevfs_urb*& urb);
  int discard(const usbdevfs_urb* urb);

  void send(std::uint8_t endpoint, std::span<const std::byte> bytes);
  std::size_t waiting(std::uint8_t endpoint) const;
  std::vector<std::byte> received(std::uint8_t endpoint);
  void setReading(std::uint8_t endpoint, bool reads);
  void spoil(std::uint8_t endpoint, int status);
  std::size_t inFlight(std::uint8_t endpoint) const;

  bool claimed{};
  bool frozen{};
  std::string held_by;  // another driver
  decltype(MockBus::Device::control) control;
  std::size_t resets{};
  std::size_t session{};
  std::size_t endless{};

 private:
  struct Endpoint {
    std::deque<usbdevfs_urb*> in_flight;
    std::deque<std::vector<std::byte>> to_host;
    std::vector<std::byte> from_host;
    std::deque<int> spoilt;  // status of the next transfers
    bool mute{};             // the firmware does not read
  };

  void progress(std::uint8_t address);
  void answerControl(usbdevfs_urb& urb);
  bool finish(std::uint8_t address, Endpoint& endpoint, usbdevfs_urb& urb);
  void comeBack(usbdevfs_urb& urb, int status);
  void flush(int status);
  void showReady();

  std::map<std::uint8_t, Endpoint> endpoints_;
  std::deque<usbdevfs_urb*> back_;
  int reading_end_{-1};
  int writing_end_{-1};  // ours, beside the host's
  bool ready_{};
  bool gone_{};
};

}  // namespace probebox::usb
