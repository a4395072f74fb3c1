#include "receiver_on_bus.hpp"

// The axis counters of a receiver, on a mocked bus.
namespace probebox::usb_probe {
namespace {

using testing::AllOf;
using testing::HasSubstr;

// A receiver with three axis counters; X is wired to the first and C to the third.
class ReceiverWithCounters : public Receiver {
 protected:
  void SetUp() override {
    Receiver::SetUp();
    device_ = EmulatedReceiver{{.samples_a_packet = 4, .counters = 3},
                               [](Nanoseconds) { return std::array<Micrometres, 3>{}; },
                               monoTime(0),
                               [](Nanoseconds) {
                                 return std::array<std::int64_t, kMostCounters>{11, 22, 33};
                               }};
    axes_[0] = {.axis = 0, .has_index = true};
    axes_[2] = {.axis = 5, .has_index = false};
  }
  CounterAxes axes_{};
};

TEST_F(ReceiverWithCounters, GivesCountsOfWiredAxesWithTheirSamples) {
  bus_->plug(kReceiver);
  LinuxReceiver source{"", {.axes = axes_}};
  read(source);
  send(packets(1));
  const auto events = read(source);
  ASSERT_EQ(events.size(), 8U);
  for (std::uint32_t i = 0; i < 4; ++i) {
    EXPECT_EQ(std::get<CountedDeflection>(events[2 * i]).counter, i);
    const auto& counted = std::get<CountedAxes>(events[2 * i + 1]);
    EXPECT_EQ(counted.counter, i);
    EXPECT_EQ(counted.axes, 0b100001);
    EXPECT_EQ(counted.counts[0], 11);
    EXPECT_EQ(counted.counts[5], 33);
  }
  EXPECT_EQ(source.problem(), "");
}

TEST_F(ReceiverWithCounters, TellsOnceThatItWentWithItsEncoders) {
  bus_->plug(kReceiver);
  LinuxReceiver source{"", {.axes = axes_}};
  read(source);
  for (int cycle = 0; cycle < 2; ++cycle) {
    send(packets(1));
    bus_->unplug("1-3");
    std::vector<Event> events;
    for (int round = 0; round < 5; ++round) {
      for (const auto& event : read(source)) events.push_back(event);
    }
    ASSERT_EQ(events.size(), 10U) << cycle;
    EXPECT_EQ(std::get<SourceLost>(events[8]).source, Source::probe);
    const auto& encoders = std::get<SourceLost>(events[9]);
    EXPECT_EQ(encoders.source, Source::encoders);
    EXPECT_EQ(encoders.axes, 0b100001);
    auto again = kReceiver;
    again.address = static_cast<std::uint8_t>(8 + cycle);
    bus_->plug(again);
    waitUntil(source, [&] { return connected(); });
  }
}

TEST_F(ReceiverWithCounters, NamesAnAxisWhoseCounterItDoesNotSend) {
  axes_[5] = {.axis = 1, .has_index = false};
  bus_->plug(kReceiver);
  LinuxReceiver source{"", {.axes = axes_}};
  read(source);
  send(packets(1));
  read(source);
  EXPECT_THAT(source.problem(), AllOf(HasSubstr("3 axis"), HasSubstr("[encoder.Y]"), HasSubstr("box.toml"),
                                      HasSubstr("number 5"), HasSubstr("correct 'channel'")));
}

}  // namespace
}  // namespace probebox::usb_probe
