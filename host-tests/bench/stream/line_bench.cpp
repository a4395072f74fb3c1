// How much of a serial line carries samples. A session writes as many bytes a (virtual) millisecond as the line takes
// into a pseudo terminal, and a host reads them at its other end: bytes count, and not how fast this machine is. The
// source has always more. `bench_line [seconds]`; status 1 when less than 95 % of a line carries samples, or a sample
// is missing.
#include <array>
#include <cstdio>
#include <cstdlib>
#include <fcntl.h>
#include <optional>
#include <random>
#include <stdexcept>
#include <termios.h>
#include <unistd.h>

#include "firmware/stream/session.hpp"
#include "firmware/stream/transcoder.hpp"
#include "host-tests/support/scan_signal.hpp"
#include "tools/link/stream_reader.hpp"

namespace {

using namespace probebox;
using namespace std::chrono_literals;
using messages::MessageType;
using support::ScanSignal;

constexpr double kLimit = 0.95;
constexpr std::uint16_t kBlock = 128;           // samples, as service.toml has it where it says nothing
constexpr std::uint64_t kWaiting = 8 * kBlock;  // samples that always wait for the line
constexpr int kBitsPerByte = 10;                // with start and stop
constexpr auto kSettles = 2s;                   // the handshake and the descriptor, which is sent four times

std::vector<codec::ChannelFormat> formats() {
  std::vector<codec::ChannelFormat> all;
  for (const auto bytes : ScanSignal::kBytes) all.push_back({bytes, bytes != 2});
  return all;
}

// Both ends of a pseudo terminal that changes no byte.
class Terminal {
 public:
  Terminal() : host_{posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK)} {
    std::array<char, 64> name{};
    if (host_ < 0 || grantpt(host_) != 0 || unlockpt(host_) != 0 || ptsname_r(host_, name.data(), name.size()) != 0)
      throw std::runtime_error{"no pseudo terminal"};
    box_ = open(name.data(), O_RDWR | O_NOCTTY | O_NONBLOCK);
    termios raw{};
    if (box_ < 0 || tcgetattr(box_, &raw) != 0) throw std::runtime_error{"no pseudo terminal"};
    cfmakeraw(&raw);
    tcsetattr(box_, TCSANOW, &raw);
  }
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;
  ~Terminal() {
    close(box_);
    close(host_);
  }

  int box() const { return box_; }
  int host() const { return host_; }

 private:
  int host_{-1};
  int box_{-1};
};

std::size_t written(int end, std::span<const std::byte> bytes) {
  const auto count = write(end, bytes.data(), bytes.size());
  return count > 0 ? static_cast<std::size_t>(count) : 0;
}

// Bytes on the line by what they carry.
struct Carried {
  std::uint64_t samples{};
  std::uint64_t heartbeats{};
  std::uint64_t others{};
  std::uint64_t whole{};  // the same frames without the short forms

  std::uint64_t total() const { return samples + heartbeats + others; }
};

class Host : public link::StreamListener {
 public:
  void read(std::span<const std::byte> bytes) {
    for (const auto byte : bytes) {
      coded_.push_back(byte);
      if (byte != frame::kDelimiter) continue;
      count(coded_);
      reader.read(coded_);
      coded_.clear();
    }
  }
  void onFrame(const frame::Frame& frame) override {
    if (static_cast<MessageType>(frame.header.type) != MessageType::samples_head)
      carried.whole += frame::delimitedMaxSize(frame.payload.size());
  }
  void onHeartbeat(const messages::Heartbeat&, const std::optional<link::Balance>& balance) override {
    inexact += balance && !balance->exact ? 1 : 0;
  }

  link::StreamReader reader{*this};
  Carried carried;
  int inexact{};

 private:
  void count(std::span<const std::byte> coded) {
    const auto size = coded.size();
    const auto frame = raw_.next(coded);
    if (!frame) return;
    switch (static_cast<MessageType>(frame->header.type)) {
      case MessageType::samples:
      case MessageType::short_samples:
        carried.samples += size;
        return;
      case MessageType::heartbeat:
      case MessageType::heartbeat_change:
        carried.heartbeats += size;
        return;
      default:
        carried.others += size;
    }
  }

  frame::Reader raw_;
  std::vector<std::byte> coded_;
};

// The reference scan, block by block, with a clock that is corrected at each.
class Source {
 public:
  std::vector<std::byte> next() {
    if (at_ + kBlock > kColumn) at_ = 0;
    std::vector<std::int64_t> columns;
    for (std::size_t c = 0; c < ScanSignal::kColumns; ++c) {
      const auto from = columns_.begin() + static_cast<std::ptrdiff_t>(c * kColumn + at_);
      columns.insert(columns.end(), from, from + kBlock);
    }
    at_ += kBlock;
    std::normal_distribution<double> noise{0, 1};
    header.first = header.first + header.count;
    header.count = kBlock;
    header.map = {.tick = {header.first.index + kBlock},
                  .at = monoTime(1'000'017 * header.first.index + std::llround(100 * noise(random_))),
                  .period_q32_ns = (1'000'017LL << 32) + std::llround(1e7 * noise(random_)),
                  .sigma_ns = 110 + static_cast<std::uint32_t>(random_() % 5),
                  .state = ClockState::locked};
    std::vector<std::byte> block(codec::rawBlockSize(formats(), kBlock));
    block.resize(*codec::encodeRaw(header, formats(), columns, block));
    return block;
  }

  codec::BlockHeader header{};

 private:
  static constexpr std::size_t kColumn = 65'536;
  std::vector<std::int64_t> columns_ = ScanSignal{}.columns(kColumn, 1);
  std::size_t at_{};
  std::mt19937_64 random_{1};
};

