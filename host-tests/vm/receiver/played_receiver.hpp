#pragma once
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "drivers/usb_gadget/linux_aio.hpp"
#include "drivers/usb_gadget/linux_function_fs.hpp"
#include "drivers/usb_probe/emulator.hpp"

namespace probebox::vm {

// Every sample that was taken has one fate: taken = delivered + withheld + refused + returned + in flight.
struct PlayedCounts {
  std::uint64_t taken{};
  std::uint64_t delivered{};  // the controller has handed the transfer over
  std::uint64_t withheld{};   // by a fault that was asked for
  std::uint64_t refused{};    // no host listened, or all transfers were in flight
  std::uint64_t returned{};   // in transfers that came back undelivered
};

// The emulated receiver on a device controller, by FunctionFS with transfers in flight: a packet goes when its last
// sample has been taken, in a transfer of its own.
class PlayedReceiver {
 public:
  // start: when the first sample is taken; mount: where FunctionFS is mounted; gadget: its folder in configfs; counts:
  // where config has axis counters.
  static Outcome<std::unique_ptr<PlayedReceiver>> open(const usb_probe::EmulatedReceiver::Config& config,
                                                       usb_probe::EmulatedReceiver::Waveform waveform, MonoTime start,
                                                       const std::filesystem::path& mount,
                                                       const std::filesystem::path& gadget,
                                                       const std::string& controller,
                                                       usb_probe::EmulatedReceiver::Counts counts = {});
  ~PlayedReceiver();

  // Readable when the bus has done something.
  int descriptor() const { return function_->descriptor(); }
  MonoTime nextPacketAt() const { return device_.nextPacketAt(); }
  // Takes what the bus has done, and plays up to `now`.
  void turn(MonoTime now);

  void dropPackets(std::size_t packets) { to_drop_ = packets; }
  void corruptPackets(std::size_t packets) { to_corrupt_ = packets; }
  void setMute(bool mute) { mute_ = mute; }  // samples are taken, and none is sent
  void restart(std::uint32_t counter) { device_.restart(counter); }

  PlayedCounts counts() const;

 private:
  PlayedReceiver(const usb_probe::EmulatedReceiver::Config& config, usb_probe::EmulatedReceiver::Waveform waveform,
                 MonoTime start, usb_probe::EmulatedReceiver::Counts counts);
  void takeBusEvents();
  void settle();
  void send(std::span<const std::byte> packet);

  usb_probe::EmulatedReceiver device_;
  std::size_t samples_a_packet_;
  std::unique_ptr<usb_gadget::FunctionFs> function_;
  std::unique_ptr<usb_gadget::AioQueue> queue_;
  std::vector<usb_gadget::Transfer> transfers_;
  bool enabled_{};
  bool mute_{};
  std::size_t to_drop_{};
  std::size_t to_corrupt_{};
  PlayedCounts counts_;
};

}  // namespace probebox::vm
