#include <filesystem>
#include <fstream>
#include <grp.h>
#include <set>
#include <signal.h>
#include <sys/stat.h>

#include "box_on_a_bus.hpp"
#include "drivers/usb_host/hot_plug.hpp"
#include "host-tests/host/test_host.hpp"
#include "host_command.hpp"
#include "udev_daemon.hpp"

// The PC's side of USB on a real kernel: libusb, usbfs, udev, and a box that is a real gadget.
namespace probebox::vm {
namespace {

using namespace std::chrono_literals;
using testing::AllOf;
using testing::ContainsRegex;
using testing::HasSubstr;

bool belongsToPlugdev(const std::string& node) {
  struct stat status {};
  const auto* plugdev = ::getgrnam("plugdev");
  return ::stat(node.c_str(), &status) == 0 && plugdev != nullptr && status.st_gid == plugdev->gr_gid &&
         (status.st_mode & 0777U) == 0660U;
}

std::string outputOf(const std::string& command) {
  std::string text;
  FILE* const pipe = ::popen(command.c_str(), "r");
  for (int c = std::fgetc(pipe); c != EOF; c = std::fgetc(pipe)) text += static_cast<char>(c);
  ::pclose(pipe);
  return text;
}

// With a `probebox record` at work.
class Recording : public BoxOnABus {
 protected:
  static std::string file() { return "/tmp/scans/scan.pbx"; }
  static bool grownBeyond(std::uintmax_t bytes) {
    return eventually([bytes] {
      std::error_code absent;
      const auto size = std::filesystem::file_size(file(), absent);
      return !absent && size > bytes;
    });
  }
  // `record`, which has begun and goes on until it is told to end.
  static std::unique_ptr<HostCommand> begun(HostUser user) {
    std::filesystem::create_directories("/tmp/scans");
    std::filesystem::permissions("/tmp/scans", std::filesystem::perms::all);
    std::filesystem::remove(file());
    auto command = std::make_unique<HostCommand>(
        user, std::vector<std::string>{"-u", kUri, "--json", "record", "-o", file(), "--patience", "300"});
    EXPECT_TRUE(grownBeyond(20'000)) << command->err();
    return command;
  }
  // After some more samples and Ctrl-C: what it has to say about all of them.
  static nlohmann::json summary(HostCommand& command) {
    EXPECT_TRUE(grownBeyond(std::filesystem::file_size(file()) + 20'000)) << command.err();
    command.signal(SIGINT);
    EXPECT_EQ(command.status(), 130) << command.err();
    auto sums = command.objects().at(0);
    EXPECT_TRUE(sums["balanced"]) << sums;
    EXPECT_TRUE(sums["end_known"]) << sums;
    return sums;
  }
};

class Permission : public Recording {};

TEST_F(Permission, WithoutTheRuleIsMissingAndTheRuleIsNamed) {
  for (const std::vector<std::string>& command : {std::vector<std::string>{"info"}, {"watch"}, {"list"}}) {
    std::vector<std::string> arguments{"-u", kUri, "--json"};
    arguments.insert(arguments.end(), command.begin(), command.end());
    const auto told = tell(HostUser::member_of_plugdev, arguments);
    EXPECT_EQ(told.status, 3);
    ASSERT_EQ(told.objects.size(), 1U);
    EXPECT_EQ(told.objects[0]["error"], "no-permission");
    EXPECT_THAT(told.err, HasSubstr("70-probebox.rules"));
  }
  const auto list = tell(HostUser::member_of_plugdev, {"list", "--json"});
  EXPECT_EQ(list.objects.at(0)["boxes"].at(0)["state"], "no permission");
}

TEST_F(Permission, IsGivenByTheRuleToThoseWhomItIsFor) {
  const UdevDaemon udev{HOST_RULE};
  replug();
  ASSERT_TRUE(eventually([] { return belongsToPlugdev(node()); }));
  const auto info = tell(HostUser::member_of_plugdev, {"-u", kUri, "--json", "info"});
  EXPECT_EQ(info.status, 0) << info.err;
  EXPECT_EQ(info.objects.at(0)["serial_number"], "SIM-0001");
  const auto stranger = tell(HostUser::stranger, {"-u", kUri, "--json", "info"});
  EXPECT_EQ(stranger.status, 3);
  EXPECT_EQ(stranger.objects.at(0)["error"], "no-permission");
  EXPECT_THAT(stranger.err, HasSubstr("plugdev")) << "the rule is there: it need not be copied";
  const auto properties = outputOf("udevadm info -q property -n " + node());
  EXPECT_THAT(properties, AllOf(ContainsRegex("CURRENT_TAGS=.*:uaccess:"), HasSubstr("ID_MM_DEVICE_IGNORE=1")));
}

// Between the device and its rights lies a moment in which it may not be opened.
TEST_F(Permission, ComesBackAfterAReplugBeforeARecordingGivesUp) {
  const UdevDaemon udev{HOST_RULE};
  replug();
  ASSERT_TRUE(eventually([] { return belongsToPlugdev(node()); }));
  const auto command = begun(HostUser::member_of_plugdev);
  replug();
  ASSERT_TRUE(eventually([&] { return command->err().find("is back") != std::string::npos; })) << command->err();
  const auto sums = summary(*command);
  EXPECT_EQ(sums["reconnections"], 1) << command->err();
  EXPECT_EQ(sums["produced_samples"], sums["received_samples"]) << sums;
}

class HotPlugging : public BoxOnABus, public testing::WithParamInterface<usb_host::HotPlug::News> {};

TEST_P(HotPlugging, TellsEachPlugOnceAndInOrder) {
  using usb_host::PlugEvent;
  const bool told = GetParam() == usb_host::HotPlug::News::told;
  const auto udev = told ? std::make_unique<UdevDaemon>(HOST_RULE) : nullptr;
  EXPECT_EQ(usb_host::HotPlug::possibleHere(), GetParam());
  auto plug = usb_host::HotPlug::watch(usb::kLink);
  ASSERT_TRUE(plug.ok()) << plug.error().what;
  std::vector<PlugEvent> events;
  const auto expect = [&](PlugEvent::Kind kind, std::size_t count) {
    EXPECT_TRUE(eventually([&] {
      for (auto& event : (*plug)->poll()) events.push_back(std::move(event));
      return events.size() >= count;
    }));
    ASSERT_EQ(events.size(), count);
    EXPECT_EQ(events.back().kind, kind);
    EXPECT_EQ(events.back().device.serial_number, "SIM-0001");
  };
  expect(PlugEvent::Kind::arrived, 1);
  std::set<std::uint8_t> addresses{events.back().device.address};
  for (std::size_t cycle = 1; cycle <= 3; ++cycle) {
    gadget_->unbind();
    expect(PlugEvent::Kind::left, 2 * cycle);
    gadget_->bind();
    expect(PlugEvent::Kind::arrived, 2 * cycle + 1);
    addresses.insert(events.back().device.address);
  }
  EXPECT_EQ(addresses.size(), 4U);
  EXPECT_TRUE((*plug)->poll().empty());
}

INSTANTIATE_TEST_SUITE_P(Both, HotPlugging,
                         testing::Values(usb_host::HotPlug::News::told, usb_host::HotPlug::News::looked_for),
                         [](const auto& news) {
                           return news.param == usb_host::HotPlug::News::told ? "Told" : "LookedFor";
                         });

TEST_F(Recording, KeepsTheBoxForItsHostAndNamesItToTheNext) {
  const auto first = begun(HostUser::root);
  const auto told = tell(HostUser::root, {"-u", kUri, "--json", "info"});
  EXPECT_EQ(told.status, 3);
  EXPECT_EQ(told.objects.at(0)["error"], "busy");
  EXPECT_THAT(told.err, HasSubstr("in use by probebox (process " + std::to_string(first->pid()) + ")"));
  const auto list = tell(HostUser::root, {"list", "--json"});
  EXPECT_EQ(list.objects.at(0)["boxes"].at(0)["state"], "busy");
  const auto sums = summary(*first);
  EXPECT_EQ(sums["reconnections"], 0) << "who asked in vain has disturbed nothing";
  EXPECT_EQ(sums["produced_samples"], sums["received_samples"]) << sums;
  EXPECT_EQ(tell(HostUser::root, {"-u", kUri, "--json", "info"}).status, 0);
}

TEST_F(BoxOnABus, BeginsWithAnEmptyLineWhateverTheLastHostLeft) {
  for (int i = 0; i < 3; ++i) {
    {
      support::Balances samples;
      const auto careless = support::TestHost::connect(kUri, &samples);
      ASSERT_NE(careless, nullptr);
      careless->client().start({});
      ASSERT_TRUE(careless->eventually([&] { return samples.samples > 0; }));
      careless->client().ask<messages::Status>({});
      std::this_thread::sleep_for(200ms);  // samples and an answer wait for a host that never reads them
    }
    const auto next = support::TestHost::connect(kUri);
    ASSERT_NE(next, nullptr);
    EXPECT_EQ(next->ask<messages::Status>().board, "sim");
    const auto& counters = next->client().reader().counters();
    EXPECT_EQ(counters.bad(), 0U) << "nothing of one host reaches the next";
    EXPECT_EQ(counters.discarded_bytes, 0U);
  }
}

}  // namespace
}  // namespace probebox::vm
