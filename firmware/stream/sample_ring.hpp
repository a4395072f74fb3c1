#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "firmware/stream/byte_fifo.hpp"
#include "protocol/messages/stream.hpp"
#include "protocol/units/time.hpp"

namespace probebox::stream {

using messages::GapReason;

// A closed block of the codec in one of its profiles.
struct EncodedBlock {
  SampleIndex first{};
  std::uint32_t count{};
  std::span<const std::byte> bytes{};
  messages::Profile profile{};
};

// Samples that no source delivered.
struct GapNotice {
  SampleIndex first{};
  std::uint64_t count{};
  GapReason reason{};
};

// A part of the stream: a block (with bytes) or a loss (without).
struct Piece {
  SampleIndex first{};
  std::uint64_t count{};
  GapReason reason{};
  std::span<const std::byte> bytes{};
  std::uint32_t descriptor{};  // hash of the descriptor that the block was encoded under

  bool isBlock() const { return !bytes.empty(); }
  SampleIndex end() const { return first + static_cast<std::int64_t>(count); }
};

// Holds blocks and losses in the order of their samples, without gaps. Bounded in bytes and pieces; dropped blocks
// become losses. Allocates in the constructor only.
class SampleRing {
 public:
  SampleRing(std::size_t bytes, std::size_t pieces);

  // descriptor: hash of the one that the block was encoded under. Returns false and changes nothing when there is no
  // room.
  bool pushBlock(const EncodedBlock& block, std::uint32_t descriptor = 0);
  // Never fails: neighbouring losses are merged.
  void pushGap(const GapNotice& gap);

  // Turns the oldest block into a loss, or merges the two oldest losses. Returns false when nothing is left to drop.
  bool giveUpOldest(GapReason reason);

  Piece front() const { return piece(0); }
  void popFront();
  // The piece that contains the sample.
  std::optional<Piece> find(SampleIndex sample) const;
  void clear();

  bool empty() const { return count_ == 0; }
  // Index after the newest piece; for an empty ring the index at which it was emptied.
  SampleIndex next() const { return next_; }
  std::uint64_t samples() const { return samples_; }
  std::size_t bytes() const { return blocks_.bytes(); }

 private:
  struct Entry {
    SampleIndex first{};
    std::uint64_t count{};
    GapReason reason{};
    bool is_block{};
    std::uint32_t descriptor{};
    std::uint64_t serial{};  // of the block; minus that of the oldest it is the place in blocks_
  };
  Entry& entry(std::size_t k) { return entries_[(head_ + k) % entries_.size()]; }
  const Entry& entry(std::size_t k) const { return entries_[(head_ + k) % entries_.size()]; }
  Piece piece(std::size_t k) const;
  void append(const Entry& added);
  void joinWithNext(std::size_t k);

  ByteFifo blocks_;
  std::vector<Entry> entries_;
  std::size_t head_{};
  std::size_t count_{};
  std::uint64_t oldest_serial_{};
  std::uint64_t samples_{};
  SampleIndex next_{};
};

}  // namespace probebox::stream
