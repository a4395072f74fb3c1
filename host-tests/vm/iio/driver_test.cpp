#include <array>
#include <chrono>
#include <ctime>
#include <filesystem>
#include <functional>
#include <gmock/gmock.h>
#include <poll.h>
#include <string>
#include <thread>
#include <vector>

#include "adc_sim.hpp"
#include "drivers/iio/linux_buffer.hpp"
#include "drivers/iio/linux_polled.hpp"
#include "host-tests/support/events_of.hpp"

// The real drivers on the kernel's own industrial I/O: its dummy device, and a converter whose inputs the test makes.
namespace probebox::iio {
namespace {

using namespace std::chrono_literals;
using support::eventsOf;
using testing::HasSubstr;
using vm::AdcSim;

MonoTime now() {
  timespec time{};
  clock_gettime(CLOCK_MONOTONIC, &time);
  return monoTime(std::int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec);
}

// What configfs makes of drivers/iio/dummy: in_voltage0 reads 73, or 7 in its buffer, plus 7, times 1.333 uV.
class DummyDevice {
 public:
  static constexpr const char* kName = "screw";
  static constexpr double kScale = 0.001333;
  static constexpr int kOffset = 7, kRead = 73, kBuffered = 7;

  DummyDevice() { std::filesystem::create_directory(kFolder); }
  ~DummyDevice() { std::filesystem::remove(kFolder); }
  DummyDevice(const DummyDevice&) = delete;
  DummyDevice& operator=(const DummyDevice&) = delete;

