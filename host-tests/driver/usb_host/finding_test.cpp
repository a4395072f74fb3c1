#include <array>
#include <gmock/gmock.h>
#include <unistd.h>

#include "drivers/usb_host/claimed_interface.hpp"
#include "drivers/usb_host/linux_access.hpp"
#include "on_a_bus.hpp"

namespace probebox::usb_host {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using Kind = OpenError::Kind;

const MockBus::Device kFirst{.path = "1-1", .address = 5, .serial_number = "PB-0001"};
const MockBus::Device kSecond{.path = "1-2.4", .address = 9, .serial_number = "PB-0002"};
const MockBus::Device kReceiver{.path = "1-3",
                                .address = 11,
                                .serial_number = "RX-7",
                                .product = "receiver",
                                .interface_class = usb::kReceiver,
                                .endpoints = {MockBus::kSamplesIn}};

const MockBus::Device kHub{
    .path = "1-2", .address = 2, .product = "hub", .interface_class = {9, 0, 0}, .endpoints = {}};

// Not root: root may open everything.
class AsNobody {
 public:
  AsNobody() { EXPECT_TRUE(::geteuid() != 0 || ::setresuid(kNobody, kNobody, 0) == 0); }
  ~AsNobody() { EXPECT_TRUE(::geteuid() != kNobody || ::setresuid(0, 0, 0) == 0); }

 private:
  static constexpr uid_t kNobody = 65534;
};

class Finding : public OnABus {
 protected:
  void SetUp() override {
    OnABus::SetUp();
    if (bus_) bus_->plug(kHub);
  }

