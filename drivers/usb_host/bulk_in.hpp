#pragma once
#include <cstddef>
#include <cstdint>
#include <span>

#include "drivers/usb_host/transfer_ring.hpp"

namespace probebox::usb_host {

// Reads a bulk IN endpoint with all transfers in flight. Data are kept in order, and a transfer is resubmitted only
// when it has been consumed: a slow reader slows the device down and loses nothing.
class BulkIn {
 public:
  static constexpr TransferRing::Size kUsual{.transfers = 16, .transfer_bytes = 32 * 1024};

  // `interface` must outlive this.
  BulkIn(ClaimedInterface& interface, const Endpoint& endpoint, TransferRing::Size size = kUsual);
  ~BulkIn();
  BulkIn(const BulkIn&) = delete;
  BulkIn& operator=(const BulkIn&) = delete;

  // Remaining bytes of the oldest completed transfer (a short packet ends one); empty when there are none.
  // Context::handle() brings more. Valid until consume().
  std::span<const std::byte> front() const;
  void consume(std::size_t bytes);
  // Completion time of front()'s transfer (CLOCK_MONOTONIC), and whether a later one has completed too. Undefined while
  // front() is empty.
  MonoTime arrived() const { return ring_.at(oldest_).came_back; }
  bool hasMore() const { return ring_.at(oldest_ + 1).stage == TransferSlot::Stage::done; }

  // As front(), after handling pending completions if there is nothing; the caller must also consume.
  std::span<const std::byte> next();
  // As above with a copy; returns the number of bytes.
  std::size_t read(std::span<std::byte> into);

  // Check front() first: data received before the end are still valid.
  EndpointState state() const { return ring_.state(); }
  bool over() const { return state() != EndpointState::open && front().empty(); }
  const EndpointCounters& counters() const { return ring_.counters(); }
  std::size_t inFlight() const { return ring_.inFlight(); }

 private:
  void settle();

  Context& context_;
  TransferRing ring_;
  std::uint64_t oldest_{};  // slot
  std::size_t taken_{};     // bytes of the oldest slot
  bool attention_{};
  bool reading_{};  // in read(): the reader is already here
};

}  // namespace probebox::usb_host
