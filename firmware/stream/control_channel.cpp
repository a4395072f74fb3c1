#include "firmware/stream/control_channel.hpp"

#include <algorithm>

#include "protocol/frame/crc32c.hpp"
#include "protocol/messages/fields.hpp"

namespace probebox::stream {
namespace {

using messages::AnswerView;
using messages::ErrorCode;
using messages::RequestView;

// A request that waits for nextRequest(): ticket, operation, body.
struct Waiting {
  std::uint64_t ticket{};
  messages::Operation operation{};
  std::span<const std::byte> body{};
  static constexpr void fields(auto& self, auto&& field) {
    field("ticket", self.ticket, "");
    field("operation", self.operation, "");
    field("body", self.body, "");
  }
};
constexpr std::size_t kWaitingOverhead = 8 + 2 + 2;

}  // namespace

ControlChannel::ControlChannel(Limits limits)
    : bodies_{kPending * (limits.request_bytes + kWaitingOverhead), kPending + 1}, refusal_(256) {
  for (auto& remembered : remembered_) remembered.payload.resize(limits.answer_bytes);
}

void ControlChannel::restart() {
  bodies_.clear();
  pending_.fill({});
  for (auto& remembered : remembered_) remembered.request = {};
  front_is_out_ = false;
}

std::span<const std::byte> ControlChannel::receive(const RequestView& request) {
  const Known known{request.id, request.operation, frame::crc32c(request.body), last_ticket_ + 1};
  for (const auto& done : remembered_) {
    if (done.request.ticket == 0 || done.request.id != request.id) continue;
    if (done.request.same(known)) return std::span{done.payload}.first(done.size);
    return refuse(request, ErrorCode::malformed, "this id is used by another request; use a new id for each");
  }
  for (const auto& open : pending_) {
    if (open.ticket == 0 || open.id != request.id) continue;
    if (open.same(known)) return {};
    return refuse(request, ErrorCode::malformed, "this id is used by another request; use a new id for each");
  }
  const auto place = std::ranges::find(pending_, 0U, &Known::ticket);
  const Waiting waiting{known.ticket, request.operation, request.body};
  const auto room = place == pending_.end() ? std::span<std::byte>{} : bodies_.room(messages::encodedSize(waiting));
  const auto size = messages::encode(waiting, room);
  if (!size) return refuse(request, ErrorCode::busy, "too many requests at once; wait for an answer and ask again");
  bodies_.commit(*size);
  *place = known;
  ++last_ticket_;
  return {};
}

std::optional<PendingRequest> ControlChannel::next() {
  if (front_is_out_) bodies_.pop();
  front_is_out_ = !bodies_.empty();
  if (!front_is_out_) return std::nullopt;
  const auto waiting = messages::decode<Waiting>(bodies_.front());
  return PendingRequest{waiting->ticket, waiting->operation, waiting->body};
}

std::span<const std::byte> ControlChannel::answer(std::uint64_t ticket, ErrorCode code, std::string_view text,
                                                  std::span<const std::byte> body) {
  const auto open = ticket == 0 ? pending_.end() : std::ranges::find(pending_, ticket, &Known::ticket);
  if (open == pending_.end()) return {};
  auto& kept = remembered_[next_remembered_];
  next_remembered_ = (next_remembered_ + 1) % remembered_.size();
  kept.request = *open;
  *open = {};
  auto written = write(kept.payload, {kept.request.id, kept.request.operation, code, text, body});
  if (written.empty()) {
    written = write(kept.payload, {kept.request.id,
                                   kept.request.operation,
                                   ErrorCode::too_large,
                                   "the answer is larger than one frame; ask for less at a time",
                                   {}});
  }
  kept.size = written.size();
  return written;
}

std::span<const std::byte> ControlChannel::write(std::vector<std::byte>& into, const AnswerView& answer) {
  const auto size = messages::encode(answer, into);
  return size ? std::span<const std::byte>{into}.first(*size) : std::span<const std::byte>{};
}

std::span<const std::byte> ControlChannel::refuse(const RequestView& request, ErrorCode code, std::string_view text) {
  return write(refusal_, {request.id, request.operation, code, text, {}});
}

}  // namespace probebox::stream
