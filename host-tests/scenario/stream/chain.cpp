#include "chain.hpp"

#include <stdexcept>
#include <utility>

#include "drivers/tcp/linux_tcp.hpp"
#include "host-tests/emulation/streamed.hpp"
#include "host-tests/support/scan_signal.hpp"
#include "protocol/codec/block.hpp"

namespace probebox::chain {
namespace {

using namespace std::chrono_literals;

constexpr Nanoseconds kProbeInterval = 10us;
constexpr Nanoseconds kEncoderInterval = 100us;
constexpr Nanoseconds kTick = 1ms;
constexpr Nanoseconds kTimeAdvances = 10ms;
constexpr MonoTime kBegin = monoTime(1'000'000'000);

box::BoxConfig config() {
  box::BoxConfig box;
  box.latch.samples_per_tick = kSamplesPerTick;
  box.latch.probe.interval = kProbeInterval;
  for (auto& axis : box.latch.axes) axis = {.interval = kEncoderInterval, .interpolation = latch::Interpolation::cubic};
  box.mm_per_count = {1e-6, 1e-6, 1e-6};
  box.block_samples = box::BlockBuilder::kMostSamples;
  return box;
}

std::uint64_t sumOf(std::span<const std::int64_t> values) {
  std::uint64_t sum = 0;
  for (const auto value : values) sum += static_cast<std::uint64_t>(value) * 0x9E3779B97F4A7C15U;
  return sum;
}

std::pair<io::Connection, io::Connection> connection() {
  auto listener = tcp::Listener::open({});
  if (!listener) throw std::runtime_error{listener.error().what};
  auto host = tcp::connectTcp(listener->address(), 5s);
  if (!host) throw std::runtime_error{host.error().what};
  std::unique_ptr<io::BytePipe> box;
  while (!box) box = listener->accept();
  return {io::Connection{std::move(box)}, io::Connection{std::move(*host)}};
}

}  // namespace

std::vector<Event> scanEvents(std::chrono::seconds lasts, Nanoseconds probe_silent) {
  const auto count = static_cast<std::size_t>(lasts / kProbeInterval);
  const auto columns =
      support::ScanSignal{.rate_hz = 1e9 / static_cast<double>(kProbeInterval.count())}.columns(count, 1);
  const auto at = [&](std::size_t column, std::size_t k) { return columns[column * count + k]; };
  std::vector<Event> events;
  events.reserve(2 * count);
  constexpr std::uint32_t kPerEncoder = kEncoderInterval / kProbeInterval;
  constexpr std::uint32_t kPerTick = kTick / kProbeInterval;
  constexpr std::uint32_t kPerTime = kTimeAdvances / kProbeInterval;
  for (std::size_t k = 0; k < count; ++k) {
    const MonoTime now = kBegin + static_cast<std::int64_t>(k) * kProbeInterval;
    const auto number = static_cast<std::uint32_t>(k + 1);
    if (k % kPerTick == 0) events.push_back(Edge{LineRole::sync, 0, Level::active, number / kPerTick + 1, now});
    if (k % kPerEncoder == 0) {
      for (std::size_t axis = 0; axis < kLinearAxes; ++axis)
        events.push_back(Count{static_cast<Axis>(axis), number / kPerEncoder + 1, at(3 + axis, k), now + 2us});
    }
    const auto within_second = Nanoseconds{now - kBegin} % Nanoseconds{1s};
    if (within_second < 500ms || within_second >= 500ms + probe_silent) {
      events.push_back(Deflection{number,
                                  {static_cast<std::int32_t>(at(0, k)), static_cast<std::int32_t>(at(1, k)),
                                   static_cast<std::int32_t>(at(2, k))},
                                  false,
                                  now + 4us});
    }
    if (k % kPerTime == kPerTime - 1) events.push_back(TimeAdvanced{now + 5us});
  }
  return events;
}

Chain::Chain(messages::Profile profile)
    : now_{kBegin},
      history_{2U << 20U, 2048, {messages::Profile::fast}},
      transcoder_{box::channelFormats(), box::BlockBuilder::kMostSamples},
      box_{std::make_unique<box::Box>(config(), static_cast<box::Outputs&>(*this))} {
  if (const auto refused = box::validate(config())) throw std::runtime_error{refused->what};
  history_.setDescriptor(messages::encoded(scenario::streamedDescriptor("chain", kSamplesPerTick)));
  auto [box_end, host_end] = connection();
  stream::SessionOptions session;
  session.boot_id.fill(std::byte{1});
  host_link_ = std::make_unique<app::HostLink>(1, std::move(box_end), session, history_);
  client_ = std::make_unique<link::Client>(std::move(host_end), link::ClientOptions{},
                                           static_cast<link::StreamListener*>(this));
  while (client_->poll(now_) == link::LinkState::greeting) carry();
  messages::Start start;
  start.profile = profile;
  start.policy = messages::Policy::record;
  client_->start(start);
  while (!host_link_->session().feed().running()) carry();
}

Chain::~Chain() = default;

void Chain::run(std::span<const Event> events) {
  for (const auto& event : events) {
    box_->push(event);
    if (const auto* time = std::get_if<TimeAdvanced>(&event)) {
      now_ = time->at;
      carry();
    }
  }
}

void Chain::finish() {
  constexpr Nanoseconds kPatience = 60s;
  client_->stop();
  for (const MonoTime until = now_ + kPatience; now_ < until && (!client_->closed() || !exact());) {
    now_ += 1ms;
    carry();
    if (client_->state() == link::LinkState::lost) throw std::runtime_error{client_->failure()->what};
  }
}

// What there is, from the box to the host, and back: credit and signs of life.
void Chain::carry() {
  host_link_->receive(now_);
  host_link_->session().advance(now_, {});
  host_link_->flush();
  client_->poll(now_);
}

bool Chain::exact() const {
  const auto& balance = client_->reader().ledger().balance();
  const auto& ledger = sent();
  return balance && balance->exact && inexact_ == 0 && ledger.produced() == account().total() &&
         ledger.sent == account().received && ledger.lost_at_source + ledger.lost_in_queue == account().declared_lost;
}

bool Chain::block(SampleIndex first, std::uint32_t count, std::span<const std::byte> bytes) {
  const stream::EncodedBlock raw{.first = first, .count = count, .bytes = bytes};
  offer(raw);
  offer(transcoder_.fast(raw));
  if (adds_up_) {
    std::vector<std::int64_t> columns(box::channelFormats().size() * count);
    if (codec::decode(bytes, box::channelFormats(), columns)) encoded_sum_ += sumOf(columns);
  }
  return true;
}

bool Chain::lost(const latch::Lost& lost) {
  const auto gap = scenario::streamedGap(lost);
  history_.push(gap);
  host_link_->session().offer(gap);
  return true;
}

void Chain::offer(const stream::EncodedBlock& block) {
  history_.push(block);
  host_link_->session().offer(block);
}

void Chain::onFrame(const frame::Frame& frame) {
  wire_bytes_ += frame::delimitedMaxSize(frame.payload.size());
}

void Chain::onBlock(const link::DecodedBlock& block) {
  if (adds_up_) decoded_sum_ += sumOf(block.columns);
}

void Chain::onHeartbeat(const messages::Heartbeat&, const std::optional<link::Balance>& balance) {
  inexact_ += balance && !balance->exact ? 1U : 0U;
}

}  // namespace probebox::chain