  std::vector<Device> find(const usb::InterfaceClass& wanted) {
    const auto context = Context::open();
    EXPECT_TRUE(context.ok());
    return devices(*context, wanted);
  }
  static OpenError openError(std::string_view name = "") {
    const auto opened = ClaimedInterface::open(usb::kLink, name);
    EXPECT_FALSE(opened.ok());
    return opened.ok() ? OpenError{} : opened.error();
  }
};

TEST_F(Finding, GoesByTheClassOfTheInterfaceAlone) {
  bus_->plug(kFirst);
  bus_->plug(kReceiver);
  bus_->plug({.path = "1-4", .address = 12, .serial_number = "X", .interface_class = {0xFF, 0x50, 9}});
  const auto boxes = find(usb::kLink);
  ASSERT_EQ(boxes.size(), 1U);
  EXPECT_EQ(boxes[0].serial_number, "PB-0001");
  const auto receivers = find(usb::kReceiver);
  ASSERT_EQ(receivers.size(), 1U);
  EXPECT_EQ(receivers[0].serial_number, "RX-7");
}

TEST_F(Finding, TellsWhatThereIsToKnowWithoutOpening) {
  bus_->plug(kSecond);
  bus_->setMode("1-2.4", 0);
  const AsNobody nobody;
  const auto boxes = find(usb::kLink);
  ASSERT_EQ(boxes.size(), 1U);
  const auto& box = boxes[0];
  EXPECT_EQ(box.serial_number, "PB-0002");
  EXPECT_EQ(box.product, "probebox");
  EXPECT_EQ(box.path, "1-2.4");
  EXPECT_EQ(box.node, "/dev/bus/usb/001/009");
  std::vector<std::uint8_t> addresses;
  for (const auto& endpoint : box.endpoints) addresses.push_back(endpoint.address);
  EXPECT_THAT(addresses,
              ::testing::ElementsAre(MockBus::kDataIn, MockBus::kDataOut, MockBus::kControlIn, MockBus::kControlOut))
      << "in the order of the descriptor, whatever their numbers";
  EXPECT_EQ(box.endpoints[0].packet_bytes, 512);
  EXPECT_TRUE(box.endpoints[0].in);
  EXPECT_FALSE(box.endpoints[1].in);
}

TEST_F(Finding, TakesTheOnlyOneOrTheOneThatIsNamed) {
  bus_->plug(kSecond);
  EXPECT_EQ(ClaimedInterface::open(usb::kLink, "").value()->device().path, "1-2.4");
  bus_->plug(kFirst);
  EXPECT_EQ(ClaimedInterface::open(usb::kLink, "PB-0001").value()->device().path, "1-1");
  EXPECT_EQ(ClaimedInterface::open(usb::kLink, "1-2.4").value()->device().serial_number, "PB-0002");
}

TEST_F(Finding, NamesWhatIsThereWhenTheChoiceIsNotClear) {
  EXPECT_EQ(openError().kind, Kind::absent);
  EXPECT_THAT(openError("PB-0009").what, AllOf(HasSubstr("PB-0009"), HasSubstr("lsusb")));
  bus_->plug(kFirst);
  bus_->plug(kSecond);
  const auto absent = openError("PB-0009");
  EXPECT_EQ(absent.kind, Kind::absent);
  EXPECT_THAT(absent.what, AllOf(HasSubstr("PB-0009"), HasSubstr("PB-0001"), HasSubstr("1-1"), HasSubstr("PB-0002"),
                                 HasSubstr("1-2.4")));
  const auto several = openError();
  EXPECT_EQ(several.kind, Kind::ambiguous);
  EXPECT_THAT(several.what, AllOf(HasSubstr("several"), HasSubstr("PB-0001"), HasSubstr("1-1"), HasSubstr("PB-0002"),
                                  HasSubstr("1-2.4")));
}

TEST_F(Finding, TellsTwinsApartByTheirPlace) {
  auto twin = kSecond;
  twin.serial_number = kFirst.serial_number;
  bus_->plug(kFirst);
  bus_->plug(twin);
  EXPECT_EQ(openError("PB-0001").kind, Kind::ambiguous);
  EXPECT_EQ(ClaimedInterface::open(usb::kLink, "1-1").value()->device().address, 5);
}

TEST_F(Finding, NamesADeviceWithoutSerialNumberByItsPlace) {
  auto plain = kFirst;
  plain.serial_number.clear();
  bus_->plug(plain);
  EXPECT_EQ(find(usb::kLink).at(0).name(), "1-1");
}

TEST_F(Finding, NamesTheRuleWhereThereIsNoPermission) {
  bus_->plug(kFirst);
  EXPECT_EQ(accessTo(find(usb::kLink).at(0)), Access::free);
  bus_->setMode("1-1", 0);
  const AsNobody nobody;
  const auto error = openError("PB-0001");
  EXPECT_EQ(error.kind, Kind::no_permission);
  EXPECT_THAT(error.what, AllOf(HasSubstr("usb:PB-0001"), HasSubstr("no permission"), HasSubstr("/dev/bus/usb/001/005"),
                                HasSubstr("70-probebox.rules")));
  EXPECT_EQ(accessTo(find(usb::kLink).at(0)), Access::no_permission);
}

TEST_F(Finding, NamesWhoHasTheInterface) {
  bus_->plug(kFirst);
  bus_->plug(kSecond);
  bus_->claimElsewhere("1-1", "usbfs");
  bus_->claimElsewhere("1-2.4", "cdc_acm");
  const auto program = openError("PB-0001");
  EXPECT_EQ(program.kind, Kind::busy);
  EXPECT_THAT(program.what, AllOf(HasSubstr("usb:PB-0001"), HasSubstr("in use"), HasSubstr("that program")));
  EXPECT_THAT(openError("PB-0002").what, testing::AllOf(HasSubstr("kernel's"), HasSubstr("cdc_acm")));
  for (const auto& box : find(usb::kLink)) EXPECT_EQ(accessTo(box), Access::busy) << box.path;
}

TEST_F(Finding, EmptiesTheDeviceWhenItIsClaimedAndGivesItBack) {
  bus_->plug(kFirst);
  bus_->send("1-1", MockBus::kDataIn, pattern(100));
  {
    const auto opened = ClaimedInterface::open(usb::kLink, "");
    ASSERT_TRUE(opened.ok());
    EXPECT_TRUE(bus_->claimed("1-1"));
    EXPECT_EQ(bus_->resets("1-1"), 1U);
  }
  EXPECT_FALSE(bus_->claimed("1-1"));
}

TEST_F(Finding, OpensAndClosesWithoutLeavingADescriptorBehind) {
  bus_->plug(kFirst);
  const auto next_descriptor = [] {
    const int descriptor = ::dup(0);
    ::close(descriptor);
    return descriptor;
  };
  ASSERT_TRUE(ClaimedInterface::open(usb::kLink, "").ok());
  const int before = next_descriptor();
  for (int i = 0; i < 20; ++i) ASSERT_TRUE(ClaimedInterface::open(usb::kLink, "").ok());
  EXPECT_EQ(next_descriptor(), before);
}

}  // namespace
}  // namespace probebox::usb_host
