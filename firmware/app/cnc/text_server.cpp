#include "firmware/app/cnc/text_server.hpp"

#include <algorithm>
#include <array>
#include <poll.h>
#include <utility>

namespace probebox::app {
namespace {

using std::chrono::milliseconds;
using Clock = std::chrono::steady_clock;

constexpr milliseconds kLongestWait{1000};
// A person who types is slower, and noise is not worth the line's time.
constexpr int kMostRefusals = 10;
constexpr milliseconds kRefusalsWithin{1000};
constexpr std::size_t kMostDue = 64;
// A control that stops the box takes some ten characters more, and what the kernel has cannot be held back.
constexpr std::size_t kAhead = 8;
constexpr milliseconds kAheadFor{2};  // at a high rate, so that the line is never idle

}  // namespace

TextServer::TextServer(TextOptions options, Callbacks callbacks)
    : options_{std::move(options)},
      callbacks_{std::move(callbacks)},
      session_{options_.flow, options_.line.settings.data_bits == 7},
      line_{options_.line, callbacks_.report} {}

void TextServer::run() {
  line_.run([this] { serveOnce(); });
}

void TextServer::serveOnce() {
  wait();
  if (callbacks_.round) callbacks_.round();
  if (line_.pipe() != nullptr) flush();
}

void TextServer::lost() {
  line_.lost();
  session_.restart();
  unsent_ += due_.size();
  due_.clear();
  line_free_ = {};
  hears_itself_ = false;
}

// For bytes, for room, for the next record of a stream, or for the end.
void TextServer::wait() {
  const bool streams = options_.every.count() > 0;
  const auto now = Clock::now();
  if (streams && now >= next_record_) {
    // After a stall the stream goes on at its rate.
    next_record_ += options_.every;
    if (next_record_ <= now) next_record_ = now + options_.every;
    sendRecord();
    flush();
    if (line_.pipe() == nullptr) return;
  }
  auto patience = kLongestWait;
  if (streams) patience = std::min(patience, std::chrono::ceil<milliseconds>(next_record_ - now));
  bool waits = !session_.toSend().empty();
  if (waits && now < line_free_) {
    patience = std::min(patience, std::chrono::floor<milliseconds>(line_free_ - now));
    waits = false;
  }
  patience = std::max(patience, milliseconds{0});
  std::array<pollfd, 2> on{pollfd{line_.pipe()->descriptor(), static_cast<short>(POLLIN | (waits ? POLLOUT : 0)), 0},
                           pollfd{line_.wakeUp(), POLLIN, 0}};
  if (poll(on.data(), on.size(), static_cast<int>(patience.count())) > 0 && (on[0].revents & ~POLLOUT) != 0) receive();
}

void TextServer::receive() {
  std::array<std::byte, 512> buffer{};
  const auto got = line_.pipe()->read(buffer);
  if (got.bytes > 0) line_.heard();
  std::span<const std::byte> rest = std::span{buffer}.first(got.bytes);
  while (!rest.empty()) {
    rest = rest.subspan(session_.push(rest, sending(Clock::now())));
    if (const auto line = session_.line()) take(*line);
    const bool asks = session_.readerStarted() && due_.empty();
    if (asks && options_.format == TextOptions::Format::tape) show(options_.usual);
  }
  if (got.state == io::PipeState::closed) lost();
}

void TextServer::take(const tape::Session::Line& line) {
  if (tape::isSentByTheBox(line.text)) return hearItself();
  if (line.too_long) return refuse({"line-too-long", "a line has up to 256 characters"}, line.text.substr(0, 40));
  const auto report = tape::understood(line.text);
  if (!report) return refuse(report.error(), line.text);
  if (const auto* ask = std::get_if<tape::Ask>(&*report)) {
    ++answered_;
    return show(*ask);
  }
  if (const auto* events = std::get_if<tape::Said>(&*report)) {
    if (const auto why = said(*events)) return refuse(*why, line.text);
  }
  if (const auto* positions = std::get_if<tape::Positions>(&*report)) callbacks_.reached(*positions);
  ++answered_;
  answer("OK\r\n");
}

std::optional<tape::Refused> TextServer::said(tape::Said events) {
  for (auto& event : events) {
    if (auto* marker = std::get_if<Marker>(&event)) marker->procedure = callbacks_.run();
  }
  if (const auto why = callbacks_.take(events)) return tape::Refused{"not-now", why->what};
  return std::nullopt;
}

// A line that has not taken the last record gets no further ones: they would be old when it does.
void TextServer::sendRecord() {
  if (session_.waits() || !due_.empty())
    ++unsent_;
  else
    show(tape::Ask::status);
}

// A tape that is asked for again is sent once: the program that asked before has gone.
void TextServer::show(tape::Ask ask) {
  if (options_.format == TextOptions::Format::tape) unsent_ += std::erase(due_, Due{ask});
  enqueue(ask);
}

void TextServer::answer(std::string text) {
  if (options_.answers) enqueue(std::move(text));
}

void TextServer::enqueue(Due due) {
  if (due_.size() == kMostDue)
    ++unsent_;
  else
    due_.push_back(std::move(due));
}

// Values are those of the moment at which they can go out, however long the other end has held the box back.
void TextServer::makeNext() {
  if (due_.empty() || session_.waits() || session_.stopped()) return;
  const Due next = std::move(due_.front());
  due_.pop_front();
  std::string text;
  if (const auto* const ask = std::get_if<tape::Ask>(&next)) {
    const auto snapshot = callbacks_.snapshot();
    text = tape::tape(snapshot, *ask, options_.form);
    ++sent_;
    if (tape::hasCorrection(*ask)) callbacks_.serves(snapshot);
  } else {
    text = std::get<std::string>(next);
  }
  const auto end = text.rfind('%');
  behind_end_ = end == std::string::npos ? 0 : text.size() - end - 1;
  session_.send(text);
}

// Whether the other end does not have the present text yet, up to its last '%'; however long it has held it back.
bool TextServer::sending(Clock::time_point now) const {
  return std::max(line_free_, now) + takes(session_.unsent()) > now + takes(behind_end_);
}

std::chrono::nanoseconds TextServer::takes(std::size_t characters) const {
  const auto& settings = options_.line.settings;
  return std::chrono::nanoseconds{characters * serial::bitsPerCharacter(settings) * 1'000'000'000ULL / settings.baud};
}

void TextServer::refuse(const tape::Refused& refused, std::string_view line) {
  ++refused_;
  std::string shown;
  for (const char c : line) shown += c >= ' ' && c <= '~' ? c : '?';
  callbacks_.report(options_.line.path + ": '" + shown + "' was refused (" + refused.name + "): " + refused.what);
  if (mayAnswerRefusal()) answer("ERR " + refused.name + ": " + refused.what + "\r\n");
}

// An answer to an answer would come back as well, and so on without end.
void TextServer::hearItself() {
  if (std::exchange(hears_itself_, true)) return;
  callbacks_.report(
      options_.line.path +
      ": what the box sends comes back and is not answered: switch the echo of the adapter or the control off");
}

bool TextServer::mayAnswerRefusal() {
  const auto now = Clock::now();
  if (now - refusals_since_ >= kRefusalsWithin) {
    refusals_since_ = now;
    refusals_ = 0;
  }
  return refusals_++ < kMostRefusals;
}

void TextServer::flush() {
  while (true) {
    makeNext();
    const auto now = Clock::now();
    auto part = session_.toSend();
    if (part.empty() || now < line_free_) return;
    if (options_.flow) {
      const auto ahead = static_cast<std::size_t>(kAheadFor / takes(1));
      part = part.first(std::min(part.size(), std::max(kAhead, ahead)));
    }
    const auto wrote = line_.pipe()->write(part);
    session_.sent(wrote.bytes);
    if (options_.flow) line_free_ = now + takes(wrote.bytes);
    if (wrote.state == io::PipeState::closed) return lost();
    if (wrote.bytes == 0) return;
  }
}

TextCounters TextServer::counters() const {
  return {answered_, refused_, sent_, unsent_, line_.reopened()};
}

}  // namespace probebox::app
