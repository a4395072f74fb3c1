#include "mock_chip.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <mutex>
#include <span>
#include <stdexcept>
#include <sys/socket.h>
#include <time.h>
#include <umockdev.h>
#include <unistd.h>
#include <utility>

namespace probebox::gpio {
namespace {

constexpr const char* kLineNode = "/dev/gpioline";
constexpr std::size_t kRequests = 4;  // how often the lines can be asked for in one test
constexpr const char* kDevices =
    "P: /devices/gpiochip7\nN: gpiochip7\nE: DEVNAME=/dev/gpiochip7\nE: SUBSYSTEM=gpio\nA: dev=254:7\\n\n\n"
    "P: /devices/gpioline\nN: gpioline\nE: DEVNAME=/dev/gpioline\nE: SUBSYSTEM=gpio\nA: dev=254:99\\n\n";

template <std::size_t size>
void copyText(char (&to)[size], const std::string& text) {
  std::strncpy(to, text.c_str(), size - 1);
}

// Answers one ioctl by changing the struct that the caller passed; 0 or an errno.
template <typename Struct, typename Answer>
int answered(UMockdevIoctlClient* client, Answer answer) {
  auto* const data = umockdev_ioctl_data_resolve(umockdev_ioctl_client_get_arg(client), 0, sizeof(Struct), nullptr);
  if (data == nullptr) return EFAULT;
  Struct value{};
  std::memcpy(&value, data->data, sizeof(value));
  const int code = answer(value);
  std::array<guint8, sizeof(Struct)> bytes{};
  std::memcpy(bytes.data(), &value, sizeof(value));
  if (code == 0) umockdev_ioctl_data_update(data, 0, bytes.data(), static_cast<gint>(bytes.size()));
  g_object_unref(data);
  return code;
}

class UmockdevChip final : public MockChip {
 public:
  explicit UmockdevChip(std::vector<Line> lines) : lines_{std::move(lines)}, bed_{umockdev_testbed_new()} {
    auto* const root = umockdev_testbed_get_root_dir(bed_);
    node_ = std::string{root} + kNode;
    g_free(root);
    if (!umockdev_testbed_add_from_string(bed_, kDevices, nullptr)) throw std::runtime_error{"no mock device"};
    linkToBus("gpiochip7");
    g_signal_connect_data(handler_, "handle-ioctl", reinterpret_cast<GCallback>(&UmockdevChip::onIoctl), this, nullptr,
                          GConnectFlags{});
    g_signal_connect_data(handler_, "handle-read", reinterpret_cast<GCallback>(&UmockdevChip::onRead), this, nullptr,
                          GConnectFlags{});
    umockdev_testbed_attach_ioctl(bed_, kNode, handler_, nullptr);
    umockdev_testbed_attach_ioctl(bed_, kLineNode, handler_, nullptr);
    for (auto& [driver_fd, wire_fd] : requests_) openRequest(driver_fd, wire_fd);
  }

  ~UmockdevChip() override {
    for (std::size_t i = 0; i < kRequests; ++i) {
      if (i >= used_) close(requests_[i].first);  // the others are the driver's
      if (requests_[i].second >= 0) close(requests_[i].second);
    }
    umockdev_testbed_detach_ioctl(bed_, kNode, nullptr);
    umockdev_testbed_detach_ioctl(bed_, kLineNode, nullptr);
    g_object_unref(bed_);
    g_object_unref(handler_);
  }

  void setLevel(unsigned offset, bool high) override {
    const std::lock_guard lock{mutex_};
    lines_[offset].high = high;
  }

  void tell(unsigned offset, bool rising, std::uint64_t timestamp_ns, std::uint32_t line_sequence) override {
    gpio_v2_line_event event{};
    event.timestamp_ns = timestamp_ns;
    event.id = rising ? GPIO_V2_LINE_EVENT_RISING_EDGE : GPIO_V2_LINE_EVENT_FALLING_EDGE;
    event.offset = offset;
    event.seqno = ++sequence_;
    event.line_seqno = line_sequence;
    if (send(wire(), &event, sizeof(event), MSG_NOSIGNAL) != sizeof(event)) throw std::runtime_error{"nobody listens"};
  }

