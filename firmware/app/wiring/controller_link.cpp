#include "firmware/app/wiring/controller_link.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <utility>

#include "drivers/tcp/linux_tcp.hpp"
#include "protocol/frame/frame.hpp"
#include "protocol/messages/control.hpp"
#include "protocol/messages/handshake.hpp"

namespace probebox::app {
namespace {

constexpr std::chrono::milliseconds kConnect{100};

world::Prompt promptOf(const messages::ProcedureStatus::Answer& answer) {
  return {answer, answer.run, answer.state, answer.step, answer.referenced};
}

}  // namespace

ControllerLink::ControllerLink(tcp::Address box, bool has_y) : box_{std::move(box)}, has_y_{has_y} {}
ControllerLink::~ControllerLink() = default;

void ControllerLink::postMarker(const Marker& marker) {
  // The same marker again, because no answer came: the same request, which the box does once.
  if (marker.at == marker_at_ && !marker_answer_)
    return sendRequest(marker_id_, messages::Operation::post_marker, marker_body_);
  marker_answer_.reset();
  marker_at_ = marker.at;
  const messages::PostMarker::Request request{.procedure = marker.procedure,
                                              .step = marker.step,
                                              .phase = static_cast<messages::StepPhase>(marker.phase),
                                              .rotary_angles_rad = marker.rotary_angles_rad,
                                              .tool = marker.tool,
                                              .nominal_speed_mm_s = marker.nominal_speed_mm_s,
                                              .at_rest = marker.at_rest};
  marker_body_ = messages::encoded(request);
  marker_id_ = ask(messages::Operation::post_marker, marker_body_);
}

void ControllerLink::home(const world::Vector3& position_mm) {
  const std::uint8_t axes = has_y_ ? 0b111 : 0b101;
  ask(messages::Operation::home_axes, messages::encoded(messages::HomeAxes::Request{axes, position_mm}));
}

std::optional<bool> ControllerLink::markerAnswer() {
  receive();
  return marker_answer_;
}

void ControllerLink::askProcedureStatus() {
  status_.reset();
  status_id_ = ask(messages::Operation::procedure_status, {});
}

std::optional<world::Prompt> ControllerLink::procedureStatus() {
  receive();
  return status_;
}

bool ControllerLink::connected() {
  if (pipe_) return true;
  auto pipe = tcp::connectTcp(box_, kConnect);
  if (!pipe) return false;
  pipe_ = std::move(*pipe);
  reader_.restart();
  outgoing_.clear();
  sequence_ = 0;
  send(messages::MessageType::hello, messages::encoded(messages::Hello::current({})));
  return true;
}

std::uint32_t ControllerLink::ask(messages::Operation operation, std::vector<std::byte> body) {
  const std::uint32_t id = ++last_id_;
  sendRequest(id, operation, std::move(body));
  return id;
}

void ControllerLink::sendRequest(std::uint32_t id, messages::Operation operation, std::vector<std::byte> body) {
  if (!connected()) return;
  send(messages::MessageType::request,
       messages::encoded(messages::Request{.id = id, .operation = operation, .body = std::move(body)}));
  transmit();
}

void ControllerLink::send(messages::MessageType type, const std::vector<std::byte>& payload) {
  std::vector<std::byte> scratch(frame::bareSize(payload.size()));
  std::vector<std::byte> bytes(frame::delimitedMaxSize(payload.size()));
  const frame::Header header{.major = messages::kProtocolMajor,
                             .type = static_cast<std::uint8_t>(type),
                             .flags = 0,
                             .stream = 0,
                             .payload_length = 0,
                             .sequence = sequence_++,
                             .descriptor_hash = 0};
  const std::size_t size = frame::encodeDelimited(header, payload, scratch, bytes);
  outgoing_.insert(outgoing_.end(), bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size));
}

void ControllerLink::transmit() {
  if (!pipe_) return;
  const io::Transfer put = pipe_->write(outgoing_);
  outgoing_.erase(outgoing_.begin(), outgoing_.begin() + static_cast<std::ptrdiff_t>(put.bytes));
  if (put.state == io::PipeState::closed) pipe_.reset();
}

void ControllerLink::receive() {
  transmit();
  std::array<std::byte, 4096> buffer;
  while (pipe_) {
    const io::Transfer got = pipe_->read(buffer);
    std::span<const std::byte> bytes = std::span{buffer}.first(got.bytes);
    while (!bytes.empty()) {
      const auto frame = reader_.next(bytes);
      if (!frame || frame->header.type != static_cast<std::uint8_t>(messages::MessageType::answer)) continue;
      if (const auto answer = messages::decode<messages::AnswerView>(frame->payload)) take(*answer);
    }
    if (got.state == io::PipeState::closed) pipe_.reset();
    if (got.bytes == 0) break;
  }
}

void ControllerLink::take(const messages::AnswerView& answer) {
  const bool is_ok = answer.code == messages::ErrorCode::ok;
  if (answer.id == marker_id_) marker_answer_ = is_ok;
  if (answer.id != status_id_ || !is_ok) return;
  if (const auto status = messages::decode<messages::ProcedureStatus::Answer>(answer.body)) status_ = promptOf(*status);
}

}  // namespace probebox::app
