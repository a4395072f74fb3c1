#include "firmware/modbus/rtu_requests.hpp"

#include <algorithm>

namespace probebox::modbus {
namespace {

constexpr std::uint8_t kHighestUnit = 247;
constexpr std::size_t kUndecided = kMaxFrameBytes + 1;

// A function code that a request may have (128 and above are exceptions).
bool isFunction(std::uint8_t code) {
  return code > 0 && code < 128;
}

// Length of the request that begins here: 0 when none can or nothing but its end tells, kUndecided when more bytes are
// needed to tell. Functions that the box does not have are known by length too where the standard gives it.
std::size_t requestLength(std::span<const std::uint8_t> bytes) {
  if (bytes[0] > kHighestUnit) return 0;
  if (bytes.size() < 2) return kUndecided;
  const auto counted = [&](std::size_t count_at, std::size_t others) {
    if (bytes.size() <= count_at) return kUndecided;
    const std::size_t length = others + bytes[count_at];
    return length <= kMaxFrameBytes ? length : 0;
  };
  switch (bytes[1]) {
    case 1:
    case 2:
    case 3:
    case 4:
    case 5:
    case 6:
    case 8:
      return 8;
    case 7:
    case 11:
    case 12:
    case 17:
      return 4;
    case 15:
    case 16:
      return counted(6, 9);
    case 22:
      return 10;
    case 23:
      return counted(10, 13);
    default:
      return 0;
  }
}

bool crcGood(std::span<const std::uint8_t> frame) {
  const auto data = frame.first(frame.size() - 2);
  return crc16(data) == (frame[frame.size() - 2] | frame[frame.size() - 1] << 8);
}

}  // namespace

std::uint16_t crc16(std::span<const std::uint8_t> bytes) {
  unsigned crc = 0xFFFF;
  for (const auto byte : bytes) {
    crc ^= byte;
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 1U) != 0 ? crc >> 1 ^ 0xA001U : crc >> 1;
  }
  return static_cast<std::uint16_t>(crc);
}

std::size_t RtuRequests::push(std::span<const std::byte> bytes) {
  const auto count = std::min(bytes.size(), buffer_.size() - size_);
  std::transform(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(count),
                 buffer_.begin() + static_cast<std::ptrdiff_t>(size_),
                 [](std::byte byte) { return static_cast<std::uint8_t>(byte); });
  size_ += count;
  return count;
}

bool RtuRequests::mayBeUnknownFunction() const {
  return !in_garbage_ && size_ >= 2 && size_ <= kMaxFrameBytes && buffer_[0] <= kHighestUnit &&
         isFunction(buffer_[1]) && requestLength(from(0)) == 0;
}

// Its length is not known: it ends where its CRC is good and no byte follows.
std::optional<Request> RtuRequests::unknownFunction() {
  constexpr std::size_t kShortest = 4;
  if (!mayBeUnknownFunction() || size_ < kShortest || !crcGood(from(0))) return std::nullopt;
  Request request;
  request.size = size_;
  std::copy_n(buffer_.begin(), size_, request.bytes.begin());
  consume(size_);
  return request;
}

std::optional<Request> RtuRequests::next() {
  if (const auto request = unknownFunction()) return request;
  for (std::size_t offset = 0; offset < size_; ++offset) {
    const auto rest = from(offset);
    const auto length = requestLength(rest);
    if (length == 0 || length > rest.size() || !crcGood(rest.first(length))) continue;
    Request request;
    request.size = length;
    std::copy_n(rest.begin(), length, request.bytes.begin());
    skip(offset);
    consume(length);
    in_garbage_ = false;
    return request;
  }
  if (mayBeUnknownFunction()) return std::nullopt;
  // What cannot begin a request makes room; what may still become one stays.
  std::size_t useless = 0;
  while (useless < size_) {
    const auto length = requestLength(from(useless));
    if (length > size_ - useless) break;
    ++useless;
  }
  skip(useless);
  return std::nullopt;
}

void RtuRequests::silence() {
  skip(size_);
  in_garbage_ = false;
}

void RtuRequests::skip(std::size_t count) {
  if (count == 0) return;
  if (!in_garbage_) ++bad_frames_;
  in_garbage_ = true;
  skipped_bytes_ += count;
  consume(count);
}

void RtuRequests::consume(std::size_t count) {
  std::copy(buffer_.begin() + static_cast<std::ptrdiff_t>(count), buffer_.begin() + static_cast<std::ptrdiff_t>(size_),
            buffer_.begin());
  size_ -= count;
}

}  // namespace probebox::modbus
