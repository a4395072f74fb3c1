#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace probebox::tape {

// Bytes to lines, and text to bytes under XON and XOFF. One line at a time; knows nothing of what they mean.
class Session {
 public:
  static constexpr std::size_t kLongestLine = 256;
  static constexpr std::size_t kMostWaiting = 16'384;  // bytes to send

  struct Line {
    std::string text;
    bool too_long{};  // the text is its begin
  };

  // flow: the other end stops the box with XOFF and lets it go on with XON. seven_bits: the eighth is parity.
  Session(bool flow, bool seven_bits) : flow_{flow}, seven_bits_{seven_bits} {}

  // Takes bytes up to the end of a line or an XON that asks for a tape; returns how many. Call it again with the rest.
  // sending: the other end does not have all of the text yet. An XOFF behind a text ends its reading, and the next XON
  // asks for another one.
  std::size_t push(std::span<const std::byte> bytes, bool sending);
  // The line that push() has completed, once.
  std::optional<Line> line();
  // True once after an XON that let nothing go on: a control that starts its reader asks for a tape by it.
  bool readerStarted();

  // False: too much waits already, and the text is not sent at all.
  bool send(std::string_view text);
  // Bytes that may be sent now; none while the other end has stopped the box by XOFF.
  std::span<const std::byte> toSend() const;
  void sent(std::size_t bytes);
  bool stopped() const { return stopped_; }
  std::size_t unsent() const { return outgoing_.size(); }  // characters that have not been sent yet
  bool waits() const { return !outgoing_.empty(); }
  // Discards received and unsent bytes, for a line that was opened again.
  void restart();

 private:
  bool control(unsigned char c, bool sending);

  bool flow_, seven_bits_;
  bool stopped_{};
  bool paused_{};  // stopped in a text
  bool reader_started_{};
  bool whole_{};
  bool too_long_{};
  std::string incoming_;
  std::string outgoing_;
};

}  // namespace probebox::tape
