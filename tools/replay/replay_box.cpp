#include "tools/replay/replay_box.hpp"

#include <algorithm>
#include <array>
#include <poll.h>
#include <random>

#include "protocol/messages/control.hpp"
#include "tools/link/wait.hpp"

namespace probebox::replay {
namespace {

using messages::ErrorCode;
using messages::Operation;

constexpr std::size_t kHistoryBytes = 2U << 20U;
constexpr std::size_t kHistoryPieces = 2048;
constexpr std::size_t kTriggers = 4096;  // numbered as they were recorded
constexpr std::size_t kMostHosts = 8;
constexpr std::uint64_t kMostWaiting = 4096;  // samples in a host's queue, at full speed
constexpr int kBlocksInTurn = 64;
constexpr int kReadsInTurn = 4;  // a host that sends without pause does not keep the others waiting
constexpr Nanoseconds kHelloUntil = std::chrono::seconds{5};
constexpr Nanoseconds kGreets = std::chrono::milliseconds{200};  // a host that means to, by then

messages::BootId anyBootId() {
  messages::BootId id{};
  std::random_device random;
  for (auto& byte : id) byte = static_cast<std::byte>(random());
  return id;
}

}  // namespace

ReplayBox::ReplayBox(std::unique_ptr<Recording> recording, tcp::Listener listener, const ReplayOptions& options)
    : recording_{std::move(recording)},
      listener_{std::move(listener)},
      options_{options},
      boot_id_{anyBootId()},
      started_{link::now()},
      history_{kHistoryBytes, kHistoryPieces, {messages::Profile::fast}, stream::TriggerHistory{kTriggers, 0}} {
  offer(recording_->firstDescriptor());
  next_ = recording_->next();
}

bool ReplayBox::round() {
  const MonoTime now = link::now();
  accept(now);
  bool produced = false;
  for (int k = 0; k < kBlocksInTurn && produce(now); ++k) produced = true;
  for (auto& host : hosts_) serve(host, now);
  std::erase_if(hosts_, [](const Host& host) { return host.closed; });
  if (options_.once && ended_ && (hosts_.empty() ? had_hosts_ : everybodyHasAll() && !somebodyListens())) return false;
  wait(produced);
  return true;
}

void ReplayBox::accept(MonoTime now) {
  while (auto pipe = listener_.accept()) {
    if (hosts_.size() >= kMostHosts) {
      // One that has said nothing gives way, the first of them; among hosts that listen there is no room.
      const auto isSilent = [now](const Host& host) {
        return host.session->state() == stream::SessionState::waiting && now - host.since > kGreets;
      };
      const auto silent = std::ranges::find_if(hosts_, isSilent);
      if (silent == hosts_.end()) continue;  // the new one is closed
      hosts_.erase(silent);
    }
    stream::SessionOptions session;
    session.boot_id = boot_id_;
    session.firmware_version = descriptor_.firmware_version;
    session.first_session_id = next_session_++;
    hosts_.push_back({std::move(pipe), std::make_unique<stream::Session>(session, history_), now, false});
  }
}

void ReplayBox::serve(Host& host, MonoTime now) {
  receive(host, now);
  auto& session = *host.session;
  session.advance(now, {.uptime_ms = uptimeMs(now),
                        .clock_state = map_.state,
                        .clock_sigma_ns = map_.sigma_ns,
                        .deadline_misses = 0,
                        .edges = {}});
  while (const auto asked = session.nextRequest()) answer(host, *asked, now);
  transmit(host);
  had_hosts_ = had_hosts_ || session.state() == stream::SessionState::streaming;
  const bool silent = session.state() == stream::SessionState::down ||
                      (session.state() == stream::SessionState::waiting && now - host.since > kHelloUntil);
  host.closed = host.closed || silent;
}

void ReplayBox::answer(Host& host, const stream::PendingRequest& asked, MonoTime now) {
  auto& session = *host.session;
  switch (asked.operation) {
    case Operation::status: {
      messages::Status::Answer status;
      status.board = descriptor_.board;
      status.firmware_version = descriptor_.firmware_version;
      status.uptime_ms = uptimeMs(now);
      status.clock.state = map_.state;
      status.clock.sigma_ns = map_.sigma_ns;
      status.clock.tick = map_.tick;
      status.ledger = {samples_ + lost_, lost_, 0};
      status.procedure = std::string{ended_ ? "replay, at its end: " : "replay: "} + options_.name;
      if (descriptor_.delay.calibrated) status.active_results = {descriptor_.delay.result_id};
      status.links = static_cast<std::uint16_t>(hosts_.size());
      session.answer(asked.ticket, ErrorCode::ok, {}, messages::encoded(status));
      return;
    }
    case Operation::list_results:
      session.answer(asked.ticket, ErrorCode::ok, {}, messages::encoded(messages::ListResults::Answer{}));
      return;
    default:
      session.answer(asked.ticket, ErrorCode::refused,
                     std::string{messages::nameOf(asked.operation)} +
                         " is for a box that measures, and this is a recording that is replayed; connect to the box");
  }
}

void ReplayBox::receive(Host& host, MonoTime now) {
  std::array<std::byte, 4096> buffer;
  for (int turn = 0; turn < kReadsInTurn; ++turn) {
    const auto got = host.pipe->read(buffer);
    host.closed = host.closed || got.state == io::PipeState::closed;
    if (got.bytes == 0) return;
    host.session->receive(std::span{buffer}.first(got.bytes), now);
  }
}

void ReplayBox::transmit(Host& host) {
  for (auto bytes = host.session->pending(); !bytes.empty(); bytes = host.session->pending()) {
    const auto moved = host.pipe->write(bytes);
    host.closed = host.closed || moved.state == io::PipeState::closed;
    if (moved.bytes == 0) return;
    host.session->sent(moved.bytes);
  }
}

// The next piece, when it is due.
bool ReplayBox::produce(MonoTime now) {
  if (!next_) {
    ended_ = true;
    return false;
  }
  if (!began_) {
    if (!somebodyListens()) return false;
    began_ = now;
  }
  if (!isDue(*next_, now)) return false;
  offer(*next_);
  next_ = recording_->next();
  return true;
}

// A block is due when its last sample would be: a box sends none before.
bool ReplayBox::isDue(const Recorded& recorded, MonoTime now) {
  if (options_.speed == 0) {
    return std::ranges::all_of(hosts_, [](const Host& host) {
      return host.session->state() != stream::SessionState::streaming ||
             host.session->feed().queuedSamples() < kMostWaiting;
    });
  }
  const auto* block = std::get_if<RecordedBlock>(&recorded);
  if (block == nullptr) return true;
  const auto& header = block->header;
  const MonoTime taken = codec::timeOf(header, header.first + static_cast<std::int64_t>(header.count));
  if (!recorded_begin_) recorded_begin_ = codec::timeOf(header, header.first);
  const double since = static_cast<double>((taken - *recorded_begin_).count()) / options_.speed;
  return static_cast<double>((now - *began_).count()) >= since;
}

void ReplayBox::offer(const Recorded& recorded) {
  if (const auto* descriptor = std::get_if<messages::Descriptor>(&recorded)) {
    descriptor_ = *descriptor;
    descriptor_.board = "replay of " + descriptor->board;
    history_.setDescriptor(messages::encoded(descriptor_));
  } else if (const auto* gap = std::get_if<messages::Gap>(&recorded)) {
    const stream::GapNotice notice{gap->first, gap->count, gap->reason};
    lost_ += gap->count;
    history_.push(notice);
    for (auto& host : hosts_) host.session->offer(notice);
  } else if (const auto* trigger = std::get_if<messages::Trigger>(&recorded)) {
    history_.push(*trigger);
  } else if (const auto* missing = std::get_if<messages::TriggerGap>(&recorded)) {
    history_.reachTrigger(missing->first);
    history_.reachTrigger(missing->first + missing->count);
  } else {
    const auto& block = std::get<RecordedBlock>(recorded);
    map_ = block.header.map;
    samples_ += block.header.count;
    offer(stream::EncodedBlock{block.header.first, block.header.count, block.raw, messages::Profile::raw});
    offer(stream::EncodedBlock{block.header.first, block.header.count, block.fast, messages::Profile::fast});
  }
}

void ReplayBox::offer(const stream::EncodedBlock& block) {
  history_.push(block);
  for (auto& host : hosts_) host.session->offer(block);
}

bool ReplayBox::somebodyListens() const {
  return std::ranges::any_of(hosts_,
                             [](const Host& host) { return host.session->state() == stream::SessionState::streaming; });
}

bool ReplayBox::everybodyHasAll() const {
  return std::ranges::all_of(hosts_, [](const Host& host) { return host.session->feed().queuedSamples() == 0; });
}

void ReplayBox::wait(bool briefly) const {
  constexpr int kWait_ms = 2;
  std::vector<pollfd> watched{{listener_.descriptor(), POLLIN, 0}};
  for (const auto& host : hosts_) watched.push_back({host.pipe->descriptor(), POLLIN, 0});
  ::poll(watched.data(), watched.size(), briefly ? 0 : kWait_ms);
}

std::uint64_t ReplayBox::uptimeMs(MonoTime now) const {
  return static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::milliseconds>(now - started_).count());
}

}  // namespace probebox::replay
