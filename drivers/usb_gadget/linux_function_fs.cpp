#include "drivers/usb_gadget/linux_function_fs.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <linux/usb/ch9.h>
#include <linux/usb/functionfs.h>
#include <span>
#include <unistd.h>

namespace probebox::usb_gadget {
namespace {

namespace fs = std::filesystem;

constexpr const char* kSetUp = "run probebox-usb-setup as root (the service probebox-usb does so), then try again";

Error failure(const fs::path& what, int code) {
  switch (code) {
    case ENOENT:
      return {what.string() + " is not there: FunctionFS is not mounted; " + kSetUp};
    case EACCES:
    case EPERM:
      return {what.string() + " may not be opened by this user; " + kSetUp +
              ", with --user naming the user of the box"};
    case EBUSY:
    case ESRCH:  // it plays its function already and expects no descriptors
      return {what.string() + " is held by another process; stop the other probeboxd"};
    default:
      return {what.string() + ": " + std::strerror(code) + "; " + kSetUp};
  }
}

bool writeWhole(int fd, std::span<const std::byte> bytes) {
  return ::write(fd, bytes.data(), bytes.size()) == static_cast<ssize_t>(bytes.size());
}

std::optional<BusEvent> busEvent(std::uint8_t type) {
  switch (type) {
    case FUNCTIONFS_BIND:
      return BusEvent::bound;
    case FUNCTIONFS_UNBIND:
      return BusEvent::unbound;
    case FUNCTIONFS_ENABLE:
      return BusEvent::enabled;
    case FUNCTIONFS_DISABLE:
      return BusEvent::disabled;
    case FUNCTIONFS_SUSPEND:
      return BusEvent::suspended;
    case FUNCTIONFS_RESUME:
      return BusEvent::resumed;
    default:
      return std::nullopt;
  }
}

std::string firstController() {
  std::error_code error;
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator{"/sys/class/udc", error}) names.push_back(entry.path().filename());
  return names.empty() ? std::string{} : *std::ranges::min_element(names);
}

}  // namespace

Outcome<std::unique_ptr<FunctionFs>> FunctionFs::open(const fs::path& mount, const Function& function) {
  std::unique_ptr<FunctionFs> opened{new FunctionFs};
  const auto ep0 = mount / "ep0";
  opened->ep0_ = io::Descriptor{::open(ep0.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC)};
  if (!opened->ep0_) return failure(ep0, errno);
  if (!writeWhole(opened->ep0_.get(), descriptorsOf(function)) || !writeWhole(opened->ep0_.get(), stringsOf(function)))
    return failure(ep0, errno);
  for (std::size_t k = 0; k < function.endpoints.size(); ++k) {
    const auto path = mount / ("ep" + std::to_string(k + 1));
    // Without O_NONBLOCK a transfer for an endpoint that is not enabled would wait until it is.
    const int access = function.endpoints[k] == Direction::in ? O_WRONLY : O_RDONLY;
    opened->endpoints_.emplace_back(::open(path.c_str(), access | O_NONBLOCK | O_CLOEXEC));
    if (!opened->endpoints_.back()) return failure(path, errno);
  }
  return opened;
}

std::optional<BusEvent> FunctionFs::next() {
  usb_functionfs_event event{};
  while (::read(ep0_.get(), &event, sizeof event) == static_cast<ssize_t>(sizeof event)) {
    if (event.type == FUNCTIONFS_SETUP) {
      stall((event.u.setup.bRequestType & USB_DIR_IN) != 0);
    } else if (const auto happened = busEvent(event.type)) {
      return happened;
    }
  }
  return std::nullopt;
}

// A transfer in the direction that was not asked for is how FunctionFS is told to stall.
void FunctionFs::stall(bool towards_host) {
  std::byte nothing{};
  const ssize_t refused = towards_host ? ::read(ep0_.get(), &nothing, 0) : ::write(ep0_.get(), &nothing, 0);
  if (refused < 0) ++stalled_requests_;
}

Outcome<void> bindGadget(const fs::path& gadget, const std::string& controller) {
  const auto name = controller.empty() ? firstController() : controller;
  if (name.empty())
    return Error{
        "there is no USB device controller (nothing in /sys/class/udc); is its driver loaded, and the port in "
        "peripheral mode?"};
  const auto attribute = gadget / "UDC";
  const io::Descriptor file{::open(attribute.c_str(), O_WRONLY | O_CLOEXEC)};
  if (!file) return failure(attribute, errno);
  if (::write(file.get(), name.data(), name.size()) == static_cast<ssize_t>(name.size())) return {};
  switch (errno) {
    case EBUSY:
      return Error{attribute.string() + ": the gadget is bound already, or " + name +
                   " is taken by another gadget; unbind that one (ls /sys/kernel/config/usb_gadget)"};
    case ENODEV:
      return Error{attribute.string() + ": there is no USB device controller " + name + "; /sys/class/udc lists them"};
    default:
      return failure(attribute, errno);
  }
}

}  // namespace probebox::usb_gadget
