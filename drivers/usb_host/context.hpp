#pragma once
#include <cstddef>
#include <memory>

#include "drivers/io/descriptor.hpp"
#include "drivers/usb_host/open_error.hpp"
#include "protocol/units/outcome.hpp"

struct libusb_context;

namespace probebox::usb_host {

// libusb in a program with an event loop of its own: all that libusb waits for is behind one descriptor, and nothing
// happens but inside handle(). No thread of ours; libusb's own one for hot-plug only passes messages on.
// One thread uses a context and everything that was opened through it.
class Context {
 public:
  static Outcome<std::shared_ptr<Context>, OpenError> open();
  ~Context();
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;

  // Readable when handle() has something to do, or when somebody who called attention(+1) has not taken it back.
  int descriptor() const { return epoll_.get(); }
  // Runs the callbacks that are due. Never blocks.
  void handle();
  // The same, waiting for the first one, for those who must not leave before their transfers have come back.
  void handleWithin(int milliseconds);

  // Completed transfers show in the kernel until they are handled, then only here: whoever keeps some for a reader
  // holds the descriptor readable with +1, and lets go with -1.
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
