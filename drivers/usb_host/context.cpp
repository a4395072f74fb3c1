#include "drivers/usb_host/context.hpp"

#include <cerrno>
#include <cstdint>
#include <cstring>
#include <libusb.h>
#include <string>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <utility>

namespace probebox::usb_host {
namespace {

void addTo(int epoll, int descriptor, short events) {
  epoll_event wanted{};
  wanted.events = static_cast<std::uint32_t>(events);  // POLLIN and POLLOUT are EPOLLIN and EPOLLOUT
  wanted.data.fd = descriptor;
  epoll_ctl(epoll, EPOLL_CTL_ADD, descriptor, &wanted);
}

int epollOf(void* context) {
  return static_cast<Context*>(context)->descriptor();
}

void LIBUSB_CALL onAdded(int descriptor, short events, void* context) {
  addTo(epollOf(context), descriptor, events);
}

void LIBUSB_CALL onRemoved(int descriptor, void* context) {
  epoll_ctl(epollOf(context), EPOLL_CTL_DEL, descriptor, nullptr);
}

}  // namespace

Outcome<std::shared_ptr<Context>, OpenError> Context::open() {
  io::Descriptor epoll{epoll_create1(EPOLL_CLOEXEC)};
  io::Descriptor wake{eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)};
  if (!epoll || !wake) {
    return OpenError{OpenError::Kind::unavailable,
                     std::string{"no descriptors left for USB: "} + std::strerror(errno) + "; see `ulimit -n`"};
  }
  libusb_context* context = nullptr;
  if (const int code = libusb_init(&context); code != LIBUSB_SUCCESS) {
    return OpenError{OpenError::Kind::unavailable, std::string{"USB cannot be used here: "} + libusb_strerror(code) +
                                                       "; are /sys and /dev/bus/usb there?"};
  }
  return std::shared_ptr<Context>{new Context{context, std::move(epoll), std::move(wake)}};
}

// libusb says nothing by itself unless LIBUSB_DEBUG asks it to.
Context::Context(libusb_context* context, io::Descriptor epoll, io::Descriptor wake)
    : context_{context}, epoll_{std::move(epoll)}, wake_{std::move(wake)} {
  addTo(epoll_.get(), wake_.get(), EPOLLIN);
  watchLibusb();
}

void Context::watchLibusb() {
  libusb_set_pollfd_notifiers(context_, onAdded, onRemoved, this);
  const auto** const descriptors = libusb_get_pollfds(context_);
  if (descriptors == nullptr) return;
  for (auto at = descriptors; *at != nullptr; ++at) addTo(epoll_.get(), (*at)->fd, (*at)->events);
  libusb_free_pollfds(descriptors);
}

Context::~Context() {
  libusb_set_pollfd_notifiers(context_, nullptr, nullptr, nullptr);
  libusb_exit(context_);
}

void Context::handle() {
  handleWithin(0);
}

void Context::handleWithin(int milliseconds) {
  timeval limit{milliseconds / 1000, (milliseconds % 1000) * 1000};
  libusb_handle_events_timeout_completed(context_, &limit, nullptr);
}

void Context::attention(int change) {
  const bool before = attention_ > 0;
  attention_ += change;
  if (before == (attention_ > 0)) return;
  eventfd_t count = 0;
  if (before) {
    eventfd_read(wake_.get(), &count);
  } else {
    eventfd_write(wake_.get(), 1);
  }
}

}  // namespace probebox::usb_host
