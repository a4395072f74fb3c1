#include "drivers/iio/linux_buffer.hpp"

#include <array>
#include <gmock/gmock.h>
#include <poll.h>

#include "drivers/iio/emulator.hpp"
#include "mock_device.hpp"

// The real driver on a mocked device; without umockdev these tests skip.
namespace probebox::iio {
namespace {

using namespace std::chrono_literals;
using testing::AllOf;
using testing::HasSubstr;

// An AD7606 as its driver shows it.
std::map<std::string, std::string> converter() {
  std::map<std::string, std::string> all{{"name", "ad7606-8"},
                                         {"buffer/enable", "1"},
                                         {"buffer/length", "2"},
                                         {"trigger/current_trigger", ""},
                                         {"current_timestamp_clock", "realtime"},
                                         {"in_voltage_scale", "0.305175"},
                                         {"in_voltage3_scale", "1.0"},
                                         {"scan_elements/in_timestamp_en", "0"},
                                         {"scan_elements/in_timestamp_index", "4"},
                                         {"scan_elements/in_timestamp_type", "le:s64/64>>0"}};
  for (int i = 0; i < 4; ++i) {
    const auto element = "scan_elements/in_voltage" + std::to_string(i) + "_";
    all[element + "en"] = i == 3 ? "1" : "0";
    all[element + "index"] = std::to_string(i);
    all[element + "type"] = "be:s16/16>>0";
  }
  return all;
}

DeviceChannels probeOnly() {
  return {"ad7606-8",
          true,
          "sync-trigger",
          1000,
          {{OfProbe{0}, "voltage2", 0.1, 0}, {OfProbe{1}, "voltage0", 0.2, 0}, {OfProbe{2}, "voltage1", -0.1, 100}}};
}

class Buffer : public testing::Test {
 protected:
  void SetUp() override {
    if (!device_) GTEST_SKIP() << "the real iio driver is not tested: install libumockdev-dev and configure again";
    EmulatedConverter::Config config;
    for (int i = 0; i < 3; ++i)
      config.channels.push_back(
          {{.big_endian = true, .is_signed = true, .real_bits = 16, .storage_bits = 16}, 0, 0.305175, [i](Nanoseconds) {
             return 1000.0 * (i + 1);
           }});
    frames_ = std::make_unique<EmulatedConverter>(config, monoTime(1'000'000'000));
  }

  // The frames of the next so many ms come out of the device.
  void send(int ms) {
    frames_->advanceTo(monoTime(1'000'000'000) + std::chrono::milliseconds{sent_ms_ += ms} - 1ns);
    std::vector<std::byte> bytes(1 << 15);
    bytes.resize(frames_->read(bytes));
    device_->send(bytes);
  }
  std::vector<Event> read(LinuxBuffer& source, std::size_t room = 256) {
    std::vector<Event> events(room);
    events.resize(source.read(events, now_ += 1ms));
    return events;
  }
  static std::vector<CountedDeflection> samples(const std::vector<Event>& events) {
    std::vector<CountedDeflection> all;
    for (const auto& event : events)
      if (const auto* const one = std::get_if<CountedDeflection>(&event)) all.push_back(*one);
    return all;
  }

  std::unique_ptr<MockDevice> device_ = makeMockDevice(converter());
  std::unique_ptr<EmulatedConverter> frames_;
  int sent_ms_{};
  MonoTime now_ = monoTime(50'000'000'000);
};

TEST_F(Buffer, SetsTheDeviceUpForItsChannelsStampsAndTrigger) {
  LinuxBuffer source{probeOnly()};
  EXPECT_TRUE(read(source).empty());
  EXPECT_EQ(source.problem(), "");
  EXPECT_EQ(device_->get("scan_elements/in_voltage0_en"), "1");
  EXPECT_EQ(device_->get("scan_elements/in_voltage1_en"), "1");
  EXPECT_EQ(device_->get("scan_elements/in_voltage2_en"), "1");
  EXPECT_EQ(device_->get("scan_elements/in_voltage3_en"), "0") << "what somebody had switched on";
  EXPECT_EQ(device_->get("scan_elements/in_timestamp_en"), "1");
  EXPECT_EQ(device_->get("current_timestamp_clock"), "monotonic");
  EXPECT_EQ(device_->get("trigger/current_trigger"), "sync-trigger");
  EXPECT_EQ(device_->get("buffer/length"), "250") << "a quarter of a second";
  EXPECT_EQ(device_->get("buffer/enable"), "1");
  EXPECT_EQ(source.name(), "ad7606-8 (probe)");
}

TEST_F(Buffer, GivesSamplesByTheChannelsOfTheProbe) {
  LinuxBuffer source{probeOnly()};
  read(source);
  ASSERT_GE(source.descriptor(), 0);
  pollfd watched{source.descriptor(), POLLIN, 0};
  EXPECT_EQ(poll(&watched, 1, 0), 0) << "nothing yet";
  send(21);
  EXPECT_EQ(poll(&watched, 1, 0), 1);
  const auto all = samples(read(source));
  ASSERT_EQ(all.size(), 20U);
  EXPECT_EQ(all[19].counter, 19U);
  EXPECT_EQ(all[19].at, monoTime(1'019'000'000));
  EXPECT_NEAR(all[0].channels_nm[0], 300'000, 20) << "a is voltage2, 3000 mV at 0.1 um";
  EXPECT_NEAR(all[0].channels_nm[1], 200'000, 40) << "b is voltage0, 1000 mV at 0.2 um";
  EXPECT_NEAR(all[0].channels_nm[2], -190'000, 20) << "c is voltage1, 2000 - 100 mV at -0.1 um";
}

TEST_F(Buffer, GivesEverythingWhateverRoomThereIs) {
  auto channels = probeOnly();
  channels.channels.push_back({OfScrew{Axis::x}, "voltage3", 1, 0});
  EmulatedConverter::Config config;
  for (int i = 0; i < 4; ++i)
    config.channels.push_back(
        {{.big_endian = true, .is_signed = true, .real_bits = 16, .storage_bits = 16}, 0, 1, [](Nanoseconds) {
           return 7.0;
         }});
  frames_ = std::make_unique<EmulatedConverter>(config, monoTime(1'000'000'000));
  LinuxBuffer source{channels};
  EXPECT_EQ(source.name(), "ad7606-8 (probe, screw X)");
  read(source);
  send(251);
  std::size_t deflections = 0, drifts = 0;
  for (auto events = read(source, 1); !events.empty(); events = read(source, 1)) {
    if (std::holds_alternative<CountedDeflection>(events[0])) {
      EXPECT_EQ(std::get<CountedDeflection>(events[0]).counter, deflections++);
    } else {
      EXPECT_EQ(std::get<Drift>(events[0]).reading_nm, 7000);
      ++drifts;
    }
  }
  EXPECT_EQ(deflections, 250U);
  EXPECT_EQ(drifts, 5U);
}

TEST_F(Buffer, TellsOnceThatItsDeviceWentAndReadsItAgainWhenItComes) {
  LinuxBuffer source{probeOnly()};
  read(source);
  for (int cycle = 0; cycle < 3; ++cycle) {
    send(11);
    device_->unplug();
    const auto events = read(source);
    const std::size_t waited = cycle == 0 ? 0 : 1;  // for the frame after it
    ASSERT_EQ(samples(events).size(), 10U + waited) << cycle;
    ASSERT_EQ(events.size(), 11U + waited);
    EXPECT_EQ(std::get<SourceLost>(events.back()).source, Source::probe);
    EXPECT_EQ(std::get<SourceLost>(events.back()).reason, LossReason::disconnected);
    EXPECT_NE(source.problem(), "");
    EXPECT_EQ(source.descriptor(), -1);
    now_ += 1s;
    EXPECT_TRUE(read(source).empty());
    EXPECT_THAT(std::string{source.problem()}, HasSubstr("this name"));
    device_->plugIn();
    now_ += 1s;
    EXPECT_TRUE(read(source).empty());
    EXPECT_EQ(source.problem(), "");
    send(11);
    const auto back = samples(read(source));
    ASSERT_EQ(back.size(), 10U);
    EXPECT_EQ(back[0].counter, 0U);
    EXPECT_NE(back[0].run, std::get<CountedDeflection>(events[0]).run) << "how many are missing is unknown";
  }
}

TEST_F(Buffer, SaysThatSamplesDoNotComeAtTheRateOfProbeToml) {
  auto channels = probeOnly();
  channels.rate_hz = 2000;
  LinuxBuffer source{channels};
  read(source);
  for (int i = 0; i < 4; ++i) {
    send(200);
    while (!read(source).empty()) {
    }
  }
  EXPECT_THAT(std::string{source.problem()}, AllOf(HasSubstr("1000"), HasSubstr("is 2000")));
}

TEST_F(Buffer, NamesWhatIsWrongAndTheRemedy) {
  const auto problemWith = [this](const DeviceChannels& channels) {
    LinuxBuffer source{channels};
    read(source);
    return std::string{source.problem()};
  };
  auto misspelt = probeOnly();
  misspelt.channels[1].channel = "voltage9";
  EXPECT_THAT(problemWith(misspelt), AllOf(HasSubstr("voltage9"), HasSubstr("box.toml")));
  auto other = probeOnly();
  other.device = "ad7607";
  EXPECT_THAT(problemWith(other), AllOf(HasSubstr("ad7607"), HasSubstr("none"), HasSubstr("iio:device3 (ad7606-8)")));
  device_->remove("trigger/current_trigger");
  EXPECT_THAT(problemWith(probeOnly()), AllOf(HasSubstr("sync-trigger"), HasSubstr("trigger*/name shows")));
  device_->set("scan_elements/in_voltage1_type", "le:f32/32>>0");
  EXPECT_THAT(problemWith(probeOnly()), AllOf(HasSubstr("channel voltage1"), HasSubstr("another channel")));
  device_->remove("scan_elements/in_timestamp_en");
  device_->set("scan_elements/in_voltage1_type", "be:s16/16>>0");
  EXPECT_THAT(problemWith(probeOnly()), AllOf(HasSubstr("no stamps"), HasSubstr("buffered = false")));
  device_->addAnother("iio:device4", {{"name", "ad7606-8"}, {"label", "second"}});
  EXPECT_THAT(problemWith(probeOnly()),
              AllOf(HasSubstr("iio:device3"), HasSubstr("ad7606-8"), HasSubstr("iio:device4"), HasSubstr("label")));
}

TEST_F(Buffer, LeavesTheDeviceToOthersAtItsEnd) {
  {
    LinuxBuffer source{probeOnly()};
    read(source);
    EXPECT_EQ(device_->get("buffer/enable"), "1");
  }
  EXPECT_EQ(device_->get("buffer/enable"), "0");
}

}  // namespace
}  // namespace probebox::iio
