#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "drivers/usb_host/claimed_interface.hpp"
#include "protocol/units/time.hpp"

struct libusb_transfer;

namespace probebox::usb_host {

// State of one endpoint. All but `open` are final: claim the interface again.
enum class EndpointState : std::uint8_t {
  open,
  stalled,  // the device reported an error (stall)
  failed,   // repeated bus errors
  gone,     // unplugged
};

std::string_view nameOf(EndpointState state);

struct EndpointCounters {
  std::uint64_t transfers{};  // completed, with any outcome
  std::uint64_t bytes{};
  std::uint64_t errors{};     // transfers that a bus error ended; the bytes moved before it count
  std::uint64_t overflows{};  // the device sent more than a packet can hold
  std::uint64_t stalls{};
};

class TransferRing;

// One transfer of libusb with its buffer, which is reused.
struct TransferSlot {
  enum class Stage : std::uint8_t { idle, in_flight, done };

  struct Free {
    void operator()(libusb_transfer* transfer) const;
  };
  TransferRing* ring{};
  std::unique_ptr<libusb_transfer, Free> transfer;
  std::vector<std::byte> buffer;
  std::size_t moved{};   // bytes, by the transfer that came back last
  MonoTime came_back{};  // completion time, as early as libusb reports it
  Stage stage{Stage::idle};
};

// The transfers of one endpoint and their outcomes. Those in flight belong to the kernel: the destructor cancels them
// and waits for completion.
class TransferRing {
 public:
  struct Size {
    std::size_t transfers{};
    std::size_t transfer_bytes{};  // a multiple of the endpoint's packets
  };
  // `returned`: called from Context::handle() after a transfer has completed.
  TransferRing(ClaimedInterface& interface, const Endpoint& endpoint, Size size, std::function<void()> returned);
  ~TransferRing();
  TransferRing(const TransferRing&) = delete;
  TransferRing& operator=(const TransferRing&) = delete;

  // Slot numbers increase; the ring wraps internally.
  TransferSlot& at(std::uint64_t index) { return slots_[static_cast<std::size_t>(index % slots_.size())]; }
  const TransferSlot& at(std::uint64_t index) const { return slots_[static_cast<std::size_t>(index % slots_.size())]; }
  std::size_t size() const { return slots_.size(); }

  // Submits the first `bytes` of the slot's buffer. Ignored when the endpoint is no longer open.
  void submit(TransferSlot& slot, std::size_t bytes);

  EndpointState state() const { return state_; }
  const EndpointCounters& counters() const { return counters_; }
  std::size_t inFlight() const { return in_flight_; }

 private:
  friend struct TransferCallback;
  void cameBack(TransferSlot& slot);
  void judge(const libusb_transfer& transfer);
  void bringBack();
  void end(EndpointState state);

  ClaimedInterface& interface_;
  bool in_;
  std::vector<TransferSlot> slots_;
  std::function<void()> returned_;
  EndpointState state_{EndpointState::open};
  EndpointCounters counters_{};
  std::size_t in_flight_{};
  std::size_t errors_in_a_row_{};
};

}  // namespace probebox::usb_host
