#include "bare_pump.hpp"

#include <array>
#include <atomic>
#include <chrono>
#include <libaio.h>
#include <libusb.h>
#include <poll.h>
#include <stdexcept>
#include <sys/eventfd.h>
#include <thread>
#include <unistd.h>
#include <vector>

#include "drivers/usb_gadget/linux_function_fs.hpp"
#include "usb_gadget.hpp"

namespace probebox::vm {
namespace {

constexpr std::size_t kDeviceTransfers = 8;
constexpr std::size_t kHostTransfers = 16, kHostBytes = 32 * 1024;

void need(bool good, const char* what) {
  if (!good) throw std::runtime_error{what};
}

class Device {
 public:
  explicit Device(std::size_t transfer_bytes) : function_{open()} {
    need(io_setup(kDeviceTransfers, &context_) == 0, "io_setup");
    completions_ = eventfd(0, EFD_NONBLOCK);
    for (auto& buffer : buffers_) buffer.resize(transfer_bytes - 1);  // ends with a short packet
    need(usb_gadget::bindGadget(UsbGadget::kFolder).ok(), "bind");
    thread_ = std::thread{[this] { run(); }};
  }
  ~Device() {
    stopping_ = true;
    thread_.join();
    function_.reset();
    io_destroy(context_);
    close(completions_);
  }

 private:
  static std::unique_ptr<usb_gadget::FunctionFs> open() {
    auto function = usb_gadget::FunctionFs::open("/run/probebox-usb", usb_gadget::linkFunction());
    need(function.ok(), "FunctionFS");
    return std::move(*function);
  }
  void submit(std::size_t k) {
    io_prep_pwrite(&controls_[k], function_->endpoint(0), buffers_[k].data(), buffers_[k].size(), 0);
    io_set_eventfd(&controls_[k], completions_);
    controls_[k].data = reinterpret_cast<void*>(k);
    iocb* list = &controls_[k];
    (void)io_submit(context_, 1, &list);
  }
  void run() {
    while (!stopping_) {
      std::array<pollfd, 2> waiting{pollfd{function_->descriptor(), POLLIN, 0}, pollfd{completions_, POLLIN, 0}};
      poll(waiting.data(), waiting.size(), 100);
      while (const auto event = function_->next()) {
        if (*event != usb_gadget::BusEvent::enabled) continue;
        for (std::size_t k = 0; k < kDeviceTransfers; ++k) submit(k);
      }
      eventfd_t count = 0;
      eventfd_read(completions_, &count);
      std::array<io_event, kDeviceTransfers> events;
      timespec at_once{};
      const int got = io_getevents(context_, 0, kDeviceTransfers, events.data(), &at_once);
      for (int k = 0; k < got; ++k) {
        if (static_cast<long>(events[static_cast<std::size_t>(k)].res) >= 0)
          submit(reinterpret_cast<std::size_t>(events[static_cast<std::size_t>(k)].data));
      }
    }
  }

  std::unique_ptr<usb_gadget::FunctionFs> function_;
  io_context_t context_{};
  int completions_{};
  std::array<std::vector<std::byte>, kDeviceTransfers> buffers_;
  std::array<iocb, kDeviceTransfers> controls_{};
  std::atomic<bool> stopping_{};
  std::thread thread_;
};

struct Host {
  std::uint64_t received{};
  std::uint64_t wanted{};
  int in_flight{};
  std::array<std::vector<unsigned char>, kHostTransfers> buffers;
};

void LIBUSB_CALL onTransfer(libusb_transfer* transfer) {
  auto& host = *static_cast<Host*>(transfer->user_data);
  --host.in_flight;
  host.received += static_cast<std::uint64_t>(transfer->actual_length);
  if (transfer->status != LIBUSB_TRANSFER_COMPLETED || host.received >= host.wanted) return;
  if (libusb_submit_transfer(transfer) == 0) ++host.in_flight;
}

// Nobody tells libusb about new devices in the guest: a fresh context looks for itself.
libusb_device_handle* openDevice(libusb_context*& context) {
  for (int tries = 0; tries < 500; ++tries) {
    need(libusb_init(&context) == 0, "libusb");
    if (auto* handle = libusb_open_device_with_vid_pid(context, 0x1209, 0x0001)) return handle;
    libusb_exit(context);
    std::this_thread::sleep_for(std::chrono::milliseconds{20});
  }
  throw std::runtime_error{"the device did not appear"};
}

}  // namespace

double barePump(std::uint64_t bytes, std::size_t transfer_bytes) {
  const Device device{transfer_bytes};
  libusb_context* context = nullptr;
  auto* handle = openDevice(context);
  need(libusb_claim_interface(handle, 0) == 0 && libusb_set_interface_alt_setting(handle, 0, 0) == 0, "claim");
  libusb_config_descriptor* config = nullptr;
  need(libusb_get_active_config_descriptor(libusb_get_device(handle), &config) == 0, "descriptor");
  const auto address = config->interface[0].altsetting[0].endpoint[0].bEndpointAddress;
  libusb_free_config_descriptor(config);

  Host host;
  host.wanted = bytes;
  std::array<libusb_transfer*, kHostTransfers> transfers{};
  const auto start = std::chrono::steady_clock::now();
  for (std::size_t k = 0; k < kHostTransfers; ++k) {
    host.buffers[k].resize(kHostBytes);
    transfers[k] = libusb_alloc_transfer(0);
    libusb_fill_bulk_transfer(transfers[k], handle, address, host.buffers[k].data(), kHostBytes, onTransfer, &host, 0);
    if (libusb_submit_transfer(transfers[k]) == 0) ++host.in_flight;
  }
  while (host.received < bytes && host.in_flight > 0) libusb_handle_events(context);
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
  for (auto* transfer : transfers) libusb_cancel_transfer(transfer);
  while (host.in_flight > 0) libusb_handle_events(context);
  for (auto* transfer : transfers) libusb_free_transfer(transfer);
  libusb_release_interface(handle, 0);
  libusb_close(handle);
  libusb_exit(context);
  need(host.received >= bytes, "the pump stopped");
  return static_cast<double>(host.received) / took.count();
}

}  // namespace probebox::vm
