#include "drivers/counter/linux_counter.hpp"

#include <array>
#include <cerrno>
#include <ctime>
#include <gmock/gmock.h>
#include <poll.h>
#include <utility>
#include <vector>

#include "mock_counter.hpp"

// The driver of the kernel's counter devices, on a mocked one: the same files, ioctls and events.
namespace probebox::counter {
namespace {

using namespace std::chrono_literals;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class LinuxCounterTest : public ::testing::Test {
 protected:
  void SetUp() override {
    device = makeMockCounter();
    if (!device) GTEST_SKIP() << "no libumockdev-dev at the build";
  }
  std::string problem() {
    LinuxCounter counter{described, 'X', 1ms};
    const auto opened = counter.open();
    EXPECT_FALSE(opened.ok());
    return opened.ok() ? "" : opened.error().what;
  }

  std::unique_ptr<MockCounter> device;
  board::CounterEncoder described{.device = MockCounter::kName};
};

counter_event eventOf(const counter_watch& watch, std::uint64_t value, std::uint64_t stamp_ns) {
  counter_event event{};
  event.timestamp = stamp_ns;
  event.value = value;
  event.watch = watch;
  return event;
}

TEST_F(LinuxCounterTest, IsFoundByNameNumberOrPath) {
  for (const auto* const name : {MockCounter::kName, "counter3", "/dev/counter3"}) {
    described.device = name;
    LinuxCounter counter{described, 'X', 1ms};
    const auto opened = counter.open();
    ASSERT_TRUE(opened.ok()) << name << ": " << opened.error().what;
    EXPECT_EQ(opened->ceiling, 4'294'967'295U);
  }
  described.device = "counter9";
  EXPECT_THAT(problem(), AllOf(HasSubstr("counter9"), HasSubstr("counter3 (48300180.counter)"), HasSubstr("'device'"),
                               HasSubstr("[encoder.X]"), HasSubstr("box.toml")));
  described.device = MockCounter::kName;
  described.count = 2;
  EXPECT_THAT(problem(), HasSubstr("count2"));
}

TEST_F(LinuxCounterTest, ReadsTheCountBetweenTwoReadingsOfTheClock) {
  LinuxCounter counter{described, 'X', 1ms};
  ASSERT_TRUE(counter.open().ok());
  device->set("count", "4294967290");
  const auto first = counter.poll();
  ASSERT_TRUE(first);
  EXPECT_EQ(first->value, 4'294'967'290U);
  EXPECT_LE(first->before, first->after);
  device->set("count", "7");
  const auto second = counter.poll();
  ASSERT_TRUE(second);
  EXPECT_EQ(second->value, 7U);
  EXPECT_GE(second->before, first->after);
}

TEST_F(LinuxCounterTest, IsDueByItsTimer) {
  LinuxCounter counter{described, 'X', 1ms};
  ASSERT_TRUE(counter.open().ok());
  pollfd waiting{counter.descriptor(), POLLIN, 0};
  ASSERT_EQ(poll(&waiting, 1, 5000), 1);
  EXPECT_TRUE(counter.isDue({}));
  EXPECT_TRUE(counter.poll());
}

TEST_F(LinuxCounterTest, RefusesADeviceThatIsSetUpForSomethingElse) {
  device->set("enable", "0");
  EXPECT_THAT(problem(), AllOf(HasSubstr("/sys/bus/counter/devices/counter3/count0/enable"), HasSubstr("udev rule")));
  device->set("enable", "1");
  device->set("function", "increase");
  EXPECT_THAT(problem(), HasSubstr("no direction"));
  device->set("function", "quadrature x4");
  device->set("count_mode", "range limit");
  EXPECT_THAT(problem(), HasSubstr("its ends"));
}

// As an eQEP before its udev rule has run: it shows 0 whatever the axis does, and no 'bits' can change that.
TEST_F(LinuxCounterTest, RefusesACeilingOfZero) {
  device->set("ceiling", "0");
  for (const auto& [bits, largest] : {std::pair{std::uint8_t{0}, "4294967295"}, {std::uint8_t{16}, "65535"}}) {
    described.bits = bits;
    EXPECT_THAT(problem(),
                AllOf(HasSubstr("has a ceiling of 0, so that its count stays at 0: echo " + std::string{largest} +
                                " > /sys/bus/counter/devices/counter3/count0/ceiling"),
                      HasSubstr("udev rule")));
  }
  device->set("ceiling", "");
  LinuxCounter silent{described, 'X', 1ms};
  const auto opened = silent.open();
  ASSERT_TRUE(opened.ok()) << opened.error().what;
  EXPECT_FALSE(opened->ceiling) << "a driver that does not say";
}

TEST_F(LinuxCounterTest, AsksForTheEventsThatLatchAndForTheIndex) {
  device->set("capture_component_id", "5");
  described.latched_by = board::LatchedBy::capture;
  described.latch_channel = 2;
  described.latched_value = board::LatchedValue::capture;
  described.has_index = true;
  described.index_channel = 1;
  LinuxCounter counter{described, 'X', 1ms};
  ASSERT_TRUE(counter.open().ok());
  const auto watches = device->watches();
  ASSERT_EQ(watches.size(), 2U);
  EXPECT_EQ(watches[0].event, COUNTER_EVENT_CAPTURE);
  EXPECT_EQ(watches[0].channel, 2);
  EXPECT_EQ(watches[0].component.type, COUNTER_COMPONENT_EXTENSION);
  EXPECT_EQ(watches[0].component.id, 5);
  EXPECT_EQ(watches[1].event, COUNTER_EVENT_INDEX);
  EXPECT_EQ(watches[1].component.type, COUNTER_COMPONENT_COUNT);
  device->push(eventOf(watches[0], 1234, 1'000'000));
  device->push(eventOf(watches[1], 9, 1'500'000));
  auto failed = eventOf(watches[0], 0, 2'000'000);
  failed.status = EIO;
  device->push(failed);
  std::array<CounterEvent, 8> events;
  ASSERT_EQ(counter.readEvents(events), 3U);
  EXPECT_EQ(events[0].what, Happened::latched);
  EXPECT_EQ(events[0].value, 1234U);
  EXPECT_EQ(toNs(events[0].at), 1'000'000);
  EXPECT_EQ(events[1].what, Happened::index);
  EXPECT_EQ(toNs(events[1].at), 1'500'000);
  EXPECT_FALSE(events[2].is_valid);
  EXPECT_EQ(counter.readEvents(events), 0U);
}

// As when another process watches the same device.
TEST_F(LinuxCounterTest, TakesNoEventThatItDidNotAskFor) {
  described.has_index = true;
  LinuxCounter polled{described, 'X', 1ms};
  ASSERT_TRUE(polled.open().ok());
  ASSERT_EQ(device->watches().size(), 1U);
  const auto index = device->watches()[0];
  auto channel = index, parent = index, event = index;
  channel.channel = 1;
  parent.component.parent = 1;
  event.event = COUNTER_EVENT_CAPTURE;
  const auto heard = [&](LinuxCounter& counter) {
    std::array<CounterEvent, 8> events;
    const auto count = counter.readEvents(events);
    std::vector<Happened> happened;
    for (std::size_t i = 0; i < count.value_or(0); ++i) happened.push_back(events[i].what);
    return happened;
  };
  for (const auto& watch : {channel, parent, event, index}) device->push(eventOf(watch, 500, 1'000'000));
  EXPECT_THAT(heard(polled), ElementsAre(Happened::foreign, Happened::foreign, Happened::foreign, Happened::index));

  described.latched_by = board::LatchedBy::capture;
  described.latch_channel = 2;
  LinuxCounter latched{described, 'X', 1ms};
  ASSERT_TRUE(latched.open().ok());
  ASSERT_EQ(device->watches().size(), 2U);
  const auto capture = device->watches()[0];
  channel = parent = capture;
  channel.channel = 3;
  parent.component.parent = 1;
  for (const auto& watch : {channel, parent, capture}) device->push(eventOf(watch, 500, 1'000'000));
  EXPECT_THAT(heard(latched), ElementsAre(Happened::foreign, Happened::foreign, Happened::latched));
}

TEST_F(LinuxCounterTest, SaysWhichKeyAsksForAnEventThatTheDeviceDoesNotReport) {
  described.latched_by = board::LatchedBy::change_of_state;
  device->refuseWatches(EINVAL);
  EXPECT_THAT(problem(), AllOf(HasSubstr("this event"), HasSubstr("'latched_by'"), HasSubstr("[encoder.X]")));
  device->refuseWatches(0);
  described.latched_value = board::LatchedValue::capture;
  EXPECT_THAT(problem(), HasSubstr("latched_value = \"count\""));
}

TEST_F(LinuxCounterTest, IsGoneAndComesBack) {
  described.has_index = true;
  LinuxCounter counter{described, 'X', 1ms};
  ASSERT_TRUE(counter.open().ok());
  device->unplug();
  std::array<CounterEvent, 8> events;
  EXPECT_FALSE(counter.poll());
  EXPECT_FALSE(counter.readEvents(events));
  EXPECT_FALSE(counter.open().ok());
  device->plugIn();
  EXPECT_TRUE(counter.open().ok());
  EXPECT_TRUE(counter.poll());
}

}  // namespace
}  // namespace probebox::counter
