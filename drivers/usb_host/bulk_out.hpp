#pragma once
#include <cstddef>
#include <cstdint>
#include <span>

#include "drivers/usb_host/transfer_ring.hpp"

namespace probebox::usb_host {

// Writes a bulk OUT endpoint with a bounded number of transfers in flight. A failed transfer ends the endpoint: its
// data and later ones may not have arrived.
class BulkOut {
 public:
  static constexpr TransferRing::Size kUsual{.transfers = 8, .transfer_bytes = 16 * 1024};

  // `interface` must outlive this.
  BulkOut(ClaimedInterface& interface, const Endpoint& endpoint, TransferRing::Size size = kUsual);
  ~BulkOut();
  BulkOut(const BulkOut&) = delete;
  BulkOut& operator=(const BulkOut&) = delete;

  // Takes as many bytes as there is room for and returns their number. If it took fewer, the context's descriptor
  // becomes readable when there is room again.
  std::size_t write(std::span<const std::byte> from);

  EndpointState state() const { return ring_.state(); }
  const EndpointCounters& counters() const { return ring_.counters(); }
  std::size_t inFlight() const { return ring_.inFlight(); }

 private:
  void settle();
  bool room() const { return ring_.at(next_).stage != TransferSlot::Stage::in_flight; }

  Context& context_;
  TransferRing ring_;
  std::uint64_t next_{};  // slot
  bool refused_{};        // the last write() left something over
  bool attention_{};
};

}  // namespace probebox::usb_host
