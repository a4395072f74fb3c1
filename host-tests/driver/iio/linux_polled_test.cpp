#include "drivers/iio/linux_polled.hpp"

#include <algorithm>
#include <array>
#include <ctime>
#include <gmock/gmock.h>
#include <thread>

#include "mock_device.hpp"

// The real driver on a mocked device; without umockdev these tests skip.
namespace probebox::iio {
namespace {

using namespace std::chrono_literals;
using testing::AllOf;
using testing::HasSubstr;

MonoTime kernelNow() {
  timespec time{};
  clock_gettime(CLOCK_MONOTONIC, &time);
  return monoTime(std::int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec);
}

class Polled : public testing::Test {
 protected:
  void SetUp() override {
    if (!device_) GTEST_SKIP() << "the real iio driver is not tested: install libumockdev-dev and configure again";
  }

  // Reads until `done`; how long that takes is of no interest here.
  void readUntil(LinuxPolled& source, auto&& done) {
    for (int round = 0; round < 20'000 && !done(); ++round) {
      std::array<Event, 8> events;
      const auto count = source.read(events, kernelNow());
      for (std::size_t i = 0; i < count; ++i) {
        if (const auto* const reading = std::get_if<Drift>(&events[i])) readings_.push_back(*reading);
        if (const auto* const lost = std::get_if<SourceLost>(&events[i])) lost_.push_back(*lost);
      }
      if (count == 0) std::this_thread::sleep_for(1ms);
    }
    ASSERT_TRUE(done()) << source.problem();
  }

  DeviceChannels sensors_{"ads1115",
                          false,
                          "",
                          100,
                          {{OfScrew{Axis::x}, "voltage0", 0.5, 0}, {OfScrew{Axis::z}, "voltage1-voltage2", -2, 0}}};
  std::unique_ptr<MockDevice> device_ = makeMockDevice({{"name", "ads1115"},
                                                        {"in_voltage0_raw", "1000"},
                                                        {"in_voltage0_scale", "0.125000000"},
                                                        {"in_voltage0_offset", "-200"},
                                                        {"in_voltage1-voltage2_raw", "-40"},
                                                        {"in_voltage-voltage_scale", "0.5"}});
  std::vector<Drift> readings_;
  std::vector<SourceLost> lost_;
};

TEST_F(Polled, GivesReadingsWithTheTimeOfTheirConversion) {
  const MonoTime before = kernelNow();
  LinuxPolled source{sensors_};
  EXPECT_EQ(source.name(), "ads1115 (screw X, screw Z)");
  readUntil(source, [&] { return readings_.size() >= 6; });
  for (std::size_t i = 0; i < readings_.size(); ++i) {
    EXPECT_EQ(readings_[i].axis, i % 2 == 0 ? Axis::x : Axis::z);
    EXPECT_EQ(readings_[i].reading_nm, i % 2 == 0 ? 50'000 : 40'000) << "(1000 - 200) x 0.125 mV; -40 x 0.5 mV";
    EXPECT_GE(readings_[i].at, i == 0 ? before : readings_[i - 1].at);
  }
  EXPECT_LE(readings_.back().at, kernelNow());
  EXPECT_EQ(source.problem(), "");
  EXPECT_TRUE(lost_.empty());
}

TEST_F(Polled, TellsOnceThatItsDeviceWentAndReadsItAgainWhenItComes) {
  LinuxPolled source{sensors_};
  readUntil(source, [&] { return readings_.size() >= 2; });
  for (std::size_t cycle = 1; cycle <= 2; ++cycle) {
    device_->unplug();
    readUntil(source, [&] { return lost_.size() == cycle; });
    EXPECT_EQ(lost_.back().source, Source::drift);
    readUntil(source, [&] { return source.problem().find("there is none of this name") != std::string::npos; });
    readings_.clear();
    device_->plugIn();
    device_->set("in_voltage0_raw", std::to_string(200 + 80 * cycle));
    readUntil(source, [&] {
      return source.problem().empty() && std::ranges::any_of(readings_, [&](const Drift& reading) {
               return reading.axis == Axis::x && reading.reading_nm == static_cast<std::int32_t>(5000 * cycle);
             });
    });
    EXPECT_EQ(lost_.size(), cycle);
  }
}

TEST_F(Polled, NamesAChannelThatTheDeviceDoesNotHave) {
  sensors_.channels[1].channel = "voltage7";
  LinuxPolled source{sensors_};
  readUntil(source, [&] { return !source.problem().empty(); });
  EXPECT_THAT(std::string{source.problem()}, AllOf(HasSubstr("in_voltage7_raw"), HasSubstr("cannot do")));
  EXPECT_TRUE(lost_.empty()) << "what never worked is not lost";
}

TEST_F(Polled, NeedNotBeThereAndSaysSo) {
  device_->unplug();
  LinuxPolled source{sensors_};
  readUntil(source, [&] { return !source.problem().empty(); });
  EXPECT_THAT(std::string{source.problem()}, HasSubstr("driver"));
  EXPECT_TRUE(lost_.empty());
  device_->plugIn();
  readUntil(source, [&] { return !readings_.empty(); });
}

}  // namespace
}  // namespace probebox::iio
