#include "firmware/app/host/reception.hpp"

#include <algorithm>
#include <array>
#include <utility>

namespace probebox::app {
namespace {

// A refused host has to read why: what it sent is read until it hangs up, as unread bytes would make the kernel drop
// the answer.
constexpr Nanoseconds kFarewell = std::chrono::seconds{1};
constexpr int kMostAccepted = 16;  // in one turn: those who knock without end do not keep the links waiting

}  // namespace

std::size_t Reception::listen(tcp::Listener listener) {
  listeners_.push_back(std::move(listener));
  return listeners_.size() - 1;
}

void Reception::open() {
  for (std::size_t listener = 0; listener < listeners_.size(); ++listener)
    watches_.push_back(loop_.watch(listeners_[listener].descriptor(), [this, listener] { accept(listener); }));
}

void Reception::close() {
  knocks_.clear();
  watches_.clear();
}

void Reception::accept(std::size_t listener) {
  for (int k = 0; k < kMostAccepted; ++k) {
    auto pipe = listeners_[listener].accept();
    if (!pipe) return;
    makeRoom();
    knocks_.push_back(std::make_unique<Knock>(Knock{.pipe = std::move(pipe),
                                                    .gate = {},
                                                    .listener = listener,
                                                    .until = now_ + kPatience,
                                                    .watch = {},
                                                    .refused = false,
                                                    .over = false}));
    auto& knock = *knocks_.back();
    knock.watch = loop_.watch(knock.pipe->descriptor(), [this, &knock] { listenTo(knock); });
  }
}

void Reception::makeRoom() {
  std::erase_if(knocks_, [](const auto& knock) { return knock->over; });
  if (knocks_.size() < kMostWaiting) return;
  auto& oldest = knocks_.front();
  if (!oldest->refused) turnOut(*oldest, counters_.silent, "gave way to newer ones: it has not said HELLO");
  knocks_.erase(knocks_.begin());
}

void Reception::advance(MonoTime now) {
  now_ = now;
  for (const auto& knock : knocks_) {
    if (knock->over || now < knock->until) continue;
    if (!knock->refused) turnOut(*knock, counters_.silent, "said no HELLO for 2 s");
    knock->over = true;
  }
  std::erase_if(knocks_, [](const auto& knock) { return knock->over; });
  warning_.look(now);
}

void Reception::listenTo(Knock& knock) {
  if (knock.over) return;
  std::array<std::byte, stream::HelloGate::kMostBytes> bytes{};
  // No byte behind the gate's is taken from the pipe: it is the session's.
  const auto got = knock.pipe->read(std::span{bytes}.first(knock.refused ? bytes.size() : knock.gate.room()));
  if (knock.refused) {
    knock.over = got.state == io::PipeState::closed;
    if (knock.over) knock.watch.pause();
    return;
  }
  using Verdict = stream::HelloGate::Verdict;
  switch (got.bytes > 0 ? knock.gate.push(std::span{bytes}.first(got.bytes)) : Verdict::undecided) {
    case Verdict::hello:
      return welcome(knock);
    case Verdict::stranger:
      return turnOut(knock, counters_.strangers, "began with something else than HELLO");
    case Verdict::undecided:
      break;
  }
  if (got.state != io::PipeState::closed) return;
  if (!knock.gate.bytes().empty()) return turnOut(knock, counters_.strangers, "ended before its HELLO did");
  // Somebody looked whether anybody listens here: nothing to warn of.
  ++counters_.silent;
  knock.watch.pause();
  knock.over = true;
}

void Reception::welcome(Knock& knock) {
  if (const auto& mismatch = knock.gate.refusal()) return refuse(knock, *mismatch);
  if (const auto why = hall_.why_full(knock.listener))
    return refuse(knock, {messages::ErrorCode::busy, messages::MessageType::hello, *why});
  knock.over = true;
  knock.watch.pause();
  hall_.enter({.pipe = std::move(knock.pipe), .gate = knock.gate, .listener = knock.listener});
}

void Reception::refuse(Knock& knock, const messages::Refusal& refusal) {
  ++counters_.turned_away;
  warning_.warn(now_, std::string{knock.pipe->name()} + " was turned away: " + refusal.text + ".");
  // A few dozen bytes go into the buffer of a fresh connection.
  knock.pipe->write(stream::refusalFrame(refusal));
  knock.refused = true;
  knock.until = now_ + kFarewell;
}

void Reception::turnOut(Knock& knock, std::uint64_t& counter, const std::string& why) {
  ++counter;
  warning_.warn(now_, "The connection from " + std::string{knock.pipe->name()} + " " + why + ". It was closed.");
  knock.watch.pause();
  knock.pipe.reset();
  knock.over = true;
}

}  // namespace probebox::app
