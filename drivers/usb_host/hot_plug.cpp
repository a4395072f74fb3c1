#include "drivers/usb_host/hot_plug.hpp"

#include <algorithm>
#include <libusb.h>
#include <sys/epoll.h>
#include <sys/timerfd.h>
#include <unistd.h>
#include <utility>

#include "drivers/usb_host/linux_sysfs.hpp"

namespace probebox::usb_host {
namespace {

constexpr itimerspec kLookPeriod{{0, 500'000'000}, {0, 500'000'000}};

// The address is another one after each plugging in, so a device that was re-plugged in between is seen as such.
bool same(const Device& a, const Device& b) {
  return a.bus == b.bus && a.address == b.address && a.path == b.path;
}

bool contains(const std::vector<Device>& all, const Device& wanted) {
  return std::ranges::any_of(all, [&](const Device& device) { return same(device, wanted); });
}

}  // namespace

// With libusb, which calls back from Context::handle().
struct HotPlug::Registration {
  explicit Registration(std::shared_ptr<Context> of) : context{std::move(of)} {
    constexpr int kBoth = LIBUSB_HOTPLUG_EVENT_DEVICE_ARRIVED | LIBUSB_HOTPLUG_EVENT_DEVICE_LEFT;
    constexpr int kAny = LIBUSB_HOTPLUG_MATCH_ANY;
    works = libusb_hotplug_register_callback(context->get(), kBoth, 0, kAny, kAny, kAny, onChange, this, &handle) ==
            LIBUSB_SUCCESS;
  }
  ~Registration() {
    if (works) libusb_hotplug_deregister_callback(context->get(), handle);
  }
  Registration(const Registration&) = delete;
  Registration& operator=(const Registration&) = delete;

  static int LIBUSB_CALL onChange(libusb_context*, libusb_device*, libusb_hotplug_event, void* registration) {
    static_cast<Registration*>(registration)->changed = true;
    return 0;  // go on
  }

  std::shared_ptr<Context> context;
  libusb_hotplug_callback_handle handle{};
  bool works{};
  bool changed{};
};

// Without udev, libusb finds what is there when a context is opened, and hears nothing afterwards.
HotPlug::News HotPlug::possibleHere() {
  return libusb_has_capability(LIBUSB_CAP_HAS_HOTPLUG) != 0 && sysfs::udevRuns() ? News::told : News::looked_for;
}

Outcome<std::unique_ptr<HotPlug>, OpenError> HotPlug::watch(const usb::InterfaceClass& wanted, News news) {
  TRY(auto context, Context::open());
  return std::unique_ptr<HotPlug>{new HotPlug{wanted, std::move(context), news}};
}

HotPlug::HotPlug(const usb::InterfaceClass& wanted, std::shared_ptr<Context> context, News news)
    : wanted_{wanted}, context_{std::move(context)}, epoll_{epoll_create1(EPOLL_CLOEXEC)} {
  if (news == News::told) told_ = std::make_unique<Registration>(context_);
  if (told_ && !told_->works) told_.reset();
  epoll_event readable{};
  readable.events = EPOLLIN;
  int watched = context_->descriptor();
  if (!told_) {
    timer_ = io::Descriptor{timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK | TFD_CLOEXEC)};
    timerfd_settime(timer_.get(), 0, &kLookPeriod, nullptr);
    watched = timer_.get();
  }
  epoll_ctl(epoll_.get(), EPOLL_CTL_ADD, watched, &readable);
}

HotPlug::~HotPlug() = default;

bool HotPlug::lookAgain() {
  if (std::exchange(first_, false)) return true;
  if (told_) {
    context_->handle();
    return std::exchange(told_->changed, false);
  }
  std::uint64_t expirations = 0;
  if (::read(timer_.get(), &expirations, sizeof expirations) <= 0) return false;
  auto fresh = Context::open();
  if (fresh) context_ = std::move(*fresh);
  return fresh.ok();
}

std::vector<PlugEvent> HotPlug::poll() {
  std::vector<PlugEvent> events;
  if (!lookAgain()) return events;
  auto now = devices(context_, wanted_);
  for (const auto& device : there_) {
    if (!contains(now, device)) events.push_back({PlugEvent::Kind::left, device});
  }
  for (const auto& device : now) {
    if (!contains(there_, device)) events.push_back({PlugEvent::Kind::arrived, device});
  }
  there_ = std::move(now);
  return events;
}

}  // namespace probebox::usb_host
