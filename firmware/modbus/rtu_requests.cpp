#include "firmware/modbus/rtu_requests.hpp"

#include <algorithm>

namespace probebox::modbus {
namespace {

constexpr std::uint8_t kHighestUnit = 247;
constexpr std::size_t kUndecided = kMaxFrameBytes + 1;
// Of most requests: those that read, or write one register.
constexpr std::size_t kShortRequest = 8;

// A function code that a request may have (128 and above are exceptions).
bool isFunction(std::uint8_t code) {
  return code > 0 && code < 128;
}

// Lengths below: 0 when no such frame begins here, or nothing but its end shows where that is; kUndecided when more
// bytes are needed to tell.
constexpr std::uint8_t kFileRecord = 20, kWriteFileRecord = 21, kReadFifo = 24, kEncapsulated = 43,
                       kIdentification = 14;

std::size_t countedAt(std::span<const std::uint8_t> bytes, std::size_t count_at, std::size_t others) {
  if (bytes.size() <= count_at) return kUndecided;
  const std::size_t length = others + bytes[count_at];
  return length <= kMaxFrameBytes ? length : 0;
}

// Length of the request that begins here. Functions that the box does not have are known by length too where the
// standard gives it.
std::size_t requestLength(std::span<const std::uint8_t> bytes) {
  if (bytes[0] > kHighestUnit) return 0;
  if (bytes.size() < 2) return kUndecided;
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
      return countedAt(bytes, 6, 9);
    case kFileRecord:
    case kWriteFileRecord:
      return countedAt(bytes, 2, 5);
    case 22:
      return 10;
    case 23:
      return countedAt(bytes, 10, 13);
    case kReadFifo:
      return 6;
    case kEncapsulated:
      return bytes.size() < 3 ? kUndecided : bytes[2] == kIdentification ? 7 : 0;
    default:
      return 0;
  }
}

// Length of the answer of another unit that begins here.
std::size_t answerLength(std::span<const std::uint8_t> bytes) {
  if (bytes[0] > kHighestUnit) return 0;
  if (bytes.size() < 2) return kUndecided;
  if (bytes[1] > 128) return 5;
  switch (bytes[1]) {
    case 1:
    case 2:
    case 3:
    case 4:
    case 12:
    case 17:
    case kFileRecord:
    case kWriteFileRecord:
    case 23:
      return bytes.size() > 2 && bytes[2] == 0 ? 0 : countedAt(bytes, 2, 5);
    case 5:
    case 6:
    case 8:
    case 11:
    case 15:
    case 16:
      return 8;
    case 7:
      return 5;
    case 22:
      return 10;
    default:
      return 0;
  }
}

// A request to write several values whose count of bytes is not that of its values: an answer to one, more likely.
bool contradictsItself(std::span<const std::uint8_t> bytes) {
  const bool writes = bytes.size() > 6 && (bytes[1] == 15 || bytes[1] == 16);
  if (!writes) return false;
  const unsigned values = unsigned{bytes[4]} << 8 | bytes[5];
  return bytes[6] != (bytes[1] == 16 ? 2 * values : (values + 7) / 8);
}

bool crcGood(std::span<const std::uint8_t> frame) {
  const auto data = frame.first(frame.size() - 2);
  return crc16(data) == (frame[frame.size() - 2] | frame[frame.size() - 1] << 8);
}

}  // namespace

std::size_t copied(std::span<const std::byte> bytes, std::span<std::uint8_t> room) {
  const auto count = std::min(bytes.size(), room.size());
  std::ranges::transform(bytes.first(count), room.begin(),
                         [](std::byte byte) { return static_cast<std::uint8_t>(byte); });
  return count;
}

std::uint16_t crc16(std::span<const std::uint8_t> bytes) {
  unsigned crc = 0xFFFF;
  for (const auto byte : bytes) {
    crc ^= byte;
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 1U) != 0 ? crc >> 1 ^ 0xA001U : crc >> 1;
  }
  return static_cast<std::uint16_t>(crc);
}

Begins beginsRequest(std::span<const std::uint8_t> bytes) {
  if (bytes.empty()) return Begins::undecided;
  const auto length = requestLength(bytes);
  if (length > bytes.size()) return bytes.size() < kMaxFrameBytes ? Begins::undecided : Begins::something_else;
  return length != 0 && crcGood(bytes.first(length)) ? Begins::request : Begins::something_else;
}

std::size_t RtuRequests::push(std::span<const std::byte> bytes) {
  const auto count = copied(bytes, std::span{buffer_}.subspan(size_));
  size_ += count;
  return count;
}

bool RtuRequests::mayBeUnknownFunction() const {
  return !in_garbage_ && size_ >= 2 && size_ <= kMaxFrameBytes && buffer_[0] <= kHighestUnit &&
         isFunction(buffer_[1]) && requestLength(from(0)) == 0 && answerLength(from(0)) == 0;
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
  while (size_ > 0 && !in_garbage_) {
    if (const auto request = unknownFunction()) return request;
    const auto all = from(0);
    const std::size_t request = requestLength(all), answer = answerLength(all);
    if (isGood(request)) return take(0, request);
    const bool awaits_request = isOpen(request) && !(isGood(answer) && contradictsItself(all));
    if (mayBeUnknownFunction() || awaits_request || isOpen(answer)) return std::nullopt;
    if (isGood(answer)) {
      consume(answer);
      continue;
    }
    // A damaged frame, with all that it says it holds; or a byte that begins none. What seems damaged may be noise
    // before a request that ends with the bytes, or has not come whole.
    const auto damaged = std::max(request, answer);
    if (damaged != 0 && size_ < damaged + kShortRequest) return std::nullopt;
    skip(std::max(std::size_t{1}, damaged));
  }
  return requestInGarbage();
}

std::optional<Request> RtuRequests::afterPause() {
  for (std::size_t offset = 1; offset < size_; ++offset) {
    const auto rest = from(offset);
    const auto length = requestLength(rest);
    const bool ends_here = length != 0 && length <= rest.size() && rest.size() - length <= kMostNoise;
    if (!ends_here || !crcGood(rest.first(length))) continue;
    const auto function = static_cast<Function>(rest[1]);
    const bool reads = function == Function::read_holding || function == Function::read_input;
    if (reads || offset <= kMostNoise) return take(offset, length);
  }
  return std::nullopt;
}

bool RtuRequests::isGood(std::size_t length) const {
  return length != 0 && length <= size_ && crcGood(from(0).first(length));
}

bool RtuRequests::isOpen(std::size_t length) const {
  return length > size_;
}

Request RtuRequests::take(std::size_t offset, std::size_t length) {
  Request request;
  request.size = length;
  std::copy_n(from(offset).begin(), length, request.bytes.begin());
  skip(offset);
  consume(length);
  in_garbage_ = false;
  return request;
}

// Behind what was no frame, a request may begin anywhere.
std::optional<Request> RtuRequests::requestInGarbage() {
  for (std::size_t offset = 0; offset < size_; ++offset) {
    const auto rest = from(offset);
    const auto length = requestLength(rest);
    if (length == 0 || length > rest.size() || !crcGood(rest.first(length))) continue;
    return take(offset, length);
  }
  // Discards bytes that cannot begin a request, and keeps those that may still become one.
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
  if (!in_garbage_ && size_ > 0 && answerLength(from(0)) == size_ && isGood(size_)) consume(size_);
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
