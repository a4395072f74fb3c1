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

// What stands before a session: who may have one.
namespace probebox::stream {

// Why a host that says this HELLO gets no session; nullopt when both have a protocol version in common.
std::optional<messages::Refusal> whyNoSession(const frame::Header& header, const messages::Hello& hello);

// One whole REFUSAL frame with delimiters before and behind, for a connection without a session.
std::vector<std::byte> refusalFrame(const messages::Refusal& refusal);

// Judges the first bytes of a connection that anybody can open (TCP). They have to be HELLO, after any number of
// delimiters: a browser that is led to post frames to the port begins with a line of HTTP, and is a stranger whatever
// follows. A serial line needs no gate: garbage before HELLO is noise there.
class HelloGate {
 public:
  enum class Verdict : std::uint8_t { undecided, stranger, hello };

  // Longest HELLO with the delimiters around it; a HELLO of protocol 1.2 has 45 bytes.
  static constexpr std::size_t kMostBytes = 256;

  // bytes: what came next, at most room(). A verdict other than undecided is final.
  Verdict push(std::span<const std::byte> bytes);
  std::size_t room() const { return bytes_.size() - size_; }

  // After Verdict::hello: everything that came, for the session to receive; and why there will be no session.
  std::span<const std::byte> bytes() const { return std::span{bytes_}.first(size_); }
  const std::optional<messages::Refusal>& refusal() const { return refusal_; }

 private:
  Verdict judge();

  std::array<std::byte, kMostBytes> bytes_{};
  std::size_t size_{};
  std::optional<messages::Refusal> refusal_;
};

}  // namespace probebox::stream
