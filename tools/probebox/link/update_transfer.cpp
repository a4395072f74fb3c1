#include "tools/probebox/link/update_transfer.hpp"

#include <algorithm>

#include "tools/link/wait.hpp"

namespace probebox::command {
namespace {

using messages::OfferUpdate;
using messages::SendUpdate;

// A box takes 8 requests at once.
constexpr std::size_t kMostParts = 6;
constexpr std::size_t kMostWindow = kMostParts * messages::kMostUpdateBytes;
constexpr std::size_t kLeastWindow = 250;
constexpr Nanoseconds kQuick = std::chrono::milliseconds{100};
constexpr Nanoseconds kSlow = std::chrono::milliseconds{400};

}  // namespace

Outcome<std::uint32_t, Trouble> UpdateTransfer::run() {
  TRY(const auto offered, ask<OfferUpdate>(box_, console_,
                                           {.name = bundle_.name(),
                                            .version = bundle_.version(),
                                            .total_bytes = bundle_.bytes(),
                                            .sha256 = bundle_.sha256()}));
  offer_ = offered.offer;
  next_ = held_ = offered.received_bytes;
  progress_(held_);
  while (held_ < bundle_.bytes()) {
    if (console_.interrupted()) return interruption();
    if (auto trouble = fill()) return std::move(*trouble);
    box_.round(patienceOf(console_, milliseconds{100}));
    if (auto trouble = collect()) return std::move(*trouble);
  }
  return offer_;
}

std::optional<Trouble> UpdateTransfer::fill() {
  if (goes_back_ && under_way_.empty()) {
    next_ = held_;
    goes_back_ = false;
  }
  while (!goes_back_ && next_ < bundle_.bytes() && under_way_.size() < kMostParts) {
    const auto most = std::min<std::uint64_t>({messages::kMostUpdateBytes, window_, bundle_.bytes() - next_});
    if (!under_way_.empty() && bytes_under_way_ + most > window_) return std::nullopt;
    auto bytes = bundle_.part(next_, most);
    if (bytes.size() != most)
      return Trouble{ExitStatus::usage, "unreadable", bundle_.name() + " has changed while it was sent: run it again"};
    const auto id = box_.ask<SendUpdate>({.offer = offer_, .offset = next_, .bytes = std::move(bytes)});
    next_ += most;
    under_way_.push_back({id, next_, most, link::now()});
    bytes_under_way_ += most;
    sent_ += most;
  }
  return std::nullopt;
}

std::optional<Trouble> UpdateTransfer::collect() {
  while (!under_way_.empty()) {
    const Part part = under_way_.front();
    const auto answer = box_.answered<SendUpdate>(part.id);
    if (!answer) return std::nullopt;
    under_way_.pop_front();
    bytes_under_way_ -= part.bytes;
    if (*answer) {
      held_ = (*answer)->received_bytes;
      pace(link::now() - part.sent_at, part.bytes);
      progress_(held_);
    } else if (answer->error().code == messages::ErrorCode::busy) {
      pace(kSlow, part.bytes);
    } else {
      return troubleOf(answer->error(), console_);
    }
    goes_back_ = goes_back_ || held_ < part.end;
  }
  return std::nullopt;
}

// As TCP does it: a little more while answers come quickly, half as much when they are late.
void UpdateTransfer::pace(Nanoseconds round_trip, std::size_t bytes) {
  if (round_trip < kQuick) window_ = std::min(window_ + bytes, kMostWindow);
  if (round_trip >= kSlow) window_ = std::max(window_ / 2, kLeastWindow);
}

}  // namespace probebox::command