 private:
  static constexpr const char* kFolder = "/sys/kernel/config/iio/devices/dummy/screw";
};

constexpr double kUmPerMillivolt = 100;

std::int32_t dummyNm(int raw) {
  return wholeNm((raw + DummyDevice::kOffset) * DummyDevice::kScale * kUmPerMillivolt * 1e3);
}

// Reads as the capture thread does, until `done`.
bool readUntil(io::EventSource& source, std::vector<Event>& events, const std::function<bool()>& done) {
  std::array<Event, 64> batch;
  for (int i = 0; i < 20'000 && !done(); ++i) {
    pollfd waiting{source.descriptor(), POLLIN, 0};
    ::poll(&waiting, 1, 1);
    while (const std::size_t got = source.read(batch, now()))
      events.insert(events.end(), batch.begin(), batch.begin() + static_cast<std::ptrdiff_t>(got));
  }
  return done();
}

TEST(DummyOfTheKernel, IsReadOneValueAfterTheOther) {
  const DummyDevice device;
  LinuxPolled source{{DummyDevice::kName, false, "", 100, {{OfScrew{Axis::y}, "voltage0", kUmPerMillivolt, 0}}}};
  std::vector<Event> events;
  const auto before = now();
  ASSERT_TRUE(readUntil(source, events, [&] { return eventsOf<Drift>(events).size() >= 20; })) << source.problem();
  MonoTime last = before;
  for (const auto& drift : eventsOf<Drift>(events)) {
    EXPECT_EQ(drift.axis, Axis::y);
    EXPECT_EQ(drift.reading_nm, dummyNm(DummyDevice::kRead));
    EXPECT_GT(drift.at, last);
    last = drift.at;
  }
  EXPECT_LT(last, now());
}

TEST(DummyOfTheKernel, IsReadThroughItsBufferWithTheKernelsStamps) {
  const DummyDevice device;
  AdcSim converter;
  LinuxBuffer source{
      {DummyDevice::kName, true, AdcSim::kTrigger, 100, {{OfScrew{Axis::x}, "voltage0", kUmPerMillivolt, 0}}}};
  std::vector<Event> events;
  ASSERT_TRUE(readUntil(source, events, [&] { return source.descriptor() >= 0; })) << source.problem();
  const auto before = now();
  ASSERT_TRUE(readUntil(source, events, [&] {
    converter.convert({});  // its ready signal is a trigger for any device
    std::this_thread::sleep_for(10ms);
    return eventsOf<Drift>(events).size() >= 5;
  })) << source.problem();
  for (const auto& drift : eventsOf<Drift>(events)) {
    EXPECT_EQ(drift.axis, Axis::x);
    EXPECT_EQ(drift.reading_nm, dummyNm(DummyDevice::kBuffered));
    EXPECT_GT(drift.at, before);
    EXPECT_LT(drift.at, now());
  }
  EXPECT_EQ(source.problem(), "");
}

TEST(DummyOfTheKernel, GoesAndComesBack) {
  auto device = std::make_unique<DummyDevice>();
  LinuxPolled source{{DummyDevice::kName, false, "", 100, {{OfScrew{Axis::z}, "voltage0", kUmPerMillivolt, 0}}}};
  std::vector<Event> events;
  ASSERT_TRUE(readUntil(source, events, [&] { return eventsOf<Drift>(events).size() >= 3; })) << source.problem();
  device.reset();
  ASSERT_TRUE(readUntil(source, events, [&] { return !eventsOf<SourceLost>(events).empty(); }));
  EXPECT_EQ(eventsOf<SourceLost>(events).front().source, Source::drift);
  EXPECT_FALSE(source.problem().empty());
  device = std::make_unique<DummyDevice>();
  const auto before = eventsOf<Drift>(events).size();
  ASSERT_TRUE(readUntil(source, events, [&] { return eventsOf<Drift>(events).size() >= before + 3; }))
      << source.problem();
  EXPECT_EQ(source.problem(), "");
  EXPECT_EQ(eventsOf<SourceLost>(events).size(), 1U);
}

DeviceChannels probe() {
  return {AdcSim::kName,
          true,
          "",
          1000,
          {{OfProbe{0}, "voltage0", 2, 0}, {OfProbe{1}, "voltage1", -1, 0}, {OfProbe{2}, "voltage2", 1, 0.5}}};
}

TEST(ConverterOfTheKernel, GivesFramesOfTheProbeStampedInTheInterrupt) {
  AdcSim converter;
  LinuxBuffer source{probe()};
  std::vector<Event> events;
  ASSERT_TRUE(readUntil(source, events, [&] { return source.descriptor() >= 0; })) << source.problem();
  std::vector<MonoTime> before, after;
  for (int i = 0; i < 200; ++i) {
    before.push_back(now());
    converter.convert({1000 * i, -1000 * i, 8'388'607});
    after.push_back(now());
    while (now() - before.back() < 1ms) continue;
  }
  // A frame is numbered when the next has come.
  ASSERT_TRUE(readUntil(source, events, [&] { return eventsOf<CountedDeflection>(events).size() >= 199; }));
  const auto samples = eventsOf<CountedDeflection>(events);
  ASSERT_EQ(samples.size(), 199U);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const auto number = static_cast<std::int32_t>(i);
    EXPECT_THAT(samples[i].channels_nm, testing::ElementsAre(2000 * number, 1000 * number, 8'388'607 - 500));
    EXPECT_TRUE(samples[i].clipped) << "the third input is at the end of its range";
    EXPECT_GT(samples[i].at, before[i]);
    EXPECT_LT(samples[i].at, after[i]);
  }
  EXPECT_EQ(source.unusable(), 0U);
}

TEST(ConverterOfTheKernel, IsUnpluggedWhileItConvertsAndComesBackAsANewRun) {
  AdcSim converter;
  LinuxBuffer source{probe()};
  std::vector<Event> events;
  const auto convertUntil = [&](const std::function<bool()>& done) {
    return readUntil(source, events, [&] {
      if (source.descriptor() >= 0 && converter.isPlugged()) converter.convert({1, 2, 3});
      return done();
    });
  };
  const auto samples = [&] { return eventsOf<CountedDeflection>(events); };
  ASSERT_TRUE(convertUntil([&] { return samples().size() >= 20; })) << source.problem();
  const auto run = samples().back().run;
  converter.unplug();
  ASSERT_TRUE(convertUntil([&] { return !eventsOf<SourceLost>(events).empty(); }));
  EXPECT_EQ(eventsOf<SourceLost>(events).front().source, Source::probe);
  EXPECT_THAT(std::string{source.problem()}, HasSubstr("plug it in again"));
  const auto had = samples().size();
  converter.plugIn();
  ASSERT_TRUE(convertUntil([&] { return samples().size() >= had + 20; })) << source.problem();
  EXPECT_NE(samples().back().run, run) << "how many frames are missing is unknown";
  EXPECT_EQ(eventsOf<SourceLost>(events).size(), 1U);
}

}  // namespace
}  // namespace probebox::iio
