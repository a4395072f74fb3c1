#include "protocol/frame/reader.hpp"

#include <algorithm>

namespace probebox::frame {

Reader::Reader(std::size_t max_payload, Framing framing)
    : framing_{framing}, max_payload_{max_payload}, buffer_(delimitedMaxSize(max_payload) - 1) {}

std::optional<Frame> Reader::next(std::span<const std::byte>& bytes) {
  return framing_ == Framing::bare ? nextBare(bytes) : nextDelimited(bytes);
}

std::optional<Frame> Reader::nextDelimited(std::span<const std::byte>& bytes) {
  while (!bytes.empty()) {
    const auto length = zeroIn(bytes);  // before the delimiter
    collect(bytes.first(length));
    if (length == bytes.size()) {
      bytes = {};
      return std::nullopt;
    }
    bytes = bytes.subspan(length + 1);
    if (auto frame = finish()) return frame;
  }
  return std::nullopt;
}

void Reader::restart() {
  counters_.discarded_bytes += unfinished();
  filled_ = taken_ = overflow_ = 0;
  searching_ = false;
}

void Reader::collect(std::span<const std::byte> bytes) {
  const auto kept = std::min(bytes.size(), buffer_.size() - filled_);
  copyBytes(bytes.first(kept), buffer_.data() + filled_);
  filled_ += kept;
  overflow_ += bytes.size() - kept;
}

std::optional<Frame> Reader::finish() {
  if (filled_ == 0) return std::nullopt;  // a delimiter after a delimiter is idle line, no fault
  if (overflow_ > 0) {
    discard(counters_.oversize);
    return std::nullopt;
  }
  const auto plain = cobsDecodeInPlace(std::span{buffer_}.first(filled_));
  if (!plain) {
    discard(counters_.bad_cobs);
    return std::nullopt;
  }
  const auto frame = decodeBare(std::span{buffer_}.first(*plain));
  if (!frame) {
    discard(frame.error() == FrameFault::bad_crc ? counters_.bad_crc : counters_.bad_length);
    return std::nullopt;
  }
  filled_ = 0;
  ++counters_.frames;
  return *frame;
}

void Reader::discard(std::uint64_t& counter) {
  ++counter;
  counters_.discarded_bytes += unfinished();
  filled_ = overflow_ = 0;
}

std::optional<Frame> Reader::nextBare(std::span<const std::byte>& bytes) {
  if (auto frame = inPlace(bytes)) return frame;
  while (gather(kHeaderSize, bytes)) {
    const std::size_t payload = headerOf(std::span{buffer_}.subspan(taken_)).payload_length;
    if (payload > max_payload_) {
      passByte(counters_.oversize);
      continue;
    }
    if (!gather(bareSize(payload), bytes)) break;
    if (auto frame = checkBare(bareSize(payload))) return frame;
  }
  return std::nullopt;
}

// A good frame that lies in one piece need not be gathered.
std::optional<Frame> Reader::inPlace(std::span<const std::byte>& bytes) {
  if (filled_ > taken_ || bytes.size() < kHeaderSize) return std::nullopt;
  const std::size_t payload = headerOf(bytes).payload_length;
  if (payload > max_payload_ || bytes.size() < bareSize(payload)) return std::nullopt;
  const auto frame = decodeBare(bytes.first(bareSize(payload)));
  if (!frame) return std::nullopt;
  bytes = bytes.subspan(bareSize(payload));
  searching_ = false;
  ++counters_.frames;
  return *frame;
}

// Whether the buffer holds `size` bytes that are not done with; takes what is missing from the front of `bytes`.
bool Reader::gather(std::size_t size, std::span<const std::byte>& bytes) {
  const std::size_t held = filled_ - taken_;
  if (held >= size) return true;
  if (taken_ + size > buffer_.size()) {
    std::copy(buffer_.begin() + static_cast<std::ptrdiff_t>(taken_),
              buffer_.begin() + static_cast<std::ptrdiff_t>(filled_), buffer_.begin());
    filled_ = held;
    taken_ = 0;
  }
  const auto more = bytes.first(std::min(size - held, bytes.size()));
  copyBytes(more, buffer_.data() + filled_);
  filled_ += more.size();
  bytes = bytes.subspan(more.size());
  return filled_ - taken_ >= size;
}

std::optional<Frame> Reader::checkBare(std::size_t size) {
  const auto frame = decodeBare(std::span{buffer_}.subspan(taken_, size));
  if (!frame) {
    passByte(counters_.bad_crc);
    return std::nullopt;
  }
  taken_ += size;
  if (taken_ == filled_) taken_ = filled_ = 0;
  searching_ = false;
  ++counters_.frames;
  return *frame;
}

// One fault is counted for all the bytes that are passed over until the next good frame.
void Reader::passByte(std::uint64_t& fault) {
  if (!searching_) ++fault;
  searching_ = true;
  ++taken_;
  ++counters_.discarded_bytes;
}

}  // namespace probebox::frame
