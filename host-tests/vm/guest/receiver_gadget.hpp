#pragma once
#include <cstdint>
#include <string>
#include <sys/types.h>
#include <vector>

namespace probebox::vm {

// A second gadget, on a device controller of its own, that a program can play a probe receiver on. Needs root and the
// modules libcomposite, dummy_hcd (two controllers) and usb_f_fs. Throws when the kernel refuses.
class ReceiverGadget {
 public:
  static constexpr const char* kController = "dummy_udc.1";
  static constexpr const char* kFolder = "/sys/kernel/config/usb_gadget/receiver";
  static constexpr const char* kMount = "/run/receiver";
  static constexpr const char* kSerialNumber = "RX-VM";

  ReceiverGadget();
  ~ReceiverGadget();
  ReceiverGadget(const ReceiverGadget&) = delete;
  ReceiverGadget& operator=(const ReceiverGadget&) = delete;

  // The cable, as root pulls it; the player stays.
  void unbind();
  void bind();

  // The device's node on the host's side; empty while it is not there.
  static std::string node();
  // Waits until it is there and gives it to the box's group, as a udev rule would.
  static void grant();
};

// The program that plays it, as a process of its own.
class ReceiverPlayer {
 public:
  // What became of the samples that it has taken.
  struct Counts {
    std::uint64_t taken{};
    std::uint64_t delivered{};
    std::uint64_t withheld{};  // by a fault that was asked for
    std::uint64_t refused{};   // no host listened
    std::uint64_t returned{};  // came back from the controller
  };

  // Returns when it is on the bus.
  explicit ReceiverPlayer(const std::vector<std::string>& arguments = {});
  ~ReceiverPlayer();
  ReceiverPlayer(const ReceiverPlayer&) = delete;
  ReceiverPlayer& operator=(const ReceiverPlayer&) = delete;

  // "drop 3", "mute", ...: what receiver_player.cpp lists. The counts after it.
  Counts tell(const std::string& command);
  Counts counts() { return tell("counts"); }
  // SIGKILL, and waits for the end.
  void kill();

 private:
  Counts readCounts();
  void reap();

  pid_t pid_{};
  int to_{-1};
  int from_{-1};
};

}  // namespace probebox::vm
