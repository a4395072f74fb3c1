#pragma once
#include <cstddef>
#include <memory>

#include "drivers/io/descriptor.hpp"
#include "drivers/usb_host/open_error.hpp"
#include "protocol/units/outcome.hpp"

struct libusb_context;

namespace probebox::usb_host {

// Runs libusb in an event loop: all its descriptors are behind one, and callbacks run only inside handle(). libusb's
// own hot-plug thread only passes messages. One thread uses a context and everything opened through it.
class Context {
 public:
  static Outcome<std::shared_ptr<Context>, OpenError> open();
  ~Context();
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;

  // Readable when handle() has work, or while an attention(+1) is not withdrawn.
  int descriptor() const { return epoll_.get(); }
  // Runs due callbacks. Never blocks.
  void handle();
  // Waits for the first callback, for owners that must not leave before their transfers complete.
  void handleWithin(int milliseconds);

  // Completed transfers signal the kernel's descriptor only until they are handled: whoever keeps data for a reader
  // makes the descriptor readable with +1 and releases it with -1.
  void attention(int change);

  libusb_context* get() const { return context_; }

 private:
  Context(libusb_context* context, io::Descriptor epoll, io::Descriptor wake);
  void watchLibusb();

  libusb_context* context_;
  io::Descriptor epoll_;
  io::Descriptor wake_;  // eventfd, readable while attention_ > 0
  int attention_{};
};

}  // namespace probebox::usb_host
