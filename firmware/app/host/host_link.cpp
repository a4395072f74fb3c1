#include "firmware/app/host/host_link.hpp"

#include <array>
#include <utility>

namespace probebox::app {
namespace {

constexpr std::size_t kReadAtOnce = 4096;
constexpr int kReadsInTurn = 4;

stream::SessionOptions withLanes(stream::SessionOptions options, const io::Connection& connection) {
  options.two_lanes = connection.control != nullptr;
  return options;
}

}  // namespace

HostLink::HostLink(std::uint64_t id, io::Connection connection, stream::SessionOptions options,
                   const stream::History& history)
    : id_{id}, connection_{std::move(connection)}, session_{withLanes(std::move(options), connection_), history} {}

void HostLink::receive(MonoTime now) {
  if (closed()) return;
  const bool open = receive(*connection_.data, stream::Lane::data, now) &&
                    (!connection_.control || receive(*connection_.control, stream::Lane::control, now));
  if (!open) hangUp();
}

bool HostLink::receive(io::BytePipe& pipe, stream::Lane lane, MonoTime now) {
  std::array<std::byte, kReadAtOnce> bytes;
  for (int turn = 0; turn < kReadsInTurn; ++turn) {
    const io::Transfer got = pipe.read(bytes);
    if (got.bytes > 0) session_.receive(std::span{bytes}.first(got.bytes), now, lane);
    if (got.state == io::PipeState::closed) return false;
    if (got.bytes < bytes.size()) return true;
  }
  return true;
}

void HostLink::flush() {
  if (closed()) return;
  waits_for_writing_ = false;
  const bool open = (!connection_.control || flush(*connection_.control, stream::Lane::control)) &&
                    flush(*connection_.data, stream::Lane::data);
  if (!open) hangUp();
}

bool HostLink::flush(io::BytePipe& pipe, stream::Lane lane) {
  while (true) {
    const auto bytes = session_.pending(lane);
    if (bytes.empty()) return true;
    const io::Transfer put = pipe.write(bytes);
    session_.sent(put.bytes, lane);
    if (put.state == io::PipeState::closed) return false;
    if (put.bytes < bytes.size()) {
      waits_for_writing_ = waits_for_writing_ || pipe.watchedForWriting();
      return true;
    }
  }
}

void HostLink::hangUp() {
  connection_ = {};
}

}  // namespace probebox::app