  void join(Lateness late_ns) override {
    const std::lock_guard lock{mutex_};
    late_ns_ = std::move(late_ns);
  }

  int risesDriven() const override {
    const std::lock_guard lock{mutex_};
    return rises_driven_;
  }

  void unplug(int code) override {
    std::filesystem::rename(node_, node_ + ".away");
    {
      const std::lock_guard lock{mutex_};
      read_failure_ = code;
    }
    if (code == 0) close(std::exchange(requests_[used_ - 1].second, -1));
  }

  void plugIn() override {
    std::filesystem::rename(node_ + ".away", node_);
    const std::lock_guard lock{mutex_};
    read_failure_ = 0;
  }

  gpio_v2_line_request request() const override {
    const std::lock_guard lock{mutex_};
    return request_;
  }

 private:
  // libgpiod knows a gpio chip by its bus.
  void linkToBus(const std::string& device) {
    const std::filesystem::path sys = std::filesystem::path{node_}.parent_path().parent_path() / "sys";
    std::filesystem::create_directories(sys / "bus/gpio");
    std::filesystem::remove(sys / "devices" / device / "subsystem");
    std::filesystem::create_symlink("../../bus/gpio", sys / "devices" / device / "subsystem");
  }

  // A socket behind a descriptor that was opened as a device: its ioctls come to the handler, its reads to the socket.
  static void openRequest(int& driver_fd, int& wire_fd) {
    std::array<int, 2> ends{};
    driver_fd = open(kLineNode, O_RDWR);
    if (driver_fd < 0 || socketpair(AF_UNIX, SOCK_STREAM, 0, ends.data()) != 0) {
      throw std::runtime_error{"no mock descriptor for lines"};
    }
    dup2(ends[0], driver_fd);
    close(ends[0]);
    wire_fd = ends[1];
  }

  int wire() const {
    const std::lock_guard lock{mutex_};
    return used_ == 0 ? -1 : requests_[used_ - 1].second;
  }

  static gboolean onIoctl(UMockdevIoctlBase*, UMockdevIoctlClient* client, gpointer self) {
    const int code = static_cast<UmockdevChip*>(self)->ioctl(client);
    umockdev_ioctl_client_complete(client, code == 0 ? 0 : -1, code);
    return TRUE;
  }

  static gboolean onRead(UMockdevIoctlBase*, UMockdevIoctlClient* client, gpointer self) {
    auto* const chip = static_cast<UmockdevChip*>(self);
    const std::lock_guard lock{chip->mutex_};
    if (chip->read_failure_ == 0) return FALSE;
    umockdev_ioctl_client_complete(client, -1, chip->read_failure_);
    return TRUE;
  }

  int ioctl(UMockdevIoctlClient* client) {
    const std::lock_guard lock{mutex_};
    switch (umockdev_ioctl_client_get_request(client)) {
      case GPIO_GET_CHIPINFO_IOCTL:
        return answered<gpiochip_info>(client, [this](gpiochip_info& info) {
          copyText(info.name, "gpiochip7");
          copyText(info.label, kLabel);
          info.lines = static_cast<__u32>(lines_.size());
          return 0;
        });
      case GPIO_V2_GET_LINEINFO_IOCTL:
        return answered<gpio_v2_line_info>(client, [this](gpio_v2_line_info& info) { return describe(info); });
      case GPIO_V2_GET_LINE_IOCTL:
        return answered<gpio_v2_line_request>(client, [this](gpio_v2_line_request& wanted) { return take(wanted); });
      case GPIO_V2_LINE_GET_VALUES_IOCTL:
        return answered<gpio_v2_line_values>(client, [this](gpio_v2_line_values& values) { return measure(values); });
      case GPIO_V2_LINE_SET_VALUES_IOCTL:
        return answered<gpio_v2_line_values>(client, [this](gpio_v2_line_values& values) { return drive(values); });
      default:
        return ENOTTY;
    }
  }

