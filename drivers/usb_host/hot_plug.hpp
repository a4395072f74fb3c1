#pragma once
#include <cstdint>
#include <memory>
#include <vector>

#include "drivers/io/descriptor.hpp"
#include "drivers/usb_host/context.hpp"
#include "drivers/usb_host/device.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::usb_host {

struct PlugEvent {
  enum class Kind : std::uint8_t { arrived, left };
  Kind kind{};
  Device device;
};

// Reports devices of one class that appear and disappear: from the kernel where udev runs, else by polling every half
// second.
class HotPlug {
 public:
  // Source of the changes.
  enum class News : std::uint8_t { told, looked_for };
  static News possibleHere();

  static Outcome<std::unique_ptr<HotPlug>, OpenError> watch(const usb::InterfaceClass& wanted,
                                                            News news = possibleHere());
  ~HotPlug();
  HotPlug(const HotPlug&) = delete;
  HotPlug& operator=(const HotPlug&) = delete;

  // Readable when poll() may have changes.
  int descriptor() const { return epoll_.get(); }
  // Changes since the last call; the first call returns the devices present. Never blocks.
  std::vector<PlugEvent> poll();
  // As of the last poll().
  const std::vector<Device>& there() const { return there_; }

 private:
  struct Registration;

  HotPlug(const usb::InterfaceClass& wanted, std::shared_ptr<Context> context, News news);
  bool lookAgain();

  usb::InterfaceClass wanted_;
  std::shared_ptr<Context> context_;
  io::Descriptor epoll_;
  io::Descriptor timer_;  // only without notifications
  std::unique_ptr<Registration> told_;
  bool first_{true};
  std::vector<Device> there_;
};

}  // namespace probebox::usb_host
