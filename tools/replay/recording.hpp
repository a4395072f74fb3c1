#pragma once
#include <cstddef>
#include <optional>
#include <variant>
#include <vector>

#include "protocol/codec/block.hpp"
#include "protocol/messages/handshake.hpp"
#include "protocol/messages/stream.hpp"

namespace probebox::replay {

// Holds a block in both profiles that boxes send.
struct RecordedBlock {
  codec::BlockHeader header{};
  std::vector<std::byte> raw;
  std::vector<std::byte> fast;
};

// Holds one entry of a recording.
using Recorded =
    std::variant<messages::Descriptor, RecordedBlock, messages::Gap, messages::Trigger, messages::TriggerGap>;

// What a ReplayBox serves: a file, or a stream that a test makes up.
class Recording {
 public:
  virtual ~Recording() = default;

  // Returns nothing at the end.
  virtual std::optional<Recorded> next() = 0;
  virtual const messages::Descriptor& firstDescriptor() const = 0;
};

}  // namespace probebox::replay
