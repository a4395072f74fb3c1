#include "fake_box.hpp"

#include <algorithm>
#include <chrono>
#include <stdexcept>
#include <vector>

#include "drivers/tcp/linux_tcp.hpp"
#include "fake_answers.hpp"
#include "firmware/stream/session.hpp"
#include "firmware/stream/transcoder.hpp"
#include "protocol/codec/encoder.hpp"

namespace probebox::command {
namespace {

using namespace std::chrono_literals;

constexpr std::uint16_t kBlock = 50;
constexpr std::int64_t kPeriod_ns = 1'000'000;

const std::vector<codec::ChannelFormat> kFormats{{4, true}, {8, true}, {2, false}};

MonoTime now() {
  return monoTime(std::chrono::duration_cast<Nanoseconds>(std::chrono::steady_clock::now().time_since_epoch()).count());
}

}  // namespace

class FakeBox::Loop {
 public:
  Loop(const FakeBoxOptions& options, NextHost accept)
      : options_{options}, next_host_{std::move(accept)}, answers_{options} {
    history_.setDescriptor(messages::encoded(fakeDescriptor()));
  }

  bool calibrating() const { return answers_.calibrating(); }
  bool streaming() const { return streaming_; }

  void run(const std::stop_token& stop, std::atomic<bool>& cut) {
    while (!stop.stop_requested()) {
      if (cut.exchange(false)) connections_.clear();
      accept();
      produce();
      for (auto& connection : connections_) serve(connection);
      std::erase_if(connections_, [](const Connection& c) { return c.closed; });
      streaming_ = std::ranges::any_of(connections_, receivesSamples);
      std::this_thread::sleep_for(2ms);
    }
  }

 private:
  struct Connection {
    io::Connection lanes;
    std::unique_ptr<stream::Session> session;
    bool closed{};
  };

  static bool receivesSamples(const Connection& connection) {
    return connection.session->state() == stream::SessionState::streaming;
  }

  void accept() {
    if (auto lanes = next_host_(); lanes.data) {
      stream::SessionOptions options;
      options.two_lanes = lanes.control != nullptr;
      options.heartbeat_period = Nanoseconds{20'000'000};
      options.boot_id.fill(std::byte{7});
      options.firmware_version = "0.1.0-fake";
      auto session = std::make_unique<stream::Session>(options, history_);
      connections_.push_back({std::move(lanes), std::move(session)});
    }
  }

