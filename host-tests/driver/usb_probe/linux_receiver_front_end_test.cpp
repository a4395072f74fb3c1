#include <atomic>

#include "host-tests/mock_usb/front_end_on_bus.hpp"
#include "receiver_on_bus.hpp"

// What the front end says of itself on a mocked bus, and the settings that it gets.
namespace probebox::usb_probe {
namespace {

using testing::HasSubstr;

class FrontEndOfReceiver : public Receiver {
 protected:
  usb::FrontEndOnBus front_end_;
};

TEST_F(FrontEndOfReceiver, SaysWhatItIsWhileItIsConnected) {
  bus_->plug(front_end_.device());
  LinuxReceiver source{""};
  read(source);
  ASSERT_NE(source.frontEnd(), nullptr) << source.problem();
  EXPECT_EQ(source.frontEnd()->identity.version, front_end::kVersion);
  EXPECT_EQ(source.frontEnd()->identity.step_ps, 48'000U);
  ASSERT_EQ(source.frontEnd()->pins.size(), front_end::kPins.size());
  EXPECT_EQ(source.frontEnd()->pins[13], front_end::kFirstLinePin);
  EXPECT_EQ(source.serialNumber(), usb::FrontEndOnBus::kSerial);
  EXPECT_EQ(source.packetVersion(), 0);
  send(packets(1));
  read(source);
  EXPECT_EQ(source.packetVersion(), 1);
  const auto changes = source.changes();
  bus_->unplug("1-3");
  for (int round = 0; round < 5; ++round) read(source);
  EXPECT_EQ(source.frontEnd(), nullptr);
  EXPECT_NE(source.changes(), changes);
}

TEST_F(FrontEndOfReceiver, IsNotKnownOfAnotherReceiver) {
  bus_->plug(kReceiver);
  LinuxReceiver source{""};
  read(source);
  EXPECT_TRUE(connected());
  EXPECT_EQ(source.frontEnd(), nullptr);
  EXPECT_EQ(source.serialNumber(), "RX-7");
}

TEST_F(FrontEndOfReceiver, GetsItsSettingsWheneverItHasOthers) {
  const front_end::Settings wanted{.steps_a_sample = 5000, .full_scale_nm = {2'500'000, -2'500'000, 400'000}};
  bus_->plug(front_end_.device());
  {
    LinuxReceiver source{"", {}, wanted};
    read(source);
    EXPECT_EQ(source.problem(), "");
    EXPECT_EQ(source.frontEnd()->settings, wanted);
  }
  EXPECT_EQ(front_end_.settings(), wanted);
  LinuxReceiver again{"", {}, wanted};
  read(again);
  EXPECT_EQ(again.frontEnd()->settings, wanted);
  EXPECT_EQ(front_end_.run(), 1) << "counts go on where nothing is to be changed";
}

TEST_F(FrontEndOfReceiver, IsNotReadWhileItRefusesItsSettings) {
  bus_->plug(front_end_.device());
  LinuxReceiver source{"", {}, front_end::Settings{.full_scale_nm = {1'000'000, 0, 1'000'000}}};
  read(source);
  EXPECT_THAT(source.problem(), HasSubstr("full_scale_um"));
  EXPECT_FALSE(connected());
  EXPECT_NE(source.frontEnd(), nullptr) << "status says what refuses";
  bus_->unplug("1-3");
  waitUntil(source, [&] { return source.frontEnd() == nullptr; });
  EXPECT_EQ(source.serialNumber(), "");
}

TEST_F(FrontEndOfReceiver, IsNotReadWhereItHasNoSettingsThatAreWanted) {
  bus_->plug(kReceiver);
  LinuxReceiver source{"", {}, front_end::Settings{}};
  read(source);
  EXPECT_THAT(source.problem(), HasSubstr("[front_end]"));
  EXPECT_FALSE(connected());
}

TEST_F(FrontEndOfReceiver, IsSeldomAskedAgainWhileItDoesNotAnswer) {
  std::atomic<int> asked{};
  auto silent = front_end_.device();
  silent.control = [&asked](auto, auto) {
    ++asked;
    return std::nullopt;
  };
  bus_->plug(silent);
  LinuxReceiver source{"", {}, front_end::Settings{}};
  read(source);
  const int once = asked;
  EXPECT_GT(once, 0);
  now_ += 2 * LinuxReceiver::kRetry;
  read(source);
  EXPECT_EQ(asked, once);
  now_ += LinuxReceiver::kRetryOfSettings;
  read(source);
  EXPECT_EQ(asked, 2 * once);
}

TEST_F(FrontEndOfReceiver, IsNotBlamedForSettingsThatDidNotArrive) {
  auto spoilt = front_end_.device();
  spoilt.control = [answers = spoilt.control](auto setup, auto data) {
    const bool is_write = (setup[0] & std::byte{0x80}) == std::byte{};
    return is_write ? std::nullopt : answers(setup, data);
  };
  bus_->plug(spoilt);
  LinuxReceiver source{"", {}, front_end::Settings{.steps_a_sample = 5000}};
  read(source);
  EXPECT_THAT(source.problem(), HasSubstr("cable"));
  EXPECT_THAT(source.problem(), testing::Not(HasSubstr("refuses")));
}

TEST(LackingReceiver, IsToldWhatItLacks) {
  FrontEnd front_end;
  EXPECT_EQ(whatIsLacking(&front_end, PacketHeader::kWithEdges), "");
  EXPECT_EQ(whatIsLacking(nullptr, 0), "");
  EXPECT_THAT(whatIsLacking(nullptr, 1), testing::AllOf(HasSubstr("axis counters"), HasSubstr("edges of lines")));
  EXPECT_THAT(whatIsLacking(nullptr, 2), testing::AllOf(testing::Not(HasSubstr("axis counters")), HasSubstr("edges")));
  front_end.identity.version = 0x0009;
  EXPECT_THAT(whatIsLacking(&front_end, 3), testing::AllOf(HasSubstr("0.9"), HasSubstr("update --front-end")));
}

}  // namespace
}  // namespace probebox::usb_probe
