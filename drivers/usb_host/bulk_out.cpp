#include "drivers/usb_host/bulk_out.hpp"

#include <algorithm>

namespace probebox::usb_host {

BulkOut::BulkOut(ClaimedInterface& interface, const Endpoint& endpoint, TransferRing::Size size)
    : context_{interface.context()}, ring_{interface, endpoint, size, [this] { settle(); }} {}

BulkOut::~BulkOut() {
  if (attention_) context_.attention(-1);
}

std::size_t BulkOut::write(std::span<const std::byte> from) {
  if (!room()) context_.handle();
  std::size_t taken = 0;
  while (taken < from.size() && room() && state() == EndpointState::open) {
    auto& slot = ring_.at(next_);
    const auto part = from.subspan(taken, std::min(from.size() - taken, slot.buffer.size()));
    std::ranges::copy(part, slot.buffer.begin());
    ring_.submit(slot, part.size());
    if (state() != EndpointState::open) break;
    taken += part.size();
    ++next_;
  }
  refused_ = taken < from.size();
  settle();
  return taken;
}

void BulkOut::settle() {
  const bool attention = (refused_ && room()) || state() != EndpointState::open;
  if (attention != attention_) context_.attention(attention ? 1 : -1);
  attention_ = attention;
}

}  // namespace probebox::usb_host