  void trigger(SampleIndex at) {
    if (++triggers_ % 7 == 0) return;
    history_.push(messages::Trigger{.number = triggers_,
                                    .line = 1,
                                    .line_sequence = 2 * triggers_,
                                    .at = monoTime(5'000'000'000 + at.index * kPeriod_ns + kPeriod_ns / 4),
                                    .tick = Tick{at.index},
                                    .phase_q32 = 1U << 30U,
                                    .sigma_ns = 850,
                                    .clock_state = ClockState::locked,
                                    .has_position = 0b101,
                                    .position_mm = {0.5 * triggers_, 0, -100},
                                    .correction_mm = {-0.0125, 0, 0.25},
                                    .correction_valid = true,
                                    .sequence = 9,
                                    .has_angle = 0b100,
                                    .angle_rad = {0, 0, 0.5}});
  }

  // Every tenth block is lost at its source.
  void produce() {
    const SampleIndex first{next_};
    next_ += kBlock;
    if (options_.triggers && next_ / kBlock % 4 == 0) trigger(first);
    if (options_.loses_at_source && (next_ / kBlock) % 10 == 0) {
      const stream::GapNotice gap{first, kBlock, messages::GapReason::source_probe};
      history_.push(gap);
      for (auto& connection : connections_) connection.session->offer(gap);
      return;
    }
    const auto bytes = block(first);
    const stream::EncodedBlock encoded{first, kBlock, bytes};
    const auto fast = transcoder_.fast(encoded);
    for (const auto& made : {encoded, fast}) {
      history_.push(made);
      for (auto& connection : connections_) connection.session->offer(made);
    }
  }

  std::vector<std::byte> block(SampleIndex first) {
    const TickMap map{Tick{first.index},  monoTime(5'000'000'000 + first.index * kPeriod_ns),
                      kPeriod_ns << 32,   850,
                      ClockState::locked, 0};
    std::vector<std::int64_t> columns;
    for (std::int64_t k = 0; k < kBlock; ++k) columns.push_back(-(first.index + k));
    for (std::int64_t k = 0; k < kBlock; ++k) columns.push_back(1000 * (first.index + k));
    for (std::int64_t k = 0; k < kBlock; ++k) columns.push_back(k & 1);
    std::vector<std::byte> bytes(codec::rawBlockSize(kFormats, kBlock));
    const auto size = codec::encodeRaw({first, kBlock, 1, map}, kFormats, columns, bytes);
    bytes.resize(size.ok() ? size.value() : 0);
    return bytes;
  }

  void serve(Connection& connection) {
    const auto& [data, control] = connection.lanes;
    receive(connection, *data, stream::Lane::data);
    if (control) receive(connection, *control, stream::Lane::control);
    connection.session->advance(now(), {1000, ClockState::locked, 850, 0, {}});
    while (const auto request = connection.session->nextRequest()) {
      const auto [code, text, body] = answers_.answer(request->operation, request->body);
      connection.session->answer(request->ticket, code, text, body);
    }
    transmit(connection, *data, stream::Lane::data);
    if (control) transmit(connection, *control, stream::Lane::control);
  }

  static void receive(Connection& connection, io::BytePipe& pipe, stream::Lane lane) {
    std::array<std::byte, 4096> buffer;
    for (auto got = pipe.read(buffer);; got = pipe.read(buffer)) {
      connection.closed |= got.state == io::PipeState::closed;
      if (got.bytes == 0) break;
      connection.session->receive(std::span{buffer}.first(got.bytes), now(), lane);
    }
  }

  static void transmit(Connection& connection, io::BytePipe& pipe, stream::Lane lane) {
    auto& session = *connection.session;
    for (auto bytes = session.pending(lane); !bytes.empty(); bytes = session.pending(lane)) {
      const auto moved = pipe.write(bytes);
      connection.closed |= moved.state == io::PipeState::closed;
      if (moved.bytes == 0) break;
      session.sent(moved.bytes, lane);
    }
  }

  FakeBoxOptions options_;
  NextHost next_host_;
  FakeAnswers answers_;
  stream::History history_{1 << 20, 1024, {messages::Profile::fast}};
  stream::Transcoder transcoder_{kFormats, kBlock};
  std::vector<Connection> connections_;
  std::int64_t next_{};
  std::uint32_t triggers_{};
  std::atomic<bool> streaming_{};
};

FakeBox::FakeBox(const FakeBoxOptions& options, unsigned port) {
  auto opened = tcp::Listener::open({"127.0.0.1", static_cast<std::uint16_t>(port)});
  if (!opened) throw std::runtime_error{opened.error().what};
  auto listener = std::make_shared<tcp::Listener>(std::move(opened).value());
  port_ = listener->address().port;
  loop_ = std::make_unique<Loop>(options, [listener] { return io::Connection{listener->accept()}; });
  run();
}

FakeBox::FakeBox(const FakeBoxOptions& options, NextHost accept)
    : loop_{std::make_unique<Loop>(options, std::move(accept))} {
  run();
}

void FakeBox::run() {
  thread_ = std::jthread{[this](const std::stop_token& stop) { loop_->run(stop, cut_); }};
}

FakeBox::~FakeBox() {
  thread_.request_stop();
  thread_.join();
}

unsigned FakeBox::port() const {
  return port_;
}
bool FakeBox::calibrating() const {
  return loop_->calibrating();
}
bool FakeBox::streaming() const {
  return loop_->streaming();
}
std::string FakeBox::uri() const {
  return "tcp:127.0.0.1:" + std::to_string(port());
}

}  // namespace probebox::command
