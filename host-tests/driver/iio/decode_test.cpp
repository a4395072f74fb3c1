#include "drivers/iio/decode.hpp"

#include <array>
#include <cmath>
#include <gmock/gmock.h>
#include <memory>
#include <random>
#include <vector>

#include "drivers/iio/emulator.hpp"
#include "host-tests/support/events_of.hpp"

// The emulated converter and the decoder that reads it.
namespace probebox::iio {
namespace {

constexpr MonoTime kStart = monoTime(5'000'000'000);
constexpr ScanFormat kS16{.big_endian = true, .is_signed = true, .real_bits = 16, .storage_bits = 16, .shift = 0};
constexpr ScanFormat kU12{.big_endian = false, .is_signed = false, .real_bits = 12, .storage_bits = 16, .shift = 4};

// Three channels of +-10 V at 0.1 um per mV, and a screw sensor of 0 to 4095 mV whose offset the kernel states.
class Converter {
 public:
  explicit Converter(double rate_hz = 1000, std::size_t buffer_frames = 256) {
    const double lsb_mv = 0.30518;
    for (int i = 0; i < 3; ++i)
      config_.channels.push_back({kS16, 0, lsb_mv, [this, i](Nanoseconds t) { return probe_mv(i, t); }});
    config_.channels.push_back({kU12, 100, 1, [](Nanoseconds) { return 1500.0; }});
    config_.rate_hz = rate_hz;
    config_.buffer_frames = buffer_frames;
    FrameConfig frame{
        .period = Nanoseconds{std::llround(1e9 / rate_hz)}, .bytes = 16, .stamp_offset = 8, .channels = {}};
    for (std::uint8_t i = 0; i < 3; ++i)
      frame.channels.push_back({OfProbe{i}, {.scale = lsb_mv, .um_per_unit = 0.1, .zero_unit = 500}, kS16, i * 2U});
    frame.channels.push_back({OfScrew{Axis::y}, {.offset = 100, .scale = 1, .um_per_unit = 0.5}, kU12, 6});
    decoder = std::make_unique<FrameDecoder>(frame);
  }

  void start() { device = std::make_unique<EmulatedConverter>(config_, kStart); }
  std::vector<Event> until(Nanoseconds after_start) {
    std::vector<Event> events;
    device->advanceTo(kStart + after_start);
    std::vector<std::byte> bytes(1 << 16);
    bytes.resize(device->read(bytes));
    for (std::size_t at = 0; at < bytes.size(); at += device->frameBytes()) {
      std::array<Event, FrameDecoder::kMostEvents> into;
      const auto count = decoder->decode(std::span{bytes}.subspan(at, device->frameBytes()), into);
      events.insert(events.end(), into.begin(), into.begin() + static_cast<std::ptrdiff_t>(count));
    }
    return events;
  }

  EmulatedConverter::Config config_;
  std::function<double(int, Nanoseconds)> probe_mv = [](int, Nanoseconds) { return 500.0; };
  std::unique_ptr<EmulatedConverter> device;
  std::unique_ptr<FrameDecoder> decoder;
};

TEST(Frames, AreDeflectionsInNmWithACounterAndTheKernelsStamp) {
  Converter converter;
  converter.probe_mv = [](int channel, Nanoseconds t) {
    return 500 + 1000.0 * (channel + 1) + 1e-6 * static_cast<double>(t.count());
  };
  converter.start();
  const auto samples = support::eventsOf<CountedDeflection>(converter.until(std::chrono::milliseconds{100}));
  ASSERT_EQ(samples.size(), 100U);
  for (std::uint32_t i = 0; i < samples.size(); ++i) {
    EXPECT_EQ(samples[i].counter, i);
    EXPECT_EQ(samples[i].run, 0);
    EXPECT_TRUE(samples[i].newest);
    EXPECT_FALSE(samples[i].clipped);
    EXPECT_EQ(samples[i].at, kStart + std::chrono::milliseconds{i});
    for (std::size_t channel = 0; channel < 3; ++channel)
      EXPECT_NEAR(samples[i].channels_nm[channel], 1e5 * static_cast<double>(channel + 1) + 100.0 * i, 16)
          << "half a step is 15 nm";
  }
}

TEST(Frames, SayWhenAChannelIsAtTheEndOfTheConverter) {
  Converter converter;
  converter.probe_mv = [](int channel, Nanoseconds t) {
    if (t == std::chrono::milliseconds{3} && channel == 1) return 1e5;
    if (t == std::chrono::milliseconds{5} && channel == 2) return -1e5;
    return 500.0;
  };
  converter.start();
  const auto samples = support::eventsOf<CountedDeflection>(converter.until(std::chrono::milliseconds{10}));
  ASSERT_EQ(samples.size(), 10U);
  for (std::uint32_t i = 0; i < samples.size(); ++i) EXPECT_EQ(samples[i].clipped, i == 3 || i == 5) << i;
}

TEST(Frames, ThatTheKernelDroppedAreMissingByNumber) {
  Converter converter{1000, 64};
  std::mt19937_64 random{3};
  converter.config_.lateness = [&random] {
    return Nanoseconds{std::llround(std::lognormal_distribution{std::log(1e4), 0.5}(random))};
  };
  converter.config_.offset_ppm = 80;
  converter.start();
  std::vector<CountedDeflection> samples;
  for (const int ms : {50, 100, 300, 320, 600, 650}) {  // two reads came too late for the buffer
    for (const auto& sample : support::eventsOf<CountedDeflection>(converter.until(std::chrono::milliseconds{ms})))
      samples.push_back(sample);
  }
  EXPECT_GT(converter.device->dropped(), 300U);
  EXPECT_EQ(converter.decoder->counter().missing(), converter.device->dropped());
  EXPECT_EQ(samples.back().counter, converter.device->taken() - 2) << "the newest waits for the next";
  EXPECT_EQ(samples.back().run, 0);
}

TEST(Frames, GiveScrewExtensionsAsMeansOver50Ms) {
  Converter converter{1000, 2000};
  converter.start();
  const auto readings = support::eventsOf<Drift>(converter.until(std::chrono::milliseconds{1000}));
  ASSERT_EQ(readings.size(), 20U);
  for (std::size_t i = 0; i < readings.size(); ++i) {
    EXPECT_EQ(readings[i].axis, Axis::y);
    EXPECT_EQ(readings[i].reading_nm, 750'000);
    EXPECT_EQ(readings[i].at, kStart + std::chrono::microseconds{24'500 + 50'000 * static_cast<int>(i)});
  }
}

TEST(Frames, WhoseStampDoesNotAdvanceAreCounted) {
  Converter converter;
  converter.start();
  converter.until(std::chrono::milliseconds{5});
  converter.device = std::make_unique<EmulatedConverter>(converter.config_, kStart);
  EXPECT_EQ(support::eventsOf<CountedDeflection>(converter.until(std::chrono::milliseconds{5})).size(), 0U);
  EXPECT_EQ(converter.decoder->unusable(), 6U);
}

TEST(Conversion, OfAnImpossibleValueIsClippedToWhatAnEventHolds) {
  EXPECT_EQ(wholeNm(1e300), 2147483647);
  EXPECT_EQ(wholeNm(-1e300), -2147483647);
  EXPECT_EQ(wholeNm(-2.5e3), -2500);
}

}  // namespace
}  // namespace probebox::iio
