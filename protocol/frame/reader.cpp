#include "protocol/frame/reader.hpp"

#include <algorithm>

namespace probebox::frame {

Reader::Reader(std::size_t max_payload) : buffer_(delimitedMaxSize(max_payload) - 1) {}

std::optional<Frame> Reader::next(std::span<const std::byte>& bytes) {
  while (!bytes.empty()) {
    const auto end = std::ranges::find(bytes, kDelimiter);
    const auto length = static_cast<std::size_t>(end - bytes.begin());
    collect(bytes.first(length));
    if (end == bytes.end()) {
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
  filled_ = overflow_ = 0;
}

void Reader::collect(std::span<const std::byte> bytes) {
  const auto kept = std::min(bytes.size(), buffer_.size() - filled_);
  std::ranges::copy(bytes.first(kept), buffer_.begin() + static_cast<std::ptrdiff_t>(filled_));
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

}  // namespace probebox::frame
