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

// Devices of one class coming and going. Where udev runs, the kernel tells; elsewhere it is looked every half second.
class HotPlug {
 public:
  // How it hears of changes.
  enum class News : std::uint8_t { told, looked_for };
  static News possibleHere();

  static Outcome<std::unique_ptr<HotPlug>, OpenError> watch(const usb::InterfaceClass& wanted,
                                                            News news = possibleHere());
  ~HotPlug();
  HotPlug(const HotPlug&) = delete;
  HotPlug& operator=(const HotPlug&) = delete;

  // Readable when poll() may have something to tell.
  int descriptor() const { return epoll_.get(); }
  // What has changed since the last call; the first call tells what was there already. Never blocks.
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
  io::Descriptor timer_;  // only where nobody tells
  std::unique_ptr<Registration> told_;
  bool first_{true};
  std::vector<Device> there_;
};

}  // namespace probebox::usb_host
