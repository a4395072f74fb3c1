#pragma once
#include <string>

#include "firmware/app/threads/feed.hpp"
#include "firmware/box/block_builder.hpp"
#include "firmware/box/box.hpp"
#include "firmware/stream/history.hpp"
#include "protocol/messages/handshake.hpp"

// What a box without a daemon tells its hosts.
namespace probebox::scenario {

inline messages::Descriptor streamedDescriptor(const std::string& board, std::uint16_t samples_per_tick) {
  messages::Descriptor d;
  d.board = board;
  d.samples_per_tick = samples_per_tick;
  for (const auto& format : box::channelFormats())
    d.channels.push_back({"channel", "", 1.0, format.bytes, format.is_signed, ""});
  return d;
}

inline stream::GapNotice streamedGap(const latch::Lost& lost) {
  return {lost.first, static_cast<std::uint64_t>(lost.count), app::wireReason(lost.reason)};
}

}  // namespace probebox::scenario
