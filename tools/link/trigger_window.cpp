#include "tools/link/trigger_window.hpp"

#include <utility>

namespace probebox::link {
namespace {

using messages::MessageType;

// Two heartbeats: one may be on its way while the trigger is stamped, and samples wait for their block to be full.
constexpr std::uint64_t kMargin_ms = 200;

bool isHandshake(MessageType type) {
  return type == MessageType::welcome || type == MessageType::descriptor || type == MessageType::test_pattern;
}

MessageType typeOf(const frame::Header& header) {
  return static_cast<MessageType>(header.type);
}

}  // namespace

void TriggerWindow::frame(const frame::Frame& frame) {
  if (done_) return;
  Kept kept{frame.header, {frame.payload.begin(), frame.payload.end()}};
  const auto type = typeOf(kept.header);
  if (type == MessageType::heartbeat) {
    if (const auto beat = messages::decode<messages::Heartbeat>(kept.payload)) {
      kept.beat = *beat;
      heartbeat(std::move(kept));
    }
    return;
  }
  if (type == MessageType::welcome) {
    const auto welcome = messages::decode<messages::Welcome>(kept.payload);
    const bool restarted = welcome && boot_id_ && *boot_id_ != welcome->boot_id;
    if (welcome) boot_id_ = welcome->boot_id;
    if (restarted && !trigger_) history_.clear();  // its times are of another life of the box
    if (trigger_) base_.reset();                   // a new link has a ledger of its own
  }
  if (trigger_) return pass(kept);
  if (history_.empty()) {
    if (isHandshake(type)) keepHandshake(kept);
    return;
  }
  history_.back().push_back(kept);
  if (type != MessageType::trigger) return;
  if (const auto trigger = messages::decode<messages::Trigger>(kept.payload)) {
    trigger_ = trigger->number;
    begin();
  }
}

void TriggerWindow::heartbeat(Kept frame) {
  auto& beat = *frame.beat;
  if (!beat.streaming) {
    if (trigger_) {
      pass(frame);
      done_ = beat.stream_number != 0;  // 0: a new link whose stream has not begun
    } else if (!history_.empty()) {
      history_.back().push_back(frame);
    }
    return;
  }
  if (!trigger_) {
    history_.push_back({frame});
    return forgetOld(beat.uptime_ms);
  }
  if (!triggered_ms_) triggered_ms_ = beat.uptime_ms;
  if (beat.uptime_ms < *triggered_ms_) triggered_ms_ = 0;  // the box was restarted: what was asked for cannot be had
  done_ = beat.uptime_ms >= *triggered_ms_ + lengths_.after_ms + kMargin_ms;
  beat.streaming = !done_;
  pass(frame);
}

// Drops the first stretch while the second one is long enough ago.
void TriggerWindow::forgetOld(std::uint64_t now_ms) {
  const auto length = lengths_.before_ms + kMargin_ms;
  while (history_.size() > 1 && history_[1].front().beat->uptime_ms + length <= now_ms) {
    for (const auto& frame : history_.front()) {
      if (isHandshake(typeOf(frame.header))) keepHandshake(frame);
    }
    history_.pop_front();
  }
}

void TriggerWindow::keepHandshake(const Kept& frame) {
  if (typeOf(frame.header) == MessageType::welcome) handshake_.clear();
  handshake_.insert_or_assign(frame.header.type, frame);
}

// Passes on the handshake and the history. Frames keep their sequence, so that a frame that the link lost is missed
// here too; those of the handshake get the numbers before.
void TriggerWindow::begin() {
  base_ = history_.front().front().beat;
  auto sequence = history_.front().front().header.sequence - static_cast<std::uint32_t>(handshake_.size());
  for (auto& [type, frame] : handshake_) {
    frame.header.sequence = sequence++;
    pass(frame);
  }
  for (const auto& stretch : std::exchange(history_, {})) {
    for (const auto& frame : stretch) {
      if (typeOf(frame.header) == MessageType::welcome) base_.reset();
      pass(frame);
    }
  }
}

void TriggerWindow::pass(const Kept& frame) {
  if (!frame.beat) return sink_({frame.header, frame.payload});
  const auto payload = messages::encoded(counted(*frame.beat));
  auto header = frame.header;
  header.payload_length = static_cast<std::uint16_t>(payload.size());
  sink_({header, payload});
}

// The heartbeat with a ledger that begins where the recording does.
messages::Heartbeat TriggerWindow::counted(messages::Heartbeat beat) const {
  if (!base_ || base_->stream_number != beat.stream_number) return beat;
  beat.start = base_->position;
  beat.produced -= base_->produced;
  beat.sent_samples -= base_->sent_samples;
  beat.lost_at_source -= base_->lost_at_source;
  beat.lost_in_queue -= base_->lost_in_queue;
  if (base_->first_trigger == 0) return beat;
  beat.first_trigger = base_->next_trigger;
  beat.sent_triggers -= base_->sent_triggers;
  beat.lost_triggers -= base_->lost_triggers;
  return beat;
}

}  // namespace probebox::link
