#include "compact_entry.hpp"

#include <algorithm>
#include <array>
#include <span>
#include <vector>

#include "protocol/compact/compact.hpp"
#include "protocol/frame/bytes.hpp"
#include "protocol/frame/crc32c.hpp"
#include "require.hpp"

namespace {

using namespace probebox;
using fuzz::require;
using messages::MessageType;
using Bytes = std::span<const std::byte>;

// Gives the restorer one piece after the other, with the name of what it may refer to in front.
class Scene {
 public:
  void take(unsigned kind, Bytes bytes) {
    switch (kind % 5) {
      case 0: {
        give(MessageType::samples, bytes);
        const auto summary = codec::inspect(bytes);
        const auto head = summary ? codec::headSize(summary->channels) : 0;
        if (summary && head <= bytes.size()) head_ = compact::nameOfHead(bytes.first(head), 0);
        return;
      }
      case 1:
        return give(MessageType::short_samples, named(head_, bytes));
      case 2:
        return give(MessageType::heartbeat_change, named(beat_, bytes));
      case 3:
        return give(MessageType::heartbeat_change, named(0, bytes));
      default:
        return give(static_cast<MessageType>(kind), bytes);
    }
  }

 private:
  static std::vector<std::byte> named(std::uint32_t crc, Bytes bytes) {
    std::vector<std::byte> all(sizeof crc);
    frame::storeLittle(crc, all.data());
    all.insert(all.end(), bytes.begin(), bytes.end());
    return all;
  }

  void give(MessageType type, Bytes payload) {
    frame::Frame frame;
    frame.header.type = static_cast<std::uint8_t>(type);
    frame.payload = payload;
    const auto restored = restorer_.restore(frame);
    require(restored.payload.size() <= frame::kMaxPayload);
    if (restored.header.type == static_cast<std::uint8_t>(type)) return;
    if (type == MessageType::heartbeat_change) {
      const auto beat = messages::decode<messages::Heartbeat>(restored.payload);
      require(beat.ok() && std::ranges::equal(messages::encoded(*beat), restored.payload));
      if (frame::loadLittle<std::uint32_t>(payload.data()) == 0) beat_ = frame::crc32c(payload);
    }
    if (type == MessageType::short_samples) require(codec::inspect(restored.payload).ok());
  }

  compact::Restorer restorer_;
  std::uint32_t head_{};
  std::uint32_t beat_{};
};

}  // namespace

// u8 kind, u8 length, so many bytes; and again.
int feedCompact(const std::uint8_t* data, std::size_t size) {
  fuzz::feeding({data, size});
  Scene scene;
  auto rest = std::as_bytes(std::span{data, size});
  while (rest.size() >= 2) {
    const auto kind = std::to_integer<unsigned>(rest[0]);
    const auto length = std::min(std::to_integer<std::size_t>(rest[1]), rest.size() - 2);
    scene.take(kind, rest.subspan(2, length));
    rest = rest.subspan(2 + length);
  }
  return 0;
}
