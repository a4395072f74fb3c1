#include "firmware/stream/greeting.hpp"

#include <algorithm>

#include "protocol/frame/bytes.hpp"
#include "protocol/frame/reader.hpp"
#include "protocol/messages/fields.hpp"

namespace probebox::stream {
namespace {

using messages::ErrorCode;
using messages::MessageType;

std::string versionText(unsigned major, unsigned minor) {
  return std::to_string(major) + "." + std::to_string(minor);
}

messages::Refusal versionMismatch(std::string text) {
  return {ErrorCode::version_mismatch, MessageType::hello, std::move(text)};
}

// The header of a HELLO in COBS: 3 because the third byte is 0 (flags), then major and type.
constexpr std::byte kCodeOfHello{3};

}  // namespace

std::optional<messages::Refusal> whyNoSession(const frame::Header& header, const messages::Hello& hello) {
  if (header.major != messages::kProtocolMajor || hello.major != messages::kProtocolMajor) {
    const unsigned theirs = header.major != messages::kProtocolMajor ? header.major : hello.major;
    return versionMismatch("this box speaks protocol " +
                           versionText(messages::kProtocolMajor, messages::kProtocolMinor) +
                           " and the host speaks major " + std::to_string(theirs) + "; update the older of the two");
  }
  if (hello.min_minor > hello.max_minor) {
    return versionMismatch("the host asks for protocol " + versionText(hello.major, hello.min_minor) + " to " +
                           versionText(hello.major, hello.max_minor) + ", which is no range; correct its HELLO");
  }
  if (hello.min_minor > messages::kProtocolMinor) {
    return versionMismatch("this box speaks protocol " +
                           versionText(messages::kProtocolMajor, messages::kProtocolMinor) + " and the host needs " +
                           versionText(hello.major, hello.min_minor) + " at least; update the box");
  }
  return std::nullopt;
}

std::vector<std::byte> refusalFrame(const messages::Refusal& refusal) {
  const auto payload = messages::encoded(refusal);
  std::vector<std::byte> scratch(frame::bareSize(payload.size()));
  std::vector<std::byte> bytes(1 + frame::delimitedMaxSize(payload.size()), frame::kDelimiter);
  const frame::Header header{.major = messages::kProtocolMajor,
                             .type = static_cast<std::uint8_t>(MessageType::refusal)};
  bytes.resize(1 + frame::encodeDelimited(header, payload, scratch, std::span{bytes}.subspan(1)));
  return bytes;
}

HelloGate::Verdict HelloGate::push(std::span<const std::byte> bytes) {
  const auto taken = bytes.first(std::min(bytes.size(), room()));
  frame::copyBytes(taken, bytes_.data() + size_);
  size_ += taken.size();
  return judge();
}

HelloGate::Verdict HelloGate::judge() {
  auto rest = bytes();
  while (!rest.empty() && rest.front() == frame::kDelimiter) rest = rest.subspan(1);
  const auto is = [&](std::size_t at, std::byte expected) { return rest.size() <= at || rest[at] == expected; };
  if (!is(0, kCodeOfHello) || !is(2, static_cast<std::byte>(MessageType::hello))) return Verdict::stranger;

  frame::Reader reader{kMostBytes};
  const auto first = reader.next(rest);
  if (!first) {
    const bool may_become_one = reader.counters().bad() == 0 && room() > 0;
    return may_become_one ? Verdict::undecided : Verdict::stranger;
  }
  const auto hello = messages::decode<messages::Hello>(first->payload);
  // A damaged frame before HELLO is not among the first bytes of ours.
  const bool ours = reader.counters().bad() == 0 &&
                    first->header.type == static_cast<std::uint8_t>(MessageType::hello) && hello &&
                    hello->magic == messages::kMagic;
  if (!ours) return Verdict::stranger;
  refusal_ = whyNoSession(first->header, *hello);
  return Verdict::hello;
}

}  // namespace probebox::stream
