#include "firmware/app/link_service.hpp"

#include <algorithm>
#include <array>
#include <pthread.h>
#include <utility>

#include "drivers/serial/linux_serial.hpp"
#include "firmware/app/log.hpp"
#include "firmware/app/result_summary.hpp"

namespace probebox::app {
namespace {

constexpr std::size_t kReadAtOnce = 4096;
constexpr int kReadsInTurn = 4;
constexpr std::chrono::milliseconds kAdvance{20};
constexpr Nanoseconds kRetry = std::chrono::seconds{1};

messages::GapReason wireReason(const FeedItem& item) {
  if (item.kind == FeedItem::Kind::lost_in_queue) return messages::GapReason::queue_full;
  switch (item.reason) {
    case latch::LostReason::clock:
      return messages::GapReason::source_clock;
    case latch::LostReason::probe:
      return messages::GapReason::source_probe;
    case latch::LostReason::encoders:
      return messages::GapReason::source_encoders;
  }
  return messages::GapReason::source_clock;
}

void addTo(messages::LinkCounters& sum, const messages::LinkCounters& counters) {
  sum.frames += counters.frames;
  sum.bad_crc += counters.bad_crc;
  sum.bad_cobs += counters.bad_cobs;
  sum.bad_length += counters.bad_length;
  sum.oversize += counters.oversize;
  sum.discarded_bytes += counters.discarded_bytes;
  sum.unexpected += counters.unexpected;
}

}  // namespace

LinkService::LinkService(Options options, ControlDesk& desk, Feed& feed, StateBuffer& states, Counters& counters,
                         WakeUp& wake_up)
    : options_{std::move(options)},
      desk_{desk},
      feed_{feed},
      states_{states},
      counters_{counters},
      wake_up_{wake_up},
      started_{time_.now()},
      history_{options_.history_bytes, options_.history_pieces} {}

LinkService::~LinkService() {
  stop();
}

void LinkService::listen(tcp::Listener listener) {
  listeners_.push_back(std::move(listener));
}
void LinkService::serve(const serial::Address& line) {
  serial_lines_.push_back({.address = line});
}

void LinkService::start() {
  thread_ = std::thread{[this] {
    std::vector<EventLoop::Watch> watches;
    for (auto& listener : listeners_) {
      watches.push_back(loop_.watch(listener.descriptor(), [this, &listener] {
        while (auto pipe = listener.accept()) adopt(std::move(pipe), kNoLine);
      }));
    }
    watches.push_back(loop_.watch(wake_up_.descriptor(), [this] {
      wake_up_.clear();
      passOn();
      passOnReplies();
    }));
    watches.push_back(loop_.every(kAdvance, [this] { advance(); }));
    loop_.run();
    links_.clear();
  }};
  pthread_setname_np(thread_.native_handle(), "links");
}

void LinkService::stop() {
  if (!thread_.joinable()) return;
  {
    const std::lock_guard lock{replies_mutex_};
    stopping_ = true;
  }
  wake_up_.notify();
  thread_.join();
}

void LinkService::reply(Reply reply) {
  {
    const std::lock_guard lock{replies_mutex_};
    replies_.push_back(std::move(reply));
  }
  wake_up_.notify();
}

// Once a second at most: whoever knocks in a loop shall not fill the log.
void LinkService::turnAway() {
  ++turned_away_;
  const MonoTime now = time_.now();
  if (now - turned_away_said_ < kRetry) return;
  turned_away_said_ = now;
  logWarning(std::to_string(turned_away_) + " hosts were turned away so far: " + std::to_string(options_.most_links) +
             " links are open already.");
}

bool LinkService::adopt(std::unique_ptr<io::BytePipe> pipe, std::size_t serial_line) {
  const auto from_network = std::ranges::count(links_, kNoLine, [](const auto& link) { return link->serial_line; });
  if (serial_line == kNoLine && static_cast<std::size_t>(from_network) >= options_.most_links) {
    turnAway();
    return false;
  }
  stream::SessionOptions session = options_.session;
  session.first_session_id = static_cast<std::uint32_t>(last_link_ * 1000 + 1);
  auto link = std::make_unique<Link>(Link{.id = ++last_link_,
                                          .pipe = std::move(pipe),
                                          .session = {session, history_},
                                          .watch = {},
                                          .serial_line = serial_line});
  link->session.setDescriptor(descriptor_);
  link->watch = loop_.watch(link->pipe->descriptor(), [this, raw = link.get()] {
    receive(*raw);
    flush(*raw);
  });
  link->since = time_.now();
  links_.push_back(std::move(link));
  counters_.links = static_cast<std::uint32_t>(links_.size());
  return true;
}

void LinkService::openSerialLines(MonoTime now) {
  for (std::size_t i = 0; i < serial_lines_.size(); ++i) {
    SerialLine& line = serial_lines_[i];
    if (line.open || now < line.next_try) continue;
    line.next_try = now + kRetry;
    auto pipe = serial::openSerial(line.address.path, line.address.settings);
    if (!pipe) {
      if (!line.complained) logWarning(pipe.error().what + " Trying again every second.");
      line.complained = true;
      continue;
    }
    line.complained = false;
    line.open = adopt(std::move(*pipe), i);
  }
}

void LinkService::receive(Link& link) {
  std::array<std::byte, kReadAtOnce> bytes;
  for (int turn = 0; turn < kReadsInTurn && link.pipe; ++turn) {
    const io::Transfer got = link.pipe->read(bytes);
    if (got.bytes > 0) link.session.receive(std::span{bytes}.first(got.bytes), time_.now());
    if (got.state == io::PipeState::closed) close(link);
    if (got.bytes < bytes.size()) break;
  }
  answerRequests(link);
}

void LinkService::answerRequests(Link& link) {
  while (const auto request = link.session.nextRequest()) {
    const auto reply = desk_.handle(link.id, *request, states_.newest(), vitals());
    if (reply) link.session.answer(reply->ticket, reply->code, reply->text, reply->body);
  }
}

void LinkService::flush(Link& link) {
  while (link.pipe) {
    const auto bytes = link.session.pending();
    if (bytes.empty()) return link.watch.wantWrite(false);
    const io::Transfer put = link.pipe->write(bytes);
    link.session.sent(put.bytes);
    if (put.state == io::PipeState::closed) return close(link);
    if (put.bytes < bytes.size()) return link.watch.wantWrite(true);
  }
}

void LinkService::passOn() {
  while (feed_.pop(item_)) {
    if (item_.kind == FeedItem::Kind::block) {
      const stream::EncodedBlock block{.first = item_.first,
                                       .count = static_cast<std::uint32_t>(item_.count),
                                       .bytes = std::span{item_.bytes}.first(item_.size)};
      history_.push(block);
      for (const auto& link : links_) link->session.offer(block);
    } else {
      const stream::GapNotice gap{.first = item_.first, .count = item_.count, .reason = wireReason(item_)};
      history_.push(gap);
      for (const auto& link : links_) link->session.offer(gap);
    }
  }
  for (const auto& link : links_) flush(*link);
}

void LinkService::passOnReplies() {
  std::deque<Reply> replies;
  bool stopping = false;
  {
    const std::lock_guard lock{replies_mutex_};
    replies.swap(replies_);
    stopping = stopping_;
  }
  if (stopping) loop_.quit();
  for (const auto& reply : replies) {
    for (const auto& link : links_) {
      if (link->id != reply.link) continue;
      link->session.answer(reply.ticket, reply.code, reply.text, reply.body);
      flush(*link);
    }
  }
}

void LinkService::advance() {
  const MonoTime now = time_.now();
  refreshDescriptor();
  const box::State& state = states_.newest();
  const stream::Vitals of_box{.uptime_ms = uptimeMs(),
                              .clock_state = state.map.state,
                              .clock_sigma_ns = state.map.sigma_ns,
                              .deadline_misses = counters_.deadline_misses,
                              .edges = edgeCounters(state.clock)};
  for (const auto& link : links_) {
    link->session.advance(now, of_box);
    flush(*link);
    // A serial line stays: the next host says HELLO on it.
    if (link->serial_line == kNoLine && hasNothingToSay(*link, now)) close(*link);
  }
  dropClosed();
  openSerialLines(now);
}

// It has gone without a word, or never said HELLO: its place is for others.
bool LinkService::hasNothingToSay(const Link& link, MonoTime now) {
  constexpr Nanoseconds kHelloUntil = std::chrono::seconds{5};
  const auto state = link.session.state();
  return state == stream::SessionState::down ||
         (state == stream::SessionState::waiting && now - link.since > kHelloUntil);
}

void LinkService::refreshDescriptor() {
  const auto& delay = states_.newest().snapshot.delay;
  if (delay.result_id == described_result_) return;
  described_result_ = delay.result_id;
  auto descriptor = options_.descriptor;
  descriptor.delay = {
      .calibrated = delay.calibrated, .tau_s = delay.tau_s, .sd_s = delay.sd_s, .result_id = delay.result_id};
  descriptor_ = messages::encoded(descriptor);
  for (const auto& link : links_) link->session.setDescriptor(descriptor_);
}

// Only marks the link: its own callback may be running.
void LinkService::close(Link& link) {
  if (!link.pipe) return;
  addTo(from_gone_hosts_, link.session.linkCounters());
  link.watch.pause();
  link.pipe.reset();
  if (link.serial_line != kNoLine) serial_lines_[link.serial_line].open = false;
}

void LinkService::dropClosed() {
  std::erase_if(links_, [](const auto& link) { return link->pipe == nullptr; });
  counters_.links = static_cast<std::uint32_t>(links_.size());
}

LinkVitals LinkService::vitals() const {
  LinkVitals all{.uptime_ms = uptimeMs(), .from_hosts = from_gone_hosts_};
  for (const auto& link : links_) {
    if (link->pipe) addTo(all.from_hosts, link->session.linkCounters());
  }
  return all;
}

std::uint64_t LinkService::uptimeMs() const {
  return static_cast<std::uint64_t>(
      std::chrono::duration_cast<std::chrono::milliseconds>(time_.now() - started_).count());
}

}  // namespace probebox::app
