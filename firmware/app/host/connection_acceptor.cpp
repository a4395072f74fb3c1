#include "firmware/app/host/connection_acceptor.hpp"

#include <algorithm>
#include <array>
#include <utility>

namespace probebox::app {
namespace {

// A refused host has to read why: what it sent is read until it hangs up, as unread bytes would make the kernel drop
// the answer.
constexpr Nanoseconds kFarewell = std::chrono::seconds{1};
constexpr int kMostAccepted = 16;  // in one turn: connections that come without end do not keep the links waiting

// The computer that a connection comes from: "tcp:10.0.0.7" of "tcp:10.0.0.7:40001".
std::string_view originOf(const io::BytePipe& pipe) {
  const auto name = pipe.name();
  return name.substr(0, name.rfind(':'));
}

}  // namespace

std::size_t ConnectionAcceptor::listen(tcp::Listener listener, Secure secure) {
  doors_.push_back({std::move(listener), std::move(secure)});
  return doors_.size() - 1;
}

void ConnectionAcceptor::open() {
  opened_ = true;
  for (std::size_t listener = 0; listener < doors_.size(); ++listener) {
    if (doors_[listener].secure) continue;  // advance() looks after those
    watches_.push_back(
        loop_.watch(doors_[listener].listener.descriptor(), [this, listener] { accept(listener, kMostAccepted); }));
  }
}

void ConnectionAcceptor::close() {
  opened_ = false;
  pending_.clear();
  watches_.clear();
}

void ConnectionAcceptor::accept(std::size_t listener, int most) {
  auto& door = doors_[listener];
  for (int k = 0; k < most; ++k) {
    auto pipe = door.listener.accept();
    if (!pipe) return;
    if (door.secure) pipe = door.secure(std::move(pipe));
    if (!pipe) {
      ++counters_.turned_away;
      continue;
    }
    makeRoom();
    pending_.push_back(std::make_unique<PendingConnection>(PendingConnection{.pipe = std::move(pipe),
                                                                             .gate = {},
                                                                             .listener = listener,
                                                                             .until = now_ + kPatience,
                                                                             .watch = {},
                                                                             .refused = false,
                                                                             .over = false}));
    auto& pending = *pending_.back();
    pending.watch = loop_.watch(pending.pipe->descriptor(), [this, &pending] { listenTo(pending); });
  }
}

void ConnectionAcceptor::makeRoom() {
  std::erase_if(pending_, [](const auto& pending) { return pending->over; });
  if (pending_.size() < kMostWaiting) return;
  const auto waiting_from = [&](const auto& pending) {
    return std::ranges::count(pending_, originOf(*pending->pipe),
                              [](const auto& other) { return originOf(*other->pipe); });
  };
  // The first of equals is the oldest.
  const auto oldest = std::ranges::max_element(pending_, {}, waiting_from);
  if (!(*oldest)->refused) closePending(**oldest, counters_.silent, "gave way to newer ones: it has not said HELLO");
  pending_.erase(oldest);
}

void ConnectionAcceptor::advance(MonoTime now) {
  now_ = now;
  for (const auto& pending : pending_) {
    if (pending->over || now < pending->until) continue;
    if (!pending->refused) closePending(*pending, counters_.silent, "said no HELLO for 2 s");
    pending->over = true;
  }
  std::erase_if(pending_, [](const auto& pending) { return pending->over; });
  for (std::size_t listener = 0; opened_ && listener < doors_.size(); ++listener) {
    if (doors_[listener].secure) accept(listener, kMostSecured);
  }
  warning_.look(now);
}

void ConnectionAcceptor::listenTo(PendingConnection& pending) {
  if (pending.over) return;
  std::array<std::byte, stream::HelloGate::kMostBytes> bytes{};
  // No byte behind the gate's is taken from the pipe: it is the session's.
  const auto got = pending.pipe->read(std::span{bytes}.first(pending.refused ? bytes.size() : pending.gate.room()));
  if (pending.refused) {
    pending.over = got.state == io::PipeState::closed;
    if (pending.over) pending.watch.pause();
    return;
  }
  using Verdict = stream::HelloGate::Verdict;
  switch (got.bytes > 0 ? pending.gate.push(std::span{bytes}.first(got.bytes)) : Verdict::undecided) {
    case Verdict::hello:
      return passOn(pending);
    case Verdict::stranger:
      return closePending(pending, counters_.strangers, "began with something else than HELLO");
    case Verdict::undecided:
      break;
  }
  if (got.state != io::PipeState::closed) return;
  if (const auto why = pending.pipe->whyClosed(); !why.empty())
    return closePending(pending, counters_.strangers, "was refused: " + std::string{why});
  if (!pending.gate.bytes().empty()) return closePending(pending, counters_.strangers, "ended before its HELLO did");
  // Somebody looked whether anybody listens here: nothing to warn of.
  ++counters_.silent;
  pending.watch.pause();
  pending.over = true;
}

void ConnectionAcceptor::passOn(PendingConnection& pending) {
  if (const auto& mismatch = pending.gate.refusal()) return refuse(pending, *mismatch);
  if (const auto why = callbacks_.why_full(pending.listener))
    return refuse(pending, {messages::ErrorCode::busy, messages::MessageType::hello, *why});
  pending.over = true;
  pending.watch.pause();
  callbacks_.enter({.pipe = std::move(pending.pipe), .gate = pending.gate, .listener = pending.listener});
}

void ConnectionAcceptor::refuse(PendingConnection& pending, const messages::Refusal& refusal) {
  ++counters_.turned_away;
  warning_.warn(now_, std::string{pending.pipe->name()} + " was turned away: " + refusal.text + ".");
  // A few dozen bytes go into the buffer of a fresh connection.
  pending.pipe->write(stream::refusalFrame(refusal));
  pending.refused = true;
  pending.until = now_ + kFarewell;
}

void ConnectionAcceptor::closePending(PendingConnection& pending, std::uint64_t& counter, const std::string& why) {
  ++counter;
  warning_.warn(now_, "The connection from " + std::string{pending.pipe->name()} + " " + why + ". It was closed.");
  pending.watch.pause();
  pending.pipe.reset();
  pending.over = true;
}

}  // namespace probebox::app
