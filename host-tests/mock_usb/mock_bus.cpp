#include "host-tests/mock_usb/mock_bus.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <linux/usbdevice_fs.h>
#include <map>
#include <mutex>
#include <stdexcept>
#include <sys/ioctl.h>
#include <system_error>
#include <umockdev.h>
#include <utility>

#include "host-tests/mock_usb/mock_file.hpp"

namespace probebox::usb {
namespace {

namespace fs = std::filesystem;

std::string printed(const char* format, auto... values) {
  std::array<char, 128> text{};
  std::snprintf(text.data(), text.size(), format, values...);
  return text.data();
}

std::string nodeOf(const MockBus::Device& device) {
  return printed("/dev/bus/usb/001/%03u", unsigned{device.address});
}

// 1209:0001, of class per interface, with three strings and one configuration.
constexpr const char* kDeviceDescriptor = "120100020000004009120100000101020301";

// In hexadecimal, as umockdev takes it.
std::string descriptorsOf(const MockBus::Device& device) {
  const auto& [interface_class, subclass, protocol] = device.interface_class;
  const auto count = static_cast<unsigned>(device.endpoints.size());
  std::string all = kDeviceDescriptor;
  all += printed("0902%02x00010100c032", 9 + 9 + 7 * count);
  all +=
      printed("09040000%02x%02x%02x%02x00", count, unsigned{interface_class}, unsigned{subclass}, unsigned{protocol});
  for (const auto address : device.endpoints) all += printed("0705%02x02000200", unsigned{address});  // bulk, 512 bytes
  return all;
}

// As umockdev reads it; the numbers of the node follow from bus and address.
std::string recordOf(const MockBus::Device& device) {
  const unsigned address = device.address;
  std::string all = "P: /devices/usb1/" + device.path + "\nN: " + nodeOf(device).substr(5) + "\n";
  all += "E: SUBSYSTEM=usb\nE: DEVTYPE=usb_device\nE: DRIVER=usb\nE: DEVNAME=" + nodeOf(device) + "\n";
  all += printed("E: BUSNUM=001\nE: DEVNUM=%03u\nA: dev=189:%u\\n\nA: busnum=1\\n\nA: devnum=%u\\n\n", address,
                 address - 1, address);
  all += "A: bConfigurationValue=1\\n\nA: speed=480\\n\n";
  if (!device.serial_number.empty()) all += "A: serial=" + device.serial_number + "\\n\n";
  all += "A: product=" + device.product + "\\n\n";
  return all + "H: descriptors=" + descriptorsOf(device) + "\n";
}

class UmockdevBus final : public MockBus {
  struct Plugged {
    Device device;
    MockFile file;
  };

  auto with(const std::string& path, auto action) -> decltype(action(std::declval<MockFile&>())) {
    const std::lock_guard lock{mutex_};
    const auto found = plugged_.find(path);
    if (found == plugged_.end()) return decltype(action(std::declval<MockFile&>()))();
    return action(found->second->file);
  }
  const Device& deviceAt(const std::string& path) const { return plugged_.at(path)->device; }

 public:
  UmockdevBus() : bed_{umockdev_testbed_new()} {
    auto* const root = umockdev_testbed_get_root_dir(bed_);
    root_ = root;
    g_free(root);
    fs::permissions(root_, fs::perms::all);  // for users other than the one who runs the tests
    g_signal_connect_data(handler_, "handle-ioctl", reinterpret_cast<GCallback>(&UmockdevBus::onIoctl), this, nullptr,
                          GConnectFlags{});
  }

  ~UmockdevBus() override {
    while (!plugged_.empty()) unplug(plugged_.begin()->first);
    while (!unplugged_.empty()) forget(nodeOf(unplugged_.back()->device));
    g_object_unref(bed_);
    g_object_unref(handler_);
  }

