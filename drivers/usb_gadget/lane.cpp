#include "drivers/usb_gadget/lane.hpp"

#include <algorithm>

#include "drivers/usb_gadget/function.hpp"

namespace probebox::usb_gadget {
namespace {

// A transfer that fills its last packet does not end for the host, who waits for more: its last byte goes alone.
std::size_t transferSize(std::size_t bytes) {
  return bytes > 1 && bytes % kSmallestPacket == 0 ? bytes - 1 : bytes;
}

}  // namespace

Lane::Lane(AioQueue& queue, int endpoint, Size size) : queue_{queue}, endpoint_{endpoint}, ring_(size.transfers) {
  for (auto& transfer : ring_) transfer.bytes.resize(size.transfer_bytes);
}

void Lane::cancel() {
  for (auto& transfer : ring_) queue_.cancel(transfer);
}

void Lane::forget() {
  for (auto& transfer : ring_) {
    transfer.stage = Transfer::Stage::idle;
    transfer.filled = transfer.taken = 0;
    transfer.result = 0;
  }
  oldest_ = next_ = 0;
  failed_ = false;
}

std::size_t InLane::write(std::span<const std::byte> from) {
  std::size_t written = 0;
  if (full()) queue_.reap();
  settle();
  while (!failed_ && !full() && written < from.size()) {
    Transfer& transfer = at(next_);
    const auto left = from.subspan(written);
    const auto part = left.first(transferSize(std::min(left.size(), transfer.bytes.size())));
    std::ranges::copy(part, transfer.bytes.begin());
    transfer.filled = part.size();
    if (!queue_.write(endpoint_, transfer)) {
      transfer.filled = 0;
      break;
    }
    ++next_;
    written += part.size();
  }
  return written;
}

std::size_t InLane::restart() {
  std::size_t unsure = 0;
  for (const auto& transfer : ring_) {
    if (transfer.result != static_cast<std::int64_t>(transfer.filled)) unsure += transfer.filled;
  }
  forget();
  return unsure;
}

// Transfers of one endpoint come back in order.
void InLane::settle() {
  while (oldest_ < next_ && at(oldest_).stage == Transfer::Stage::done) {
    Transfer& transfer = at(oldest_);
    if (transfer.result != static_cast<std::int64_t>(transfer.filled)) {
      failed_ = true;
      return;
    }
    transfer.filled = 0;
    transfer.result = 0;
    transfer.stage = Transfer::Stage::idle;
    ++oldest_;
  }
}

void OutLane::listen() {
  while (!full() && queue_.read(endpoint_, at(next_))) ++next_;
}

std::size_t OutLane::read(std::span<std::byte> into) {
  std::size_t moved = 0;
  while (moved < into.size() && oldest_ < next_ && at(oldest_).stage == Transfer::Stage::done) {
    Transfer& transfer = at(oldest_);
    if (transfer.result < 0) {
      failed_ = true;
      break;
    }
    transfer.filled = static_cast<std::size_t>(transfer.result);
    const auto left = std::span{transfer.bytes}.first(transfer.filled).subspan(transfer.taken);
    const auto part = left.first(std::min(left.size(), into.size() - moved));
    std::ranges::copy(part, into.begin() + static_cast<std::ptrdiff_t>(moved));
    moved += part.size();
    transfer.taken += part.size();
    if (transfer.taken < transfer.filled) break;
    transfer.filled = transfer.taken = 0;
    transfer.result = 0;
    transfer.stage = Transfer::Stage::idle;
    ++oldest_;
  }
  listen();
  if (moved == into.size() && oldest_ < next_ && at(oldest_).stage == Transfer::Stage::done) queue_.nudge();
  return moved;
}

std::size_t OutLane::restart() {
  std::size_t unread = 0;
  for (const auto& transfer : ring_) {
    if (transfer.result > 0) unread += static_cast<std::size_t>(transfer.result) - transfer.taken;
  }
  forget();
  return unread;
}

}  // namespace probebox::usb_gadget
