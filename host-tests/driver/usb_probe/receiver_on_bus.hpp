#pragma once
#include <array>
#include <ctime>
#include <gmock/gmock.h>
#include <memory>
#include <poll.h>
#include <span>
#include <variant>
#include <vector>

#include "drivers/usb_probe/emulator.hpp"
#include "drivers/usb_probe/linux_receiver.hpp"
#include "host-tests/mock_usb/mock_bus.hpp"

// A receiver on a mocked bus, read by the real driver through the real libusb; without umockdev its tests skip.
namespace probebox::usb_probe {

using usb::MockBus;

inline const MockBus::Device kReceiver{.path = "1-3",
                                       .address = 7,
                                       .serial_number = "RX-7",
                                       .product = "receiver",
                                       .interface_class = usb::kReceiver,
                                       .endpoints = {MockBus::kSamplesIn}};

inline MonoTime kernelNow() {
  timespec time{};
  clock_gettime(CLOCK_MONOTONIC, &time);
  return monoTime(std::int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec);
}

class Receiver : public testing::Test {
 protected:
  void SetUp() override {
    if (!bus_) GTEST_SKIP() << "the real libusb is not tested: install libumockdev-dev and configure again";
  }

  void send(std::span<const std::byte> bytes) { bus_->send("1-3", MockBus::kSamplesIn, bytes); }
  // The next packets of the device, in one write each or all in one.
  std::vector<std::byte> packets(int count) {
    std::vector<std::byte> all;
    for (int i = 0; i < count; ++i) {
      const auto packet = device_.packet(device_.nextPacketAt());
      all.insert(all.end(), packet.begin(), packet.end());
    }
    return all;
  }

  std::vector<Event> read(LinuxReceiver& source, std::size_t room = 256) {
    std::vector<Event> events(room);
    events.resize(source.read(events, now_ += std::chrono::milliseconds{1}));
    return events;
  }
  std::vector<CountedDeflection> samples(LinuxReceiver& source, std::size_t room = 256) {
    std::vector<CountedDeflection> all;
    for (auto events = read(source, room); !events.empty(); events = read(source, room)) {
      for (const auto& event : events) all.push_back(std::get<CountedDeflection>(event));
    }
    return all;
  }
  // Until it has heard of a plug; how long that takes is of no interest here.
  void waitUntil(LinuxReceiver& source, auto&& done) {
    for (int round = 0; round < 100 && !done(); ++round) {
      pollfd watched{source.descriptor(), POLLIN, 0};
      ::poll(&watched, 1, 1000);
      for (const auto& event : read(source)) told_.push_back(event);
    }
    ASSERT_TRUE(done()) << source.problem();
  }
  bool connected() { return bus_->claimed("1-3"); }

  std::unique_ptr<MockBus> bus_ = usb::makeMockBus();
  EmulatedReceiver device_{
      {.samples_a_packet = 4}, [](Nanoseconds) { return std::array<Micrometres, 3>{}; }, monoTime(0)};
  std::vector<Event> told_;
  MonoTime now_ = monoTime(1'000'000'000'000);
};

}  // namespace probebox::usb_probe
