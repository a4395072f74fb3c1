#include "firmware/tape/session.hpp"

namespace probebox::tape {
namespace {

constexpr unsigned char kXon = 0x11, kXoff = 0x13, kDelete = 0x7F, kEscape = 0x1B;

}  // namespace

// Handles bytes that are no text: flow control, and the feed, rub-out and codes of a punch.
bool Session::control(unsigned char c, bool sending) {
  if (c == kXoff && flow_) {
    if (!sending) outgoing_.clear();
    stopped_ = true;
    paused_ = paused_ || sending;
  } else if (c == kXon && flow_) {
    if (!paused_) reader_started_ = true;
    stopped_ = paused_ = false;
  }
  return (c < ' ' && c != '\t' && c != kEscape) || c == kDelete;
}

std::size_t Session::push(std::span<const std::byte> bytes, bool sending) {
  std::size_t taken = 0;
  for (const std::byte byte : bytes) {
    ++taken;
    const auto c = static_cast<unsigned char>(static_cast<unsigned>(byte) & (seven_bits_ ? 0x7FU : 0xFFU));
    if (c == '\r' || c == '\n') {
      const bool anything = !incoming_.empty() && incoming_ != "%";
      if (anything || too_long_) {
        whole_ = true;
        return taken;
      }
      incoming_.clear();
      continue;
    }
    if (control(c, sending)) {
      if (reader_started_) return taken;
      continue;
    }
    too_long_ = too_long_ || incoming_.size() == kLongestLine;
    if (!too_long_) incoming_ += static_cast<char>(c);
  }
  return taken;
}

std::optional<Session::Line> Session::line() {
  if (!whole_) return std::nullopt;
  Line line{std::move(incoming_), too_long_};
  incoming_.clear();
  whole_ = too_long_ = false;
  return line;
}

bool Session::readerStarted() {
  const bool started = reader_started_;
  reader_started_ = false;
  return started;
}

bool Session::send(std::string_view text) {
  if (outgoing_.size() + text.size() > kMostWaiting) return false;
  outgoing_ += text;
  return true;
}

std::span<const std::byte> Session::toSend() const {
  return stopped_ ? std::span<const std::byte>{} : std::as_bytes(std::span{outgoing_});
}

void Session::sent(std::size_t bytes) {
  outgoing_.erase(0, bytes);
}

void Session::restart() {
  stopped_ = paused_ = reader_started_ = whole_ = too_long_ = false;
  incoming_.clear();
  outgoing_.clear();
}

}  // namespace probebox::tape