  int describe(gpio_v2_line_info& info) const {
    if (info.offset >= lines_.size()) return EINVAL;
    const auto& line = lines_[info.offset];
    copyText(info.name, line.name);
    copyText(info.consumer, line.held_by);
    info.flags = GPIO_V2_LINE_FLAG_INPUT | (line.held_by.empty() ? 0U : unsigned{GPIO_V2_LINE_FLAG_USED});
    return 0;
  }

  int take(gpio_v2_line_request& wanted) {
    const std::span offsets{wanted.offsets, wanted.num_lines};
    for (const auto offset : offsets) {
      if (offset >= lines_.size()) return EINVAL;
      if (!lines_[offset].held_by.empty()) return EBUSY;
    }
    if (used_ == kRequests) return EMFILE;
    request_ = wanted;
    if ((flagsOf(wanted) & GPIO_V2_LINE_FLAG_OUTPUT) != 0) output_flags_ = flagsOf(wanted);
    wanted.fd = requests_[used_++].first;
    return 0;
  }

  int measure(gpio_v2_line_values& values) const {
    values.bits = 0;
    for (unsigned i = 0; i < request_.num_lines; ++i) {
      const auto bit = __u64{1} << i;
      if ((values.mask & bit) != 0 && lines_[request_.offsets[i]].high) values.bits |= bit;
    }
    return 0;
  }

  // Of a request for one line.
  static std::uint64_t flagsOf(const gpio_v2_line_request& wanted) {
    for (unsigned a = 0; a < wanted.config.num_attrs; ++a) {
      const auto& [attribute, mask] = wanted.config.attrs[a];
      if (attribute.id == GPIO_V2_LINE_ATTR_ID_FLAGS && (mask & 1U) != 0) return attribute.flags;
    }
    return wanted.config.flags;
  }

  int drive(const gpio_v2_line_values& values) {
    const bool high = ((values.bits & 1U) != 0) != ((output_flags_ & GPIO_V2_LINE_FLAG_ACTIVE_LOW) != 0);
    rises_driven_ += high ? 1 : 0;
    const std::uint64_t asked = high ? GPIO_V2_LINE_FLAG_EDGE_RISING : GPIO_V2_LINE_FLAG_EDGE_FALLING;
    if (!late_ns_ || (flagsOf(request_) & asked) == 0) return 0;
    const auto late_ns = late_ns_();
    if (!late_ns) return 0;
    timespec now{};
    clock_gettime(CLOCK_MONOTONIC, &now);
    gpio_v2_line_event event{};
    event.timestamp_ns = static_cast<__u64>(now.tv_sec * 1'000'000'000 + now.tv_nsec + *late_ns);
    event.id = high ? GPIO_V2_LINE_EVENT_RISING_EDGE : GPIO_V2_LINE_EVENT_FALLING_EDGE;
    event.offset = request_.offsets[0];
    const auto sent = send(requests_[used_ - 1].second, &event, sizeof(event), MSG_NOSIGNAL);
    return sent == sizeof(event) ? 0 : EIO;
  }

  mutable std::mutex mutex_;  // the handler answers on a thread of its own
  std::vector<Line> lines_;
  UMockdevTestbed* bed_;
  UMockdevIoctlBase* handler_{umockdev_ioctl_base_new()};
  std::string node_;  // where the mocked node is in truth
  std::array<std::pair<int, int>, kRequests> requests_{};
  std::size_t used_{};
  gpio_v2_line_request request_{};
  std::uint64_t output_flags_{};
  Lateness late_ns_;
  int rises_driven_{};
  std::uint32_t sequence_{};
  int read_failure_{};
};

}  // namespace

std::unique_ptr<MockChip> makeMockChip(std::vector<MockChip::Line> lines) {
  return std::make_unique<UmockdevChip>(std::move(lines));
}

}  // namespace probebox::gpio
