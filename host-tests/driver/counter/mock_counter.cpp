#include "mock_counter.hpp"

#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <stdexcept>
#include <sys/stat.h>
#include <umockdev.h>
#include <unistd.h>

namespace probebox::counter {
namespace {

constexpr const char* kNode = "/dev/counter3";
constexpr const char* kDevice =
    "P: /devices/counter3\nN: counter3\nE: DEVNAME=/dev/counter3\nE: SUBSYSTEM=counter\nA: dev=240:3\\n\n"
    "A: name=48300180.counter\\n\n";

class UmockdevCounter final : public MockCounter {
 public:
  UmockdevCounter() : bed_{umockdev_testbed_new()} {
    auto* const root = umockdev_testbed_get_root_dir(bed_);
    root_ = root;
    g_free(root);
    if (!umockdev_testbed_add_from_string(bed_, kDevice, nullptr)) throw std::runtime_error{"no mock device"};
    std::filesystem::create_directories(count());
    for (const auto& [name, text] : {std::pair{"count", "0"},
                                     {"function", "quadrature x4"},
                                     {"enable", "1"},
                                     {"ceiling", "4294967295"},
                                     {"count_mode", "normal"}})
      set(name, text);
    openNode();
    g_signal_connect_data(handler_, "handle-ioctl", reinterpret_cast<GCallback>(&UmockdevCounter::onIoctl), this,
                          nullptr, GConnectFlags{});
    g_signal_connect_data(handler_, "handle-read", reinterpret_cast<GCallback>(&UmockdevCounter::onRead), this, nullptr,
                          GConnectFlags{});
    umockdev_testbed_attach_ioctl(bed_, kNode, handler_, nullptr);
  }

  ~UmockdevCounter() override {
    umockdev_testbed_detach_ioctl(bed_, kNode, nullptr);
    if (queue_ >= 0) close(queue_);
    g_object_unref(bed_);
    g_object_unref(handler_);
  }

  // The file stays the same one, as in sysfs: whoever has it open reads the new text.
  void set(const std::string& attribute, const std::string& text) override {
    std::ofstream{count() / attribute} << text << "\n";
  }

  void push(const counter_event& event) override {
    if (write(queue_, &event, sizeof(event)) != sizeof(event)) throw std::runtime_error{"nobody listens"};
  }

  void refuseWatches(int code) override {
    const std::lock_guard lock{mutex_};
    refusal_ = code;
  }

  std::vector<counter_watch> watches() const override {
    const std::lock_guard lock{mutex_};
    return enabled_;
  }

  void unplug() override {
    std::ofstream{count() / "count"}.flush();  // whoever has it open reads nothing
    std::filesystem::rename(devices() / "counter3", root_ / "away");
    const std::lock_guard lock{mutex_};
    is_gone_ = true;
  }

  void plugIn() override {
    std::filesystem::rename(root_ / "away", devices() / "counter3");
    set("count", "0");
    const std::lock_guard lock{mutex_};
    is_gone_ = false;
  }

 private:
  std::filesystem::path devices() const { return root_ / "sys/bus/counter/devices"; }
  std::filesystem::path count() const { return root_ / "sys/devices/counter3/count0"; }

  // A regular file cannot be waited for.
  void openNode() {
    const auto node = root_ / "dev/counter3";
    std::filesystem::remove(node);
    if (mkfifo(node.c_str(), 0600) != 0) throw std::runtime_error{"no mock node"};
    queue_ = open(node.c_str(), O_RDWR | O_NONBLOCK);
    if (queue_ < 0) throw std::runtime_error{"no mock queue"};
  }

  static gboolean onIoctl(UMockdevIoctlBase*, UMockdevIoctlClient* client, gpointer self) {
    const int code = static_cast<UmockdevCounter*>(self)->ioctl(client);
    umockdev_ioctl_client_complete(client, code == 0 ? 0 : -1, code);
    return TRUE;
  }

  static gboolean onRead(UMockdevIoctlBase*, UMockdevIoctlClient* client, gpointer self) {
    auto* const counter = static_cast<UmockdevCounter*>(self);
    const std::lock_guard lock{counter->mutex_};
    if (!counter->is_gone_) return FALSE;
    umockdev_ioctl_client_complete(client, -1, ENODEV);
    return TRUE;
  }

  int ioctl(UMockdevIoctlClient* client) {
    const std::lock_guard lock{mutex_};
    switch (umockdev_ioctl_client_get_request(client)) {
      case COUNTER_ADD_WATCH_IOCTL:
        return addWatch(client);
      case COUNTER_ENABLE_EVENTS_IOCTL:
        enabled_ = std::move(added_);
        added_.clear();
        return 0;
      default:
        return ENOTTY;
    }
  }

  int addWatch(UMockdevIoctlClient* client) {
    if (refusal_ != 0) return refusal_;
    auto* const data =
        umockdev_ioctl_data_resolve(umockdev_ioctl_client_get_arg(client), 0, sizeof(counter_watch), nullptr);
    if (data == nullptr) return EFAULT;
    counter_watch watch{};
    std::memcpy(&watch, data->data, sizeof(watch));
    added_.push_back(watch);
    g_object_unref(data);
    return 0;
  }

  mutable std::mutex mutex_;  // the handler answers on a thread of its own
  UMockdevTestbed* bed_;
  UMockdevIoctlBase* handler_{umockdev_ioctl_base_new()};
  std::filesystem::path root_;
  int queue_{-1};
  int refusal_{};
  bool is_gone_{};
  std::vector<counter_watch> added_, enabled_;
};

}  // namespace

std::unique_ptr<MockCounter> makeMockCounter() {
  return std::make_unique<UmockdevCounter>();
}

}  // namespace probebox::counter