class Line {
 public:
  Line(int baud, messages::Profile profile)
      : bytes_per_ms_{baud / (kBitsPerByte * 1000.0)}, session_{options(), history_} {
    messages::Descriptor descriptor;
    descriptor.board = "line";
    for (const auto& format : formats())
      descriptor.channels.push_back({"c", "nm", 1, format.bytes, format.is_signed, ""});
    history_.setDescriptor(messages::encoded(descriptor));
    say(messages::Hello::current({}));
    run(500ms);
    messages::Start start;
    start.profile = profile;
    start.policy = messages::Policy::record;
    say(start);
  }

  void run(Nanoseconds lasts) {
    for (const MonoTime end = now_ + lasts; now_ < end;) {
      now_ += 1ms;
      if (toNs(now_) % 400'000'000 == 0) say(messages::Credit{messages::kUnlimitedCredit});
      take();
      session_.advance(now_, {.uptime_ms = static_cast<std::uint64_t>(toNs(now_) / 1'000'000),
                              .clock_state = ClockState::locked,
                              .clock_sigma_ns = 110 + static_cast<std::uint32_t>(toNs(now_) / 100'000'000 % 5),
                              .edges = {.accepted = static_cast<std::uint64_t>(toNs(now_) / 1'000'000)}});
      while (session_.feed().running() && session_.feed().queuedSamples() < kWaiting) produce();
      budget_ = std::min(budget_ + bytes_per_ms_, bytes_per_ms_ + 1);
      send();
    }
  }

  Host host;

 private:
  static stream::SessionOptions options() {
    stream::SessionOptions session;
    session.boot_id.fill(std::byte{1});
    return session;
  }
  template <class Message>
  void say(const Message& message) {
    const auto payload = messages::encoded(message);
    std::vector<std::byte> scratch(frame::bareSize(payload.size()));
    std::vector<std::byte> coded(frame::delimitedMaxSize(payload.size()));
    coded.resize(frame::encodeDelimited({.type = static_cast<std::uint8_t>(Message::kType), .sequence = sequence_++},
                                        payload, scratch, coded));
    written(terminal_.host(), coded);
  }
  void take() {
    std::array<std::byte, 4096> bytes{};
    const auto count = read(terminal_.box(), bytes.data(), bytes.size());
    if (count > 0) session_.receive(std::span{bytes}.first(static_cast<std::size_t>(count)), now_);
  }
  void produce() {
    const auto bytes = source_.next();
    const stream::EncodedBlock raw{source_.header.first, source_.header.count, bytes};
    for (const auto& block : {raw, transcoder_.fast(raw)}) {
      history_.push(block);
      session_.offer(block);
    }
  }
  void send() {
    std::array<std::byte, 4096> bytes{};
    while (budget_ >= 1) {
      const auto pending = session_.pending();
      const auto some = std::min({pending.size(), static_cast<std::size_t>(budget_), bytes.size()});
      const auto sent = written(terminal_.box(), pending.first(some));
      if (sent == 0) return;
      session_.sent(sent);
      budget_ -= static_cast<double>(sent);
      for (ssize_t count = 0; (count = read(terminal_.host(), bytes.data(), bytes.size())) > 0;)
        host.read(std::span{bytes}.first(static_cast<std::size_t>(count)));
    }
  }

  double bytes_per_ms_;
  double budget_{};
  MonoTime now_{monoTime(1'000'000'000)};
  std::uint32_t sequence_{};
  Terminal terminal_;
  stream::History history_{1U << 20U, 1024, {messages::Profile::fast}};
  stream::Transcoder transcoder_{formats(), kBlock};
  Source source_;
  stream::Session session_;
};

bool measure(int baud, messages::Profile profile, std::chrono::seconds lasts) {
  Line line{baud, profile};
  line.run(kSettles);
  const auto before = line.host.carried;
  const auto received = line.host.reader.ledger().account().received;
  line.run(lasts);
  const auto& now = line.host.carried;
  const double seconds = static_cast<double>(lasts.count());
  const double capacity = baud / double{kBitsPerByte} * seconds;
  const auto share = [&](std::uint64_t Carried::*part) {
    return static_cast<double>(now.*part - before.*part) / capacity;
  };
  const auto& account = line.host.reader.ledger().account();
  const double samples = share(&Carried::samples);
  const bool is_whole = account.received == account.total() && line.host.inexact == 0;
  const bool good = samples >= kLimit && is_whole;
  std::printf(
      "%8d %-5s %9.0f %8.1f %% %8.2f %% %7.2f %% %7.2f %% %9.3f   %s\n", baud,
      std::string{messages::nameOf(profile)}.c_str(), static_cast<double>(account.received - received) / seconds,
      100 * samples, 100 * share(&Carried::heartbeats), 100 * share(&Carried::others),
      100 - 100 * (samples + share(&Carried::heartbeats) + share(&Carried::others)),
      share(&Carried::whole) * capacity / static_cast<double>(now.total() - before.total()), good ? "ok" : "MISSED");
  return good;
}

}  // namespace

int main(int count, char** words) {
  const std::chrono::seconds lasts{count > 1 ? std::atoi(words[1]) : 20};
  std::printf("%8s %-5s %9s %10s %10s %9s %9s %9s\n", "baud", "", "samples/s", "samples", "heartbeats", "others",
              "idle", "x whole");
  bool good = true;
  for (const int baud : {115'200, 230'400, 460'800, 921'600, 3'000'000}) {
    for (const auto profile : {messages::Profile::raw, messages::Profile::fast, messages::Profile::tight}) {
      // Encoding tight takes microseconds a sample: it is for lines of up to this rate.
      if (profile != messages::Profile::tight || baud <= 921'600) good = measure(baud, profile, lasts) && good;
    }
  }
  return good ? 0 : 1;
}
