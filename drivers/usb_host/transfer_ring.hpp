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

// Of one endpoint. All but `open` are final: claim the interface anew.
enum class EndpointState : std::uint8_t {
  open,
  stalled,  // the device refuses: an error of its own
  failed,   // the bus failed again and again
  gone,     // unplugged
};

std::string_view nameOf(EndpointState state);

struct EndpointCounters {
  std::uint64_t transfers{};  // that came back, whatever became of them
  std::uint64_t bytes{};
  std::uint64_t errors{};     // transfers that the bus spoilt; what they moved until then counts
  std::uint64_t overflows{};  // the device sent more than a packet may hold
  std::uint64_t stalls{};
};

class TransferRing;

// One transfer of libusb with its buffer, used over and over.
struct TransferSlot {
  enum class Stage : std::uint8_t { idle, in_flight, done };

  struct Free {
    void operator()(libusb_transfer* transfer) const;
  };
  TransferRing* ring{};
  std::unique_ptr<libusb_transfer, Free> transfer;
  std::vector<std::byte> buffer;
  std::size_t moved{};   // bytes, by the transfer that came back last
  MonoTime came_back{};  // and when, as close to the kernel as libusb lets anybody be
  Stage stage{Stage::idle};
};

// The transfers of one endpoint, and what became of them. What is in flight belongs to the kernel: the destructor
// cancels it and waits until it is back.
class TransferRing {
 public:
  struct Size {
    std::size_t transfers{};
    std::size_t transfer_bytes{};  // a multiple of the endpoint's packets
  };
  // `returned`: called from Context::handle() after a transfer has come back.
  TransferRing(ClaimedInterface& interface, const Endpoint& endpoint, Size size, std::function<void()> returned);
  ~TransferRing();
  TransferRing(const TransferRing&) = delete;
  TransferRing& operator=(const TransferRing&) = delete;

  // Slots are counted on and on; the ring comes round by itself.
  TransferSlot& at(std::uint64_t index) { return slots_[static_cast<std::size_t>(index % slots_.size())]; }
  const TransferSlot& at(std::uint64_t index) const { return slots_[static_cast<std::size_t>(index % slots_.size())]; }
  std::size_t size() const { return slots_.size(); }

  // Hands the first `bytes` of the slot's buffer to the kernel. Nothing happens when the endpoint is not open any more.
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
