#include "drivers/usb_gadget/lane.hpp"

#include <algorithm>

#include "drivers/usb_gadget/function.hpp"

namespace probebox::usb_gadget {
namespace {

constexpr std::uint64_t kEnoughInFlight = 2;

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

// One byte less than full packets: see send().
InLane::InLane(AioQueue& queue, int endpoint, Size size)
    : Lane{queue, endpoint, {size.transfers, size.transfer_bytes - 1}} {}

std::size_t InLane::write(std::span<const std::byte> from) {
  std::size_t written = 0;
  if (full()) queue_.reap();
  settle();
  while (!failed_ && !full() && written < from.size()) {
    Transfer& open = at(next_);
    // Data that fit into one transfer are sent as one, so the host need not reassemble them.
    const bool split = written > 0 || from.size() > open.bytes.size();
    if (!split && open.filled + from.size() > open.bytes.size()) {
      if (next_ - oldest_ + 1 == ring_.size() || !send()) break;
      continue;
    }
    const auto part = from.subspan(written, std::min(from.size() - written, open.bytes.size() - open.filled));
    std::ranges::copy(part, open.bytes.begin() + static_cast<std::ptrdiff_t>(open.filled));
    open.filled += part.size();
    written += part.size();
    if (open.filled == open.bytes.size() && !send()) break;
  }
  go();
  return written;
}

void InLane::go() {
  settle();
  while (!failed_ && next_ - oldest_ < kEnoughInFlight && at(next_).filled > 0 && send()) {
  }
}

// A transfer that fills its last packet does not end for the host, who waits for more: its last byte goes with the
// next.
bool InLane::send() {
  Transfer& open = at(next_);
  const std::byte last = open.bytes[open.filled - 1];
  const bool shorten = open.filled > 1 && open.filled % kSmallestPacket == 0;
  if (shorten) --open.filled;
  const bool sent = queue_.write(endpoint_, open);
  if (sent) ++next_;
  if (!shorten) return sent;
  Transfer& next = at(next_);  // there is one: the last of the ring goes only when it is full
  next.bytes[next.filled++] = last;
  return sent;
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
