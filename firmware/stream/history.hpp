#pragma once
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <vector>

#include "firmware/stream/sample_ring.hpp"
#include "firmware/stream/trigger_history.hpp"
#include "protocol/messages/types.hpp"

namespace probebox::stream {

// Keeps the last descriptors of a box by hash: blocks in the history may have been encoded under earlier ones.
class DescriptorBook {
 public:
  // Far more than can change while a block waits.
  static constexpr std::size_t kKept = 32;

  // Adds the payload of DESCRIPTOR, valid from now on. Allocates.
  void add(std::span<const std::byte> encoded);

  // Hash of the newest; 0 before the first.
  std::uint32_t current() const { return known_.empty() ? 0 : known_.back().hash; }
  // Empty when it is unknown or no longer kept.
  std::span<const std::byte> find(std::uint32_t hash) const;

 private:
  struct Known {
    std::uint32_t hash{};
    std::vector<std::byte> encoded;
  };
  std::deque<Known> known_;
};

// Keeps the last seconds of the stream in every profile, shared by all links, with the descriptors that the blocks were
// encoded under. A reconnecting host resumes from here. The box pushes every block and gap here first, then offers it
// to the sessions.
class History {
 public:
  // bytes, pieces: capacity per profile. Profile raw is always included.
  History(std::size_t bytes, std::size_t pieces, std::vector<messages::Profile> others = {},
          TriggerHistory triggers = TriggerHistory{});

  // Sets the descriptor of the blocks pushed from now on. Allocates.
  void setDescriptor(std::span<const std::byte> encoded) { descriptors_.add(encoded); }
  const DescriptorBook& descriptors() const { return descriptors_; }

  // Makes room by dropping the oldest. A gap before the block is kept as a loss of the clock (its index jumped); a
  // block with a decreasing index is ignored.
  void push(const EncodedBlock& block);
  // Adds the gap in all profiles.
  void push(const GapNotice& gap);

  void push(const messages::Trigger& trigger) { triggers_.push(trigger); }
  void reachTrigger(std::uint32_t number) { triggers_.reach(number); }
  const TriggerHistory& triggers() const { return triggers_; }

  bool has(messages::Profile profile) const { return lineOf(profile) != nullptr; }
  // Oldest sample of one of its profiles.
  SampleIndex oldest(messages::Profile profile) const;
  SampleIndex next(messages::Profile profile) const { return lineOf(profile)->ring.next(); }
  // False until the first push.
  bool begun(messages::Profile profile = messages::Profile::raw) const { return lineOf(profile)->begun; }
  std::optional<Piece> find(messages::Profile profile, SampleIndex sample) const {
    return lineOf(profile)->ring.find(sample);
  }

 private:
  // Blocks of the stream as encoded for one profile.
  struct Line {
    messages::Profile profile{};
    SampleRing ring;
    bool begun{};
  };
  const Line* lineOf(messages::Profile profile) const;
  static bool reach(Line& line, SampleIndex first);
  static void push(Line& line, const GapNotice& gap);

  std::vector<Line> lines_;
  DescriptorBook descriptors_;
  TriggerHistory triggers_;
};

}  // namespace probebox::stream
