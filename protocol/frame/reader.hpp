#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "protocol/frame/frame.hpp"

namespace probebox::frame {

struct ReaderCounters {
  std::uint64_t frames{};
  std::uint64_t bad_crc{};
  std::uint64_t bad_cobs{};
  std::uint64_t bad_length{};
  std::uint64_t oversize{};
  std::uint64_t discarded_bytes{};  // of everything that was not a good frame, without delimiters

  std::uint64_t bad() const { return bad_crc + bad_cobs + bad_length + oversize; }
};

// Finds frames in the bytes of a link or a file. Allocates in the constructor only.
// Delimited: the frame after a delimiter is always found, so damaged bytes cost at most the frame that holds them.
// Bare: after a fault every byte is tried as the beginning of a frame until a checksum matches. Later frames are found,
// with a delay of at most the longest frame.
class Reader {
 public:
  explicit Reader(std::size_t max_payload = kMaxPayload, Framing framing = Framing::delimited);

  // Consumes bytes from the front of `bytes` up to the end of the next good frame and returns that frame, or all bytes.
  // The frame's payload is valid until the next call, and no longer than the bytes that `bytes` pointed to.
  std::optional<Frame> next(std::span<const std::byte>& bytes);

  // Returns the bytes of an incomplete frame; at the end of a file, of the one that was cut off.
  std::size_t unfinished() const { return filled_ - taken_ + overflow_; }
  const ReaderCounters& counters() const { return counters_; }

  // Discards an incomplete frame (counted as discarded bytes) when a link is opened again.
  void restart();

 private:
  std::optional<Frame> nextDelimited(std::span<const std::byte>& bytes);
  void collect(std::span<const std::byte> bytes);
  std::optional<Frame> finish();

  std::optional<Frame> nextBare(std::span<const std::byte>& bytes);
  std::optional<Frame> inPlace(std::span<const std::byte>& bytes);
  bool gather(std::size_t size, std::span<const std::byte>& bytes);
  std::optional<Frame> checkBare(std::size_t size);
  void passByte(std::uint64_t& fault);
  void discard(std::uint64_t& counter);

  Framing framing_;
  std::size_t max_payload_;
  std::vector<std::byte> buffer_;
  std::size_t filled_{};
  std::size_t taken_{};     // bare: bytes at the front of the buffer that are done with
  bool searching_{};        // bare: the last frame was bad, its fault is counted
  std::size_t overflow_{};  // bytes of an oversize frame beyond the buffer
  ReaderCounters counters_{};
};

}  // namespace probebox::frame
