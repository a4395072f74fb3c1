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

// One request of the host. The body is valid until the next call of nextRequest().
struct PendingRequest {
  std::uint64_t ticket{};  // for answer(); unique during the link's lifetime
  messages::Operation operation{};
  std::span<const std::byte> body{};
};

// Executes each request once, however often it is sent: the latest answers are kept and sent again. Bounded; allocates
// in the constructor only.
class ControlChannel {
 public:
  struct Limits {
    std::size_t request_bytes{4096};
    std::size_t answer_bytes{16384};
  };
  static constexpr std::size_t kPending = 8;
  static constexpr std::size_t kRemembered = 8;

  explicit ControlChannel(Limits limits);

  // Forgets everything: a new host, or the same one after a restart.
  void restart();

  // Returns the ANSWER payload that can be sent at once for this request; empty when the box has not answered yet.
  std::span<const std::byte> receive(const messages::RequestView& request);

  std::optional<PendingRequest> next();

  // Returns the ANSWER payload to send now; empty when the ticket is not open. A body too large for an answer becomes
  // too_large.
  std::span<const std::byte> answer(std::uint64_t ticket, messages::ErrorCode code, std::string_view text,
                                    std::span<const std::byte> body);

 private:
  struct Known {
    std::uint32_t id{};
    messages::Operation operation{};
    std::uint32_t body_crc{};
    std::uint64_t ticket{};  // 0: unused

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
