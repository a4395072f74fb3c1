#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/frame/frame.hpp"
#include "protocol/messages/handshake.hpp"

// Decides which hosts get a session.
namespace probebox::stream {

// Explains why this HELLO gets no session; nullopt when both sides have a protocol version in common.
std::optional<messages::Refusal> whyNoSession(const frame::Header& header, const messages::Hello& hello);

// One whole REFUSAL frame with delimiters before and after it, for a connection without a session.
std::vector<std::byte> refusalFrame(const messages::Refusal& refusal);

// Checks the first bytes of a connection that anyone can open (TCP): they must be HELLO, after any number of
// delimiters. A browser that was tricked into posting frames to the port begins with a line of HTTP, and is rejected
// whatever follows. A serial line needs no gate: garbage before HELLO is noise there.
class HelloGate {
 public:
  enum class Verdict : std::uint8_t { undecided, stranger, hello };

  // Longest HELLO with the delimiters around it; a HELLO of protocol 1.2 has 45 bytes.
  static constexpr std::size_t kMostBytes = 256;

  // bytes: the next received bytes, at most room(). A verdict other than undecided is final.
  Verdict push(std::span<const std::byte> bytes);
  std::size_t room() const { return bytes_.size() - size_; }

  // After Verdict::hello: all received bytes, for the session; and why there is no session, if so.
  std::span<const std::byte> bytes() const { return std::span{bytes_}.first(size_); }
  const std::optional<messages::Refusal>& refusal() const { return refusal_; }

 private:
  Verdict judge();

  std::array<std::byte, kMostBytes> bytes_{};
  std::size_t size_{};
  std::optional<messages::Refusal> refusal_;
};

}  // namespace probebox::stream
