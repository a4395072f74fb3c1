#include "box_on_usb.hpp"
#include "drivers/io/rendezvous.hpp"

namespace probebox::command {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

const MockBus::Device kOther{.path = "1-2", .address = 9, .serial_number = "PB-0002"};
const MockBus::Device kThird{.path = "1-3", .address = 10, .serial_number = "PB-0003"};

class Reaching : public BoxOnUsb {};

TEST_F(Reaching, ABoxByItsSerialNumberItsPlaceOrBecauseItIsTheOnlyOne) {
  for (const auto* uri : {"usb:PB-0001", "usb:1-1", "usb", "usb:"}) {
    const auto info = probebox({"-u", uri, "info", "--json"});
    EXPECT_EQ(info.status, 0) << uri << info.err;
    EXPECT_EQ(info.object()["serial_number"], "F-0001") << uri;
  }
}

TEST_F(Reaching, WithoutAUriTakesTheOneOnUsb) {
  EXPECT_EQ(probebox({"info"}).status, 0);
  bus_->plug(kOther);
  const auto several = probebox({"info"});
  EXPECT_EQ(several.status, 2);
  EXPECT_THAT(several.err, AllOf(HasSubstr("-u"), HasSubstr("usb:PB-0001"), HasSubstr("usb:PB-0002")));
}

TEST_F(Reaching, CountsABoxOfThisComputerThatIsOnUsbAsWellOnce) {
  const FakeBox over_tcp;
  ASSERT_TRUE(io::rendezvous::announce(::getpid(), {over_tcp.uri(), "usb:PB-0001"}));
  EXPECT_EQ(probebox({"info"}).status, 0);
  ASSERT_TRUE(io::rendezvous::announce(::getpid(), {over_tcp.uri()}));
  EXPECT_EQ(probebox({"info"}).status, 2);
}

TEST_F(Reaching, NamesWhatIsThereInsteadOfAnAbsentBox) {
  const auto failed = probebox({"-u", "usb:PB-0009", "status", "--json"});
  EXPECT_EQ(failed.status, 3);
  EXPECT_EQ(failed.object()["error"], "no-box");
  EXPECT_THAT(failed.err, AllOf(HasSubstr("PB-0009"), HasSubstr("PB-0001"), HasSubstr("1-1")));
}

TEST_F(Reaching, AsksWhichOfSeveralIsMeant) {
  bus_->plug(kOther);
  const auto failed = probebox({"-u", "usb", "status", "--json"});
  EXPECT_EQ(failed.status, 2);
  EXPECT_THAT(failed.err, AllOf(HasSubstr("PB-0001"), HasSubstr("1-1"), HasSubstr("PB-0002"), HasSubstr("1-2")));
  EXPECT_EQ(probebox({"-u", "usb:PB-0001", "status"}).status, 0);
}

// Every command that needs a box says in both forms why it cannot have it.
class Withheld : public BoxOnUsb, public testing::WithParamInterface<std::vector<std::string>> {
 protected:
  Finished run() const {
    std::vector<std::string> arguments{"-u", "usb:PB-0001", "--json"};
    for (const auto& word : GetParam()) arguments.push_back(word == "FILE" ? directory_.file("scan.pbx") : word);
    return probebox(arguments);
  }
};

TEST_P(Withheld, WithoutPermissionNamesTheRule) {
  bus_->setMode("1-1", 0);
  const AsNobody nobody;
  const auto failed = run();
  EXPECT_EQ(failed.status, 3);
  EXPECT_EQ(failed.object()["error"], "no-permission");
  EXPECT_EQ(failed.object()["exit_status"], 3);
  EXPECT_THAT(failed.object()["what"].get<std::string>(), HasSubstr("70-probebox.rules"));
  EXPECT_THAT(failed.err, AllOf(HasSubstr("usb:PB-0001"), HasSubstr("70-probebox.rules")));
}

TEST_P(Withheld, WhileBusyNamesWhoHasIt) {
  bus_->claimElsewhere("1-1", "usbfs");
  const auto failed = run();
  EXPECT_EQ(failed.status, 3);
  EXPECT_EQ(failed.object()["error"], "busy");
  EXPECT_THAT(failed.err, AllOf(HasSubstr("usb:PB-0001"), HasSubstr("another program")));
}

INSTANTIATE_TEST_SUITE_P(EveryCommand, Withheld,
                         testing::Values(std::vector<std::string>{"info"}, std::vector<std::string>{"status"},
                                         std::vector<std::string>{"list"}, std::vector<std::string>{"watch"},
                                         std::vector<std::string>{"record", "-o", "FILE"},
                                         std::vector<std::string>{"calibrate"}, std::vector<std::string>{"corrections"},
                                         std::vector<std::string>{"accept", "17", "--by", "Ada"}),
                         [](const auto& command) { return command.param.front(); });

class Listing : public BoxOnUsb {
 protected:
  static nlohmann::ordered_json entry(const nlohmann::ordered_json& list, const std::string& uri) {
    for (const auto& box : list["boxes"]) {
      if (box["uri"] == uri) return box;
    }
    return {};
  }
};

TEST_F(Listing, ShowsFreeBusyAndForbiddenBoxesWithTheRemedy) {
  bus_->plug(kOther);
  bus_->plug(kThird);
  bus_->claimElsewhere("1-2", "usbfs");
  bus_->setMode("1-1", 0777);
  bus_->setMode("1-2", 0777);
  bus_->setMode("1-3", 0);
  const AsNobody nobody;
  const auto table = probebox({"list"});
  EXPECT_EQ(table.status, 0) << table.err;
  EXPECT_THAT(table.out, testing::ContainsRegex("usb:PB-0001 .*F-0001 .*test mill.* locked +free"));
  EXPECT_THAT(table.out, testing::ContainsRegex("usb:PB-0002 +probebox +PB-0002 .*busy"));
  EXPECT_THAT(table.out, testing::ContainsRegex("usb:PB-0003 +probebox +PB-0003 .*no permission"));
  EXPECT_THAT(table.err,
              AllOf(HasSubstr("usb:PB-0002"), HasSubstr("in use"), HasSubstr("permission"),
                    HasSubstr("/dev/bus/usb/001/010"), HasSubstr("70-probebox.rules"), Not(HasSubstr("PB-0001"))));

  const auto list = probebox({"list", "--json"}).object();
  EXPECT_EQ(entry(list, "usb:PB-0001")["state"], "free");
  EXPECT_EQ(entry(list, "usb:PB-0001")["machine"], "test mill");
  EXPECT_EQ(entry(list, "usb:PB-0002")["state"], "busy");
  EXPECT_EQ(entry(list, "usb:PB-0003")["state"], "no permission");
  EXPECT_THAT(entry(list, "usb:PB-0003")["what"].get<std::string>(), HasSubstr("70-probebox.rules"));
}

TEST_F(Listing, ShowsABoxThatDoesNotAnswer) {
  bus_->plug(kOther);  // nobody plays its firmware
  const auto table = probebox({"list", "--timeout", "0.1"});
  EXPECT_THAT(table.out, testing::ContainsRegex("usb:PB-0002 .*silent"));
  EXPECT_THAT(table.err, AllOf(HasSubstr("usb:PB-0002"), HasSubstr("not answer")));
}

}  // namespace
}  // namespace probebox::command
