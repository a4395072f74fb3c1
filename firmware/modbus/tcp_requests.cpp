#include "firmware/modbus/tcp_requests.hpp"

#include <algorithm>

namespace probebox::modbus {
namespace {

constexpr std::size_t kLengthAt = 4;
constexpr std::size_t kBeforeUnit = 6;
constexpr std::size_t kCrcBytes = 2;

std::uint16_t wordAt(std::span<const std::uint8_t> bytes, std::size_t at) {
  return static_cast<std::uint16_t>(bytes[at] << 8 | bytes[at + 1]);
}

void putWord(std::span<std::uint8_t> bytes, std::size_t at, std::size_t word) {
  bytes[at] = static_cast<std::uint8_t>(word >> 8);
  bytes[at + 1] = static_cast<std::uint8_t>(word);
}

// Unit and function at least; a frame has at most 260 bytes.
bool isLength(std::size_t length) {
  return length >= 2 && length <= kMaxTcpFrameBytes - kBeforeUnit;
}

}  // namespace

std::size_t TcpRequests::push(std::span<const std::byte> bytes) {
  if (broken_) return bytes.size();
  const auto count = copied(bytes, std::span{buffer_}.subspan(size_));
  size_ += count;
  return count;
}

std::optional<TcpRequest> TcpRequests::next() {
  if (broken_ || size_ < kBeforeUnit) return std::nullopt;
  const std::size_t length = wordAt(buffer_, kLengthAt);
  broken_ = wordAt(buffer_, 2) != 0 || !isLength(length);
  if (broken_ || size_ < kBeforeUnit + length) return std::nullopt;
  // Above 127 are the functions of answers that refuse.
  broken_ = buffer_[kBeforeUnit + 1] > 127;
  if (broken_) return std::nullopt;

  TcpRequest found{.transaction = wordAt(buffer_, 0), .unit = buffer_[kBeforeUnit], .request = {}};
  auto& request = found.request;
  std::copy_n(buffer_.begin() + kBeforeUnit, length, request.bytes.begin());
  const auto crc = crc16(std::span{request.bytes}.first(length));
  request.bytes[length] = static_cast<std::uint8_t>(crc);
  request.bytes[length + 1] = static_cast<std::uint8_t>(crc >> 8);
  request.size = length + kCrcBytes;

  const auto used = static_cast<std::ptrdiff_t>(kBeforeUnit + length);
  std::copy(buffer_.begin() + used, buffer_.begin() + static_cast<std::ptrdiff_t>(size_), buffer_.begin());
  size_ -= kBeforeUnit + length;
  return found;
}

std::size_t tcpAnswer(const TcpRequest& to, std::span<const std::uint8_t> serial,
                      std::span<std::uint8_t, kMaxTcpFrameBytes> frame) {
  if (serial.size() < 2 + kCrcBytes) return 0;
  const auto length = serial.size() - kCrcBytes;
  putWord(frame, 0, to.transaction);
  putWord(frame, 2, 0);
  putWord(frame, kLengthAt, length);
  std::copy_n(serial.begin(), length, frame.begin() + kBeforeUnit);
  frame[kBeforeUnit] = to.unit;
  return kBeforeUnit + length;
}

}  // namespace probebox::modbus
