#include "drivers/usb_host/hot_plug.hpp"

#include <gmock/gmock.h>

#include "on_a_bus.hpp"

namespace probebox::usb_host {
namespace {

using Plug = PlugEvent::Kind;

const MockBus::Device kPlugged{.path = "1-1", .address = 5, .serial_number = "PB-0001"};

// Told by udev, or looking by itself.
class HotPlugging : public OnABus, public ::testing::WithParamInterface<HotPlug::News> {
 protected:
  void watch() {
    auto plug = HotPlug::watch(usb::kLink, GetParam());
    ASSERT_TRUE(plug.ok()) << plug.error().what;
    plug_ = std::move(*plug);
  }

  // The next events; none when nothing comes.
  std::vector<PlugEvent> next() {
    auto events = plug_->poll();
    while (events.empty() && becomesReadable(plug_->descriptor())) events = plug_->poll();
    return events;
  }

  std::unique_ptr<HotPlug> plug_;
};

TEST_P(HotPlugging, TellsWhatIsThereThenWhatComesAndGoes) {
  bus_->plug(kPlugged);
  watch();
  const auto first = next();
  ASSERT_EQ(first.size(), 1U);
  EXPECT_EQ(first[0].kind, Plug::arrived);
  EXPECT_EQ(first[0].device.serial_number, "PB-0001");
  EXPECT_TRUE(plug_->poll().empty());

  bus_->plug({.path = "1-2", .address = 6, .serial_number = "PB-0002"});
  const auto second = next();
  ASSERT_EQ(second.size(), 1U);
  EXPECT_EQ(second[0].kind, Plug::arrived);
  EXPECT_EQ(second[0].device.serial_number, "PB-0002");

  bus_->unplug("1-1");
  const auto third = next();
  ASSERT_EQ(third.size(), 1U);
  EXPECT_EQ(third[0].kind, Plug::left);
  EXPECT_EQ(third[0].device.serial_number, "PB-0001");
  ASSERT_EQ(plug_->there().size(), 1U);
  EXPECT_EQ(plug_->there()[0].path, "1-2");
}

TEST_P(HotPlugging, SeesAReplugBetweenTwoLooks) {
  bus_->plug(kPlugged);
  watch();
  next();
  bus_->unplug("1-1");
  auto again = kPlugged;
  again.address = 6;
  bus_->plug(again);
  std::vector<PlugEvent> all;
  while (all.size() < 2) {
    const auto events = next();
    ASSERT_FALSE(events.empty());
    all.insert(all.end(), events.begin(), events.end());
  }
  EXPECT_EQ(all[0].kind, Plug::left);
  EXPECT_EQ(all[0].device.address, 5);
  EXPECT_EQ(all[1].kind, Plug::arrived);
  EXPECT_EQ(all[1].device.address, 6);
}

TEST_P(HotPlugging, IsNotDisturbedByOtherDevices) {
  watch();
  EXPECT_TRUE(plug_->poll().empty());
  bus_->plug({.path = "1-3", .address = 7, .serial_number = "RX-7", .interface_class = usb::kReceiver});
  bus_->plug(kPlugged);
  std::vector<PlugEvent> events;
  while (events.empty()) {
    events = next();
  }
  ASSERT_EQ(events.size(), 1U);
  EXPECT_EQ(events[0].device.serial_number, "PB-0001");
}

INSTANTIATE_TEST_SUITE_P(Both, HotPlugging, ::testing::Values(HotPlug::News::told, HotPlug::News::looked_for),
                         [](const auto& news) { return news.param == HotPlug::News::told ? "Told" : "LookedFor"; });

}  // namespace
}  // namespace probebox::usb_host
