#include "drivers/usb_probe/linux_receiver.hpp"

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <gmock/gmock.h>
#include <iterator>
#include <unistd.h>
#include <utility>
#include <vector>

#include "receiver_on_bus.hpp"

// The real driver and the real libusb on a mocked bus; without umockdev these tests skip.
namespace probebox::usb_probe {
namespace {

using namespace std::chrono_literals;
using testing::AllOf;
using testing::HasSubstr;

TEST_F(Receiver, GivesSamplesStampedWhenTheirTransferCameBack) {
  bus_->plug(kReceiver);
  LinuxReceiver source{""};
  EXPECT_TRUE(read(source).empty());
  EXPECT_EQ(source.problem(), "");
  EXPECT_EQ(bus_->resets("1-3"), 1U);
  EXPECT_GE(bus_->inFlight("1-3", MockBus::kSamplesIn), 8U);
  send(packets(1));
  const MonoTime before = kernelNow();
  const auto first = samples(source);
  ASSERT_EQ(first.size(), 4U);
  EXPECT_GE(first[0].at, before);
  EXPECT_LE(first[0].at, kernelNow());
  for (std::uint32_t i = 0; i < 4; ++i) {
    EXPECT_EQ(first[i].counter, i);
    EXPECT_EQ(first[i].at, first[0].at);
    EXPECT_EQ(first[i].newest, i == 3);
  }
  EXPECT_GE(bus_->inFlight("1-3", MockBus::kSamplesIn), 8U) << "what was read flies again";
}

TEST_F(Receiver, TakesTheTimeOfTheLastTransferAloneWhenSeveralHadToWait) {
  bus_->plug(kReceiver);
  LinuxReceiver source{""};
  read(source);
  for (int i = 0; i < 5; ++i) send(packets(1));
  const auto all = samples(source);
  ASSERT_EQ(all.size(), 20U);
  for (std::uint32_t i = 0; i < 20; ++i) {
    EXPECT_EQ(all[i].counter, i);
    EXPECT_EQ(all[i].newest, i == 19) << i;
  }
}

TEST_F(Receiver, GivesEverythingInOrderWhateverRoomThereIs) {
  bus_->plug(kReceiver);
  LinuxReceiver source{""};
  read(source);
  for (const std::size_t room : {1U, 3U, 4U, 5U, 64U}) {
    const auto first = static_cast<std::uint32_t>(device_.samples());
    send(packets(3));
    const auto two = packets(2);  // over two transfers, in mid-packet
    send(std::span{two}.first(90));
    send(std::span{two}.subspan(90));
    const auto all = samples(source, room);
    ASSERT_EQ(all.size(), 20U) << room;
    for (std::uint32_t i = 0; i < 20; ++i) {
      EXPECT_EQ(all[i].counter, first + i);
      EXPECT_EQ(all[i].newest, i == 19) << "room " << room << ", sample " << i;
    }
  }
  EXPECT_EQ(source.packets().bad(), 0U);
}

TEST_F(Receiver, NeedNotBeThereAndIsFoundWhenItComes) {
  LinuxReceiver source{""};
  EXPECT_TRUE(read(source).empty());
  EXPECT_THAT(source.problem(), AllOf(HasSubstr("no probe"), HasSubstr("plug")));
  EXPECT_GE(source.descriptor(), 0) << "plugging in must wake the reader";
  bus_->plug(kReceiver);
  waitUntil(source, [&] { return connected(); });
  EXPECT_EQ(source.problem(), "");
  EXPECT_TRUE(told_.empty()) << "nothing was lost";
  send(packets(1));
  EXPECT_EQ(samples(source).size(), 4U);
}

TEST_F(Receiver, TellsOnceThatItWentAfterTheLastSamplesAndComesBack) {
  bus_->plug(kReceiver);
  LinuxReceiver source{"RX-7"};
  read(source);
  for (int cycle = 0; cycle < 3; ++cycle) {
    const auto two = packets(2);
    send(std::span{two}.first(two.size() - 30));  // gone in mid-packet
    bus_->unplug("1-3");
    std::vector<Event> events;
    for (int round = 0; round < 5; ++round) {
      for (const auto& event : read(source)) events.push_back(event);
    }
    ASSERT_EQ(events.size(), 5U) << cycle;
    EXPECT_EQ(std::get<CountedDeflection>(events[3]).counter % 8, 3U);
    const auto& lost = std::get<SourceLost>(events[4]);
    EXPECT_EQ(lost.source, Source::probe);
    EXPECT_EQ(lost.reason, LossReason::disconnected);
    EXPECT_NE(source.problem(), "");

    auto again = kReceiver;
    again.address = static_cast<std::uint8_t>(8 + cycle);
    bus_->plug(again);
    waitUntil(source, [&] { return connected(); });
    EXPECT_EQ(source.problem(), "");
    EXPECT_TRUE(told_.empty());
    send(packets(2));
    const auto back = samples(source);
    ASSERT_EQ(back.size(), 8U) << "half a packet of before spoils nothing";
    EXPECT_EQ(back[0].counter % 8, 0U);
  }
  EXPECT_EQ(source.packets().bad(), 0U) << "half a packet of a device that went is no bad one";
}

TEST_F(Receiver, KeepsTheLossForAReaderWithoutRoom) {
  bus_->plug(kReceiver);
  LinuxReceiver source{""};
  read(source);
  send(packets(1));
  bus_->unplug("1-3");
  EXPECT_EQ(read(source, 4).size(), 4U);
  const auto later = read(source);
  ASSERT_EQ(later.size(), 1U);
  EXPECT_TRUE(std::holds_alternative<SourceLost>(later[0]));
  EXPECT_TRUE(read(source).empty());
}

TEST_F(Receiver, IsChosenByItsSerialNumber) {
  auto other = kReceiver;
  other.path = "1-4";
  other.address = 9;
  other.serial_number = "RX-9";
  bus_->plug(kReceiver);
  bus_->plug(other);
  LinuxReceiver any{""};
  read(any);
  EXPECT_THAT(any.problem(), AllOf(HasSubstr("several"), HasSubstr("RX-7"), HasSubstr("RX-9")));
  LinuxReceiver ours{"RX-9"};
  read(ours);
  EXPECT_EQ(ours.problem(), "");
  EXPECT_TRUE(bus_->claimed("1-4"));
  EXPECT_FALSE(bus_->claimed("1-3"));
  EXPECT_EQ(ours.name(), "probe receiver usb:RX-9");
  LinuxReceiver absent{"RX-1"};
  read(absent);
  EXPECT_THAT(absent.problem(), AllOf(HasSubstr("RX-1"), HasSubstr("RX-7")));
}

TEST_F(Receiver, ThatAnotherProgramHasIsNamedWithTheRemedyAndTriedAgain) {
  bus_->plug(kReceiver);
  bus_->claimElsewhere("1-3", "usbfs");
  LinuxReceiver source{""};
  read(source);
  EXPECT_THAT(source.problem(), AllOf(HasSubstr("usb:RX-7"), HasSubstr("in use"), HasSubstr("that program")));
  bus_->unplug("1-3");
  auto again = kReceiver;
  again.address = 8;
  bus_->plug(again);
  now_ += LinuxReceiver::kRetry;
  waitUntil(source, [&] { return connected(); });
  EXPECT_EQ(source.problem(), "");
}

// For a while this process is nobody in particular.
class AsNobody {
 public:
  AsNobody() { EXPECT_EQ(seteuid(65534), 0); }
  ~AsNobody() { EXPECT_EQ(seteuid(0), 0); }
};

TEST_F(Receiver, ThatMayNotBeOpenedIsNamedWithTheRemedyForADaemon) {
  if (geteuid() != 0) GTEST_SKIP() << "only root can become somebody who may not";
  bus_->plug(kReceiver);
  bus_->setMode("1-3", 0);
  LinuxReceiver source{""};
  {
    const AsNobody nobody;
    read(source);
    EXPECT_THAT(source.problem(),
                AllOf(HasSubstr("permission"), HasSubstr("/dev/bus/usb/001/007"), HasSubstr("60-probeboxd.rules")));
  }
  now_ += LinuxReceiver::kRetry;
  read(source);
  EXPECT_EQ(source.problem(), "") << "it is tried again";
  EXPECT_TRUE(connected());
}

TEST_F(Receiver, ThatStallsIsLostAndTriedAgain) {
  bus_->plug(kReceiver);
  LinuxReceiver source{""};
  read(source);
  bus_->spoil("1-3", MockBus::kSamplesIn, -EPIPE);
  const auto lost = read(source);
  ASSERT_EQ(lost.size(), 1U);
  EXPECT_TRUE(std::holds_alternative<SourceLost>(lost[0]));
  EXPECT_THAT(source.problem(), HasSubstr("stall"));
  EXPECT_TRUE(read(source).empty());
  EXPECT_FALSE(connected()) << "not at once: it would spin";
  now_ += LinuxReceiver::kRetry;
  read(source);
  EXPECT_TRUE(connected());
  send(packets(1));
  EXPECT_EQ(samples(source).size(), 4U);
}

TEST_F(Receiver, DamageCostsThePacketsThatItTouches) {
  bus_->plug(kReceiver);
  LinuxReceiver source{""};
  read(source);
  auto three = packets(3);
  three[100] ^= std::byte{4};  // in the second
  send(three);
  const auto all = samples(source);
  ASSERT_EQ(all.size(), 8U);
  EXPECT_EQ(all[4].counter, 8U);
  EXPECT_EQ(source.packets().bad_crc, 1U);
  EXPECT_EQ(source.problem(), "");
}

TEST_F(Receiver, OfAnotherVersionIsSaid) {
  bus_->plug(kReceiver);
  LinuxReceiver source{""};
  read(source);
  auto other = packets(1);
  other[4] = std::byte{4};
  send(other);
  EXPECT_TRUE(read(source).empty());
  EXPECT_THAT(source.problem(), HasSubstr("version"));
  send(packets(1));
  EXPECT_EQ(samples(source).size(), 4U);
  EXPECT_EQ(source.problem(), "");
}

TEST_F(Receiver, WithoutABulkInEndpointIsRefused) {
  auto strange = kReceiver;
  strange.endpoints = {MockBus::kDataOut};
  bus_->plug(strange);
  LinuxReceiver source{""};
  read(source);
  EXPECT_THAT(source.problem(), AllOf(HasSubstr("usb:RX-7"), HasSubstr("bulk IN")));
}

TEST_F(Receiver, LeavesNoDescriptorBehind) {
  const auto open = [] {
    return std::distance(std::filesystem::directory_iterator{"/proc/self/fd"}, std::filesystem::directory_iterator{});
  };
  LinuxReceiver source{""};
  auto device = kReceiver;
  std::ptrdiff_t after_first = 0;
  for (int cycle = 0; cycle < 8; ++cycle) {
    device.address = static_cast<std::uint8_t>(10 + cycle % 2);
    bus_->plug(device);
    now_ += LinuxReceiver::kRetry;
    waitUntil(source, [&] { return connected(); });
    bus_->unplug("1-3");
    now_ += LinuxReceiver::kRetry;
    waitUntil(source, [&] { return !told_.empty(); });
    EXPECT_EQ(std::exchange(told_, {}).size(), 1U);
    if (cycle == 1) after_first = open();  // the mock keeps a socket for each of its nodes
  }
  EXPECT_LE(open(), after_first + 2) << "one a cycle would be six more";
}

}  // namespace
}  // namespace probebox::usb_probe
