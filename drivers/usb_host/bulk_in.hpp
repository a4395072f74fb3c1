#pragma once
#include <cstddef>
#include <cstdint>
#include <span>

#include "drivers/usb_host/transfer_ring.hpp"

namespace probebox::usb_host {

// A bulk IN endpoint with all its transfers in flight. What came is kept in order until it is consumed, and its
// transfer goes back to the kernel only then: a slow reader slows the device down and loses nothing.
class BulkIn {
 public:
  static constexpr TransferRing::Size kUsual{.transfers = 16, .transfer_bytes = 32 * 1024};

  // `interface` outlives it.
  BulkIn(ClaimedInterface& interface, const Endpoint& endpoint, TransferRing::Size size = kUsual);
  ~BulkIn();
  BulkIn(const BulkIn&) = delete;
  BulkIn& operator=(const BulkIn&) = delete;

  // What is left of the oldest transfer that has come back (a short packet ends one); empty when there is none now.
  // Context::handle() brings more. Valid until consume().
  std::span<const std::byte> front() const;
  void consume(std::size_t bytes);
  // When front()'s transfer came back (CLOCK_MONOTONIC), and whether one that came after it is here as well. Mean
  // nothing while front() is empty.
  MonoTime arrived() const { return ring_.at(oldest_).came_back; }
  bool hasMore() const { return ring_.at(oldest_ + 1).stage == TransferSlot::Stage::done; }

  // The same, after handling what is due when nothing is there; whoever asks also consumes.
  std::span<const std::byte> next();
  // The same, copying; the bytes moved.
  std::size_t read(std::span<std::byte> into);

  // Looks at front() first: what came before the end is still good.
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
  bool reading_{};  // in read(): the reader is here already
};

}  // namespace probebox::usb_host
