#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

namespace probebox::modbus {

inline constexpr std::size_t kMaxFrameBytes = 256;

enum class Function : std::uint8_t {
  read_holding = 3,
  read_input = 4,
  write_one = 6,
  write_many = 16,
  encapsulated = 43
};

// One received request of the master: unit, function, data, CRC.
struct Request {
  std::array<std::uint8_t, kMaxFrameBytes> bytes{};
  std::size_t size{};

  std::uint8_t unit() const { return bytes[0]; }
  Function function() const { return static_cast<Function>(bytes[1]); }
  std::uint16_t word(std::size_t at) const { return static_cast<std::uint16_t>(bytes[at] << 8 | bytes[at + 1]); }
  std::uint16_t address() const { return word(2); }
};

// Copies as many bytes as there is room for; returns how many.
std::size_t copied(std::span<const std::byte> bytes, std::span<std::uint8_t> room);

// CRC-16 of Modbus over serial line 1.02, section 6.2.2.
std::uint16_t crc16(std::span<const std::uint8_t> bytes);

// Whether bytes begin with a whole request whose CRC is good.
enum class Begins : std::uint8_t { request, undecided, something_else };
Begins beginsRequest(std::span<const std::uint8_t> bytes);

// Finds requests in the bytes of a serial line by length and CRC, not by the gaps between bytes, which USB adapters and
// busy systems do not preserve. A frame begins after silence or after a good frame. Answers of other units, and damaged
// frames over their stated length, are skipped as a whole: what looks like a request inside them is none. Garbage that
// begins no frame is skipped and counted; a request may follow it without a pause. A request with a function of unknown
// length is found only after silence or a good frame, so that it can be refused.
// Noise before a request (an RS-485 adapter that turns its direction adds a byte, a master that was interrupted leaves
// a header) seems to begin a longer frame. A whole request at the end of the bytes wins over it once the line pauses:
// call afterPause(). Allocates nothing.
class RtuRequests {
 public:
  // Takes as many bytes as fit; offer the rest after next() has returned nothing.
  std::size_t push(std::span<const std::byte> bytes);

  std::optional<Request> next();

  // Call when the line has been silent for as long as it is between frames (t3.5) and next() has returned nothing.
  // Returns the request that ends with the last byte but for kMostNoise, whatever stands before it if it reads; a write
  // only behind up to kMostNoise bytes, as more may be a frame that holds it.
  static constexpr std::size_t kMostNoise = 3;
  std::optional<Request> afterPause();

  // Discards an incomplete request: the line was silent for longer than any pause inside a request.
  void silence();
  bool pending() const { return size_ > 0; }

  std::uint64_t skippedBytes() const { return skipped_bytes_; }
  std::uint64_t badFrames() const { return bad_frames_; }  // runs of skipped bytes

 private:
  std::span<const std::uint8_t> from(std::size_t offset) const {
    return std::span{buffer_}.subspan(offset, size_ - offset);
  }
  bool isGood(std::size_t length) const;
  bool isOpen(std::size_t length) const;
  Request take(std::size_t offset, std::size_t length);
  std::optional<Request> requestInGarbage();
  bool mayBeUnknownFunction() const;
  std::optional<Request> unknownFunction();
  void consume(std::size_t count);
  void skip(std::size_t count);

  std::array<std::uint8_t, 2 * kMaxFrameBytes> buffer_{};
  std::size_t size_{};
  std::uint64_t skipped_bytes_{};
  std::uint64_t bad_frames_{};
  bool in_garbage_{};
};

}  // namespace probebox::modbus
