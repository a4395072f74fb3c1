#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "firmware/stream/byte_fifo.hpp"
#include "protocol/messages/request.hpp"
#include "protocol/messages/types.hpp"

namespace probebox::stream {

// One thing that the host asks. The body is valid until the next call of nextRequest().
struct PendingRequest {
  std::uint64_t ticket{};  // for answer(); unique for the life of the link
  messages::Operation operation{};
  std::span<const std::byte> body{};
};

// Requests in, answers out, each request done once however often it is sent: the last answers are kept and given again.
// Bounded; allocates in the constructor only.
class ControlChannel {
 public:
  struct Limits {
    std::size_t request_bytes{4096};
    std::size_t answer_bytes{16384};
  };
  static constexpr std::size_t kPending = 8;
  static constexpr std::size_t kRemembered = 8;

  explicit ControlChannel(Limits limits);

  // A new host, or the same one anew: nothing before counts.
  void restart();

  // What to send at once for this request, as an ANSWER's payload; empty when the box has still to answer.
  std::span<const std::byte> receive(const messages::RequestView& request);

  std::optional<PendingRequest> next();

  // The ANSWER's payload, to be sent now; empty when the ticket is not open. A body that no answer can hold becomes
  // too_large.
  std::span<const std::byte> answer(std::uint64_t ticket, messages::ErrorCode code, std::string_view text,
                                    std::span<const std::byte> body);

 private:
  struct Known {
    std::uint32_t id{};
    messages::Operation operation{};
    std::uint32_t body_crc{};
    std::uint64_t ticket{};  // 0: the place is free

    bool same(const Known& other) const {
      return id == other.id && operation == other.operation && body_crc == other.body_crc;
    }
  };
  struct Remembered {
    Known request{};
    std::vector<std::byte> payload{};
    std::size_t size{};
  };
  std::span<const std::byte> write(std::vector<std::byte>& into, const messages::AnswerView& answer);
  std::span<const std::byte> refuse(const messages::RequestView& request, messages::ErrorCode code,
                                    std::string_view text);

  ByteFifo bodies_;
  std::array<Known, kPending> pending_{};
  std::array<Remembered, kRemembered> remembered_{};
  std::vector<std::byte> refusal_;
  std::size_t next_remembered_{};
  std::uint64_t last_ticket_{};
  bool front_is_out_{};
};

}  // namespace probebox::stream