  // Everything is there before the uevent says so: a host that waits for the device is fast.
  void plug(const Device& device) override {
    forget(nodeOf(device));
    {
      const std::lock_guard lock{mutex_};
      plugged_[device.path] = std::make_unique<Plugged>();
      plugged_[device.path]->device = device;
      plugged_[device.path]->file.control = device.control;
    }
    fs::create_directories(interfaceOf(device));
    fs::create_directories(root_ + "/sys/bus/usb/devices");
    fs::create_directory_symlink(interfaceOf(device), root_ + "/sys/bus/usb/devices/" + device.path + ":1.0");
    if (!device.held_by.empty()) claimElsewhere(device.path, device.held_by);
    if (!umockdev_testbed_attach_ioctl(bed_, nodeOf(device).c_str(), handler_, nullptr) ||
        !umockdev_testbed_add_from_string(bed_, recordOf(device).c_str(), nullptr)) {
      throw std::runtime_error{"no mock device"};
    }
  }

  // As the kernel does it: first the transfers, then the device, then its event. Whoever has the node open keeps what
  // is behind it.
  void unplug(const std::string& path) override {
    with(path, [](MockFile& file) { file.unplugged(); });
    fs::remove(root_ + "/sys/bus/usb/devices/" + path + ":1.0");
    umockdev_testbed_uevent(bed_, ("/sys/devices/usb1/" + path).c_str(), "remove");
    umockdev_testbed_remove_device(bed_, ("/sys/devices/usb1/" + path).c_str());
    const std::lock_guard lock{mutex_};
    unplugged_.push_back(std::move(plugged_.at(path)));
    plugged_.erase(path);
  }

  void send(const std::string& path, std::uint8_t endpoint, std::span<const std::byte> bytes) override {
    with(path, [&](MockFile& file) { file.send(endpoint, bytes); });
  }
  std::size_t waiting(const std::string& path, std::uint8_t endpoint) override {
    return with(path, [&](MockFile& file) { return file.waiting(endpoint); });
  }
  std::vector<std::byte> received(const std::string& path, std::uint8_t endpoint) override {
    return with(path, [&](MockFile& file) { return file.received(endpoint); });
  }
  void stopReading(const std::string& path, std::uint8_t endpoint) override {
    with(path, [&](MockFile& file) { file.setReading(endpoint, false); });
  }
  void readAgain(const std::string& path, std::uint8_t endpoint) override {
    with(path, [&](MockFile& file) { file.setReading(endpoint, true); });
  }
  void spoil(const std::string& path, std::uint8_t endpoint, int status) override {
    with(path, [&](MockFile& file) { file.spoil(endpoint, status); });
  }
  void freeze(const std::string& path) override {
    with(path, [](MockFile& file) { file.frozen = true; });
  }
  std::size_t inFlight(const std::string& path, std::uint8_t endpoint) override {
    return with(path, [&](MockFile& file) { return file.inFlight(endpoint); });
  }
  std::size_t endless(const std::string& path) override {
    return with(path, [](const MockFile& file) { return file.endless; });
  }
  std::size_t resets(const std::string& path) override {
    return with(path, [](const MockFile& file) { return file.resets; });
  }
  std::size_t session(const std::string& path) override {
    return with(path, [](const MockFile& file) { return file.session; });
  }
  bool claimed(const std::string& path) override {
    return with(path, [](const MockFile& file) { return file.claimed; });
  }

  void claimElsewhere(const std::string& path, const std::string& driver) override {
    with(path, [&](MockFile& file) { file.held_by = driver; });
    const auto drivers = root_ + "/sys/bus/usb/drivers/";
    fs::create_directories(drivers + driver);
    fs::create_directory_symlink(drivers + driver, interfaceOf(deviceAt(path)) + "/driver");
  }
  // umockdev's own socket for the node has to be open to all: it ends the process of those whom it does not let in.
  void setMode(const std::string& path, unsigned mode) override {
    const auto node = nodeOf(deviceAt(path));
    fs::permissions(root_ + node, static_cast<fs::perms>(mode));
    fs::permissions(root_ + "/ioctl" + node, fs::perms::all);
  }

 private:
  std::string interfaceOf(const Device& device) const {
    return root_ + "/sys/devices/usb1/" + device.path + "/" + device.path + ":1.0";
  }

