// A box that streams 100 kS/s of virtual time, faster than real time where that is asked for.
//   long_stream SECONDS SPEED     of virtual time; times real time, 0: as fast as the host reads
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <numbers>
#include <random>

#include "drivers/tcp/linux_tcp.hpp"
#include "tools/replay/replay_box.hpp"

namespace probebox {
namespace {

constexpr std::int64_t kRate = 100'000;  // samples a second, and samples until the signals repeat
constexpr std::uint16_t kInTick = 100;
constexpr std::uint16_t kInBlock = 1000;
constexpr std::int64_t kPeriod_ns = 1'000'000;
constexpr std::int64_t kBegin_ns = 1'000'000'000'000;  // of the stream, on the box's clock
constexpr std::int64_t kPeakAt = 54'321;               // of every second: one sample that stands out of deflection_a
constexpr std::int64_t kPeak_nm = 900'000;
constexpr std::size_t kDeflections = 3;
constexpr std::size_t kChannels = 6;

messages::Descriptor described() {
  messages::Descriptor made;
  made.board = "long stream";
  made.serial_number = "TEST-1";
  made.machine = "virtual";
  made.probe = "virtual";
  made.samples_per_tick = kInTick;
  for (const char letter : {'a', 'b', 'c'})
    made.channels.push_back({std::string{"deflection_"} + letter, "nm", 1, 4, true, "of the stylus"});
  for (const char letter : {'x', 'y', 'z'})
    made.channels.push_back({std::string{"position_"} + letter, "mm", 1e-6, 8, true, "of the encoder"});
  return made;
}

// The signals of one second, channel by channel: a tone of 5 Hz with noise, and an axis that goes to and fro.
std::array<std::vector<std::int64_t>, kChannels> signals() {
  std::array<std::vector<std::int64_t>, kChannels> all;
  std::mt19937_64 random{7};
  std::normal_distribution<double> unit{0, 1};
  for (std::size_t c = 0; c < kChannels; ++c) {
    for (std::int64_t k = 0; k < kRate; ++k) {
      const double turns = static_cast<double>(k) / kRate;
      const double value = c < kDeflections
                               ? 300e3 * std::sin(2 * std::numbers::pi * (5 * turns + static_cast<double>(c) / 3))
                               : 50e6 * std::sin(2 * std::numbers::pi * (turns + static_cast<double>(c) / 3));
      all[c].push_back(std::llround(value + 30 * unit(random)));
    }
  }
  all[0][kPeakAt] = kPeak_nm;
  return all;
}

class LongStream : public replay::Recording {
 public:
  explicit LongStream(std::int64_t seconds) : samples_{seconds * kRate} {
    for (const auto& channel : descriptor_.channels) formats_.push_back({channel.bytes, channel.is_signed});
  }
  const messages::Descriptor& firstDescriptor() const override { return descriptor_; }

  std::optional<replay::Recorded> next() override {
    if (next_ >= samples_) return std::nullopt;
    if (next_ % kRate == 0 && triggers_ <= next_ / kRate) return trigger();
    return block();
  }

 private:
  // One at the beginning of each second.
  messages::Trigger trigger() {
    messages::Trigger made;
    made.number = ++triggers_;
    made.line_sequence = triggers_;
    made.tick = {next_ / kInTick};
    made.at = monoTime(kBegin_ns + made.tick.index * kPeriod_ns);
    made.clock_state = ClockState::locked;
    return made;
  }

  replay::RecordedBlock block() {
    codec::BlockHeader header{.first = SampleIndex{next_}, .count = kInBlock, .samples_per_tick = kInTick};
    header.map.tick = {next_ / kInTick};
    header.map.at = monoTime(kBegin_ns + header.map.tick.index * kPeriod_ns);
    header.map.period_q32_ns = kPeriod_ns << 32U;
    header.map.sigma_ns = 40;
    header.map.state = ClockState::locked;
    const auto from = static_cast<std::ptrdiff_t>(next_ % kRate);
    std::vector<std::int64_t> columns;
    for (const auto& signal : signals_)
      columns.insert(columns.end(), signal.begin() + from, signal.begin() + from + kInBlock);
    replay::RecordedBlock made{header, {}, {}};
    made.raw.resize(codec::rawBlockSize(formats_, kInBlock));
    made.fast.resize(made.raw.size());
    if (!codec::encodeRaw(header, formats_, columns, made.raw)) std::abort();
    const auto size = codec::encodeFast(header, formats_, columns, made.fast);
    if (!size) std::abort();
    made.fast.resize(*size);
    next_ += kInBlock;
    return made;
  }

  messages::Descriptor descriptor_{described()};
  std::vector<codec::ChannelFormat> formats_;
  std::array<std::vector<std::int64_t>, kChannels> signals_{signals()};
  std::int64_t samples_;
  std::int64_t next_{};  // sample
  std::uint32_t triggers_{};
};

}  // namespace
}  // namespace probebox

int main(int count, char** words) {
  using namespace probebox;
  if (count != 3) {
    std::fputs("long_stream SECONDS SPEED\n", stderr);
    return 2;
  }
  auto listener = tcp::Listener::open({"127.0.0.1", 0});
  if (!listener) {
    std::fprintf(stderr, "%s\n", listener.error().what.c_str());
    return 1;
  }
  replay::ReplayBox box{std::make_unique<LongStream>(std::atoll(words[1])),
                        std::move(listener).value(),
                        {.speed = std::atof(words[2]), .once = false, .name = "a long stream"}};
  std::printf("tcp:127.0.0.1:%u\n", static_cast<unsigned>(box.address().port));
  std::fflush(stdout);
  while (box.round()) {
  }
  return 0;
}
