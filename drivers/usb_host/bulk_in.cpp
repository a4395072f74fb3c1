#include "drivers/usb_host/bulk_in.hpp"

#include <algorithm>

namespace probebox::usb_host {

using Stage = TransferSlot::Stage;

BulkIn::BulkIn(ClaimedInterface& interface, const Endpoint& endpoint, TransferRing::Size size)
    : context_{interface.context()}, ring_{interface, endpoint, size, [this] { settle(); }} {
  for (std::uint64_t i = 0; i < ring_.size(); ++i) ring_.submit(ring_.at(i), ring_.at(i).buffer.size());
  settle();
}

BulkIn::~BulkIn() {
  if (attention_) context_.attention(-1);
}

std::span<const std::byte> BulkIn::front() const {
  const auto& slot = ring_.at(oldest_);
  if (slot.stage != Stage::done) return {};
  return std::span{slot.buffer}.first(slot.moved).subspan(taken_);
}

void BulkIn::consume(std::size_t bytes) {
  taken_ += bytes;
  settle();
}

// Transfers that were read to their end, or brought nothing, fly again, in their order.
void BulkIn::settle() {
  for (auto* slot = &ring_.at(oldest_); slot->stage == Stage::done && taken_ >= slot->moved;
       slot = &ring_.at(oldest_)) {
    slot->stage = Stage::idle;
    taken_ = 0;
    ++oldest_;
    ring_.submit(*slot, slot->buffer.size());
  }
  if (reading_) return;
  const bool attention = !front().empty() || state() != EndpointState::open;
  if (attention != attention_) context_.attention(attention ? 1 : -1);
  attention_ = attention;
}

std::span<const std::byte> BulkIn::next() {
  if (front().empty()) {
    reading_ = true;
    context_.handle();
    reading_ = false;
    if (front().empty()) settle();
  }
  return front();
}

std::size_t BulkIn::read(std::span<std::byte> into) {
  reading_ = true;
  if (front().empty()) context_.handle();
  std::size_t moved = 0;
  for (auto from = front(); !from.empty() && moved < into.size(); from = front()) {
    const auto bytes = std::min(from.size(), into.size() - moved);
    std::copy_n(from.begin(), bytes, into.begin() + static_cast<std::ptrdiff_t>(moved));
    moved += bytes;
    consume(bytes);
  }
  reading_ = false;
  settle();
  return moved;
}

}  // namespace probebox::usb_host