  static gboolean onIoctl(UMockdevIoctlBase*, UMockdevIoctlClient* client, gpointer self) {
    const int code = static_cast<UmockdevBus*>(self)->ioctl(client);
    umockdev_ioctl_client_complete(client, code == 0 ? 0 : -1, code);
    return TRUE;
  }

  // The host runs in this process, and waits: what its arguments point to can be used as it is.
  int ioctl(UMockdevIoctlClient* client) {
    const std::lock_guard lock{mutex_};
    auto* const plugged = withNode(umockdev_ioctl_client_get_devnode(client));
    if (plugged == nullptr) return ENODEV;
    auto* argument = static_cast<void*>(nullptr);
    std::memcpy(&argument, umockdev_ioctl_client_get_arg(client)->data, sizeof argument);
    auto& file = plugged->file;
    switch (umockdev_ioctl_client_get_request(client)) {
      case USBDEVFS_GET_CAPABILITIES:
        *static_cast<std::uint32_t*>(argument) = USBDEVFS_CAP_ZERO_PACKET | USBDEVFS_CAP_BULK_CONTINUATION |
                                                 USBDEVFS_CAP_NO_PACKET_SIZE_LIM | USBDEVFS_CAP_BULK_SCATTER_GATHER |
                                                 USBDEVFS_CAP_REAP_AFTER_DISCONNECT;
        file.opened(newestDescriptorOf(plugged->device));
        return 0;
      case USBDEVFS_CLAIMINTERFACE:
        return file.claim();
      case USBDEVFS_RELEASEINTERFACE:
        return file.release();
      case USBDEVFS_SETINTERFACE:
        return file.selectAlternate(++sessions_);
      case USBDEVFS_SUBMITURB:
        return file.submit(*static_cast<usbdevfs_urb*>(argument));
      case USBDEVFS_REAPURB:
      case USBDEVFS_REAPURBNDELAY:
        return file.reap(*static_cast<usbdevfs_urb**>(argument));
      case USBDEVFS_DISCARDURB:
        return file.discard(static_cast<usbdevfs_urb*>(argument));
      default:
        return ENOTTY;
    }
  }

  Plugged* withNode(const std::string& node) {
    for (auto& [path, plugged] : plugged_) {
      if (nodeOf(plugged->device) == node) return plugged.get();
    }
    const auto found = std::ranges::find(unplugged_, node, [](const auto& p) { return nodeOf(p->device); });
    return found == unplugged_.end() ? nullptr : found->get();
  }

  void forget(const std::string& node) {
    const auto found = std::ranges::find(unplugged_, node, [](const auto& p) { return nodeOf(p->device); });
    if (found == unplugged_.end()) return;
    umockdev_testbed_detach_ioctl(bed_, node.c_str(), nullptr);
    const std::lock_guard lock{mutex_};
    unplugged_.erase(found);
  }

  // Asking for capabilities is the first thing that libusb does with a node. Those opened before are pipes by now. The
  // device may have been unplugged since it was opened: its node is deleted then.
  int newestDescriptorOf(const Device& device) const {
    std::error_code gone;
    const auto node = root_ + nodeOf(device);
    for (const auto& entry : fs::directory_iterator{"/proc/self/fd"}) {
      const auto target = fs::read_symlink(entry.path(), gone);
      if (target == node || target == node + " (deleted)") return std::stoi(entry.path().filename());
    }
    throw std::runtime_error{"nobody has the mocked node open"};
  }

  mutable std::mutex mutex_;                                 // the handler answers on a thread of its own
  std::map<std::string, std::unique_ptr<Plugged>> plugged_;  // by path
  std::vector<std::unique_ptr<Plugged>> unplugged_;
  UMockdevTestbed* bed_;
  UMockdevIoctlBase* handler_{umockdev_ioctl_base_new()};
  std::string root_;
  std::size_t sessions_{};
};

}  // namespace

std::unique_ptr<MockBus> makeMockBus() {
  return std::make_unique<UmockdevBus>();
}

}  // namespace probebox::usb
