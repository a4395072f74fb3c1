#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "drivers/usb_gadget/linux_aio.hpp"

namespace probebox::usb_gadget {

// One endpoint with its transfers, used in turn. Must live until all of them are back (AioQueue::drain()).
class Lane {
 public:
  struct Size {
    std::size_t transfers{};
    std::size_t transfer_bytes{};  // a multiple of kLargestPacket
  };
  Lane(AioQueue& queue, int endpoint, Size size);

  // A failed transfer ends the connection, because its data may not have arrived.
  bool failed() const { return failed_; }

  // Cancels all transfers.
  void cancel();

 protected:
  // Call when all transfers are back.
  void forget();
  Transfer& at(std::uint64_t k) { return ring_[k % ring_.size()]; }
  bool full() const { return next_ - oldest_ == ring_.size(); }

  AioQueue& queue_;
  int endpoint_;
  std::vector<Transfer> ring_;
  std::uint64_t oldest_{};  // in use
  std::uint64_t next_{};    // to be used
  bool failed_{};
};

// While two transfers are in flight, written data accumulate in the next one: large transfers for a stream, no delay
// for a single message.
class InLane : public Lane {
 public:
  InLane(AioQueue& queue, int endpoint, Size size);
  // Takes as many bytes as there is room for.
  std::size_t write(std::span<const std::byte> from);
  // Call after transfers have completed: sends accumulated data.
  void go();
  // Call when all transfers are back: discards them and returns how many bytes may not have arrived.
  std::size_t restart();

 private:
  void settle();
  bool send();
};

class OutLane : public Lane {
 public:
  using Lane::Lane;
  // Submits all transfers.
  void listen();
  std::size_t read(std::span<std::byte> into);
  // Call when all transfers are back: discards them and returns how many bytes were not read.
  std::size_t restart();
};

}  // namespace probebox::usb_gadget
