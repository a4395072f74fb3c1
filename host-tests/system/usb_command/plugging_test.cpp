#include <atomic>
#include <chrono>
#include <filesystem>
#include <functional>
#include <thread>

#include "box_on_usb.hpp"

namespace probebox::command {
namespace {

using namespace std::chrono_literals;
using testing::AllOf;
using testing::HasSubstr;

// A command that goes on by itself in front of a box whose cable is pulled.
class Plugging : public BoxOnUsb {
 protected:
  // What a person does while the command runs. Every wait of the person ends when the command ends.
  Finished while_(const std::function<void()>& person, std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"-u", "usb"});
    std::jthread hands{person};
    auto finished = probebox(arguments, {}, &interrupted_);
    over_ = true;
    return finished;
  }

  void waitUntil(const std::function<bool()>& true_now) const {
    while (!over_ && !true_now()) std::this_thread::sleep_for(5ms);
  }
  void waitForContent() const {
    waitUntil([this] {
      std::error_code absent;
      const auto size = std::filesystem::file_size(file_, absent);
      return !absent && size > 20'000;
    });
  }
  void waitForAHost() const {
    waitUntil([this] { return box_->streaming(); });
    std::this_thread::sleep_for(300ms);  // some samples
  }
  // Returns when the box has no host any more: the next one comes after the cable is back.
  void pull() {
    unplug();
    waitUntil([this] { return !box_->streaming(); });
  }

  std::string file_ = directory_.file("scan.pbx");
  std::atomic<bool> interrupted_{};
  std::atomic<bool> over_{};
};

TEST_F(Plugging, ARecordingResumesAfterTheLastSample) {
  const auto replug_twice = [this] {
    waitForContent();
    for (int i = 0; i < 2; ++i) {
      pull();
      plugIn();
      waitForAHost();
    }
    interrupted_ = true;
  };
  const auto recorded = while_(replug_twice, {"record", "-o", file_, "--json"});
  EXPECT_EQ(recorded.status, 130) << recorded.err << recorded.out;
  const auto sums = recorded.object();
  EXPECT_EQ(sums["reconnections"], 2);
  EXPECT_TRUE(sums["balanced"]);
  EXPECT_TRUE(sums["end_known"]);
  EXPECT_EQ(sums["produced_samples"], sums["received_samples"]) << "the box keeps the last seconds";
  EXPECT_THAT(recorded.err, AllOf(HasSubstr("waiting"), HasSubstr("usb:PB-0001"),
                                  testing::ContainsRegex("usb:PB-0001 is back, resuming at sample [0-9]+")));
  const auto exported = probebox({"export", file_, "-o", directory_.file("scan.csv"), "--json"});
  EXPECT_EQ(exported.object()["rows"], sums["received_samples"]) << "repeated samples have one row";
  EXPECT_EQ(exported.object()["missing_samples"], 0);
}

TEST_F(Plugging, WatchSaysWhatHappensAndKeepsTheAccount) {
  const auto replug = [this] {
    waitForAHost();
    pull();
    plugIn();
    waitForAHost();
    interrupted_ = true;
  };
  const auto watched = while_(replug, {"watch", "--json"});
  EXPECT_EQ(watched.status, 130) << watched.err;
  std::vector<std::string> events;
  std::uint64_t produced = 0;
  for (const auto& object : watched.objects()) {
    if (object.contains("event")) {
      events.push_back(object["event"]);
      continue;
    }
    const auto& ledger = object["ledger"];
    EXPECT_TRUE(ledger["balanced"]);
    EXPECT_EQ(ledger["produced_samples"], ledger["received_samples"]);
    EXPECT_GE(ledger["produced_samples"].get<std::uint64_t>(), produced) << "one account over all links";
    produced = ledger["produced_samples"];
  }
  EXPECT_THAT(events, testing::ElementsAre("link-lost", "link-restored"));
  EXPECT_EQ(watched.objects().back()["reconnections"], 1);
  EXPECT_THAT(watched.err, AllOf(HasSubstr("usb:PB-0001"), HasSubstr("back")));
}

TEST_F(Plugging, GivesUpWhenPatienceIsOver) {
  const auto unplug_it = [this] {
    waitForContent();
    unplug();
  };
  const auto recorded = while_(unplug_it, {"record", "-o", file_, "--patience", "0.3", "--json"});
  EXPECT_EQ(recorded.status, 3);
  const auto objects = recorded.objects();
  ASSERT_EQ(objects.size(), 2U);
  EXPECT_FALSE(objects[0]["end_known"]);
  EXPECT_TRUE(objects[0]["balanced"]) << "as of the last heartbeat";
  EXPECT_EQ(objects[1]["error"], "link-lost");
  EXPECT_EQ(probebox({"export", file_, "-o", "-"}).status, 1) << "what came last is unknown";
}

TEST_F(Plugging, TellsWhatKeepsItFromABoxThatIsBack) {
  const auto replug_for_somebody_else = [this] {
    waitForContent();
    unplug();
    device_.held_by = "usbfs";
    plugIn();
  };
  const auto recorded = while_(replug_for_somebody_else, {"record", "-o", file_, "--patience", "4"});
  EXPECT_EQ(recorded.status, 3);
  const std::string obstacle = "usb:PB-0001: in use by another program";
  EXPECT_THAT(recorded.err, HasSubstr("probebox: " + obstacle)) << "while it waits";
  EXPECT_THAT(recorded.err, testing::ContainsRegex("lost for good: .*; then " + obstacle));
}

TEST_F(Plugging, ReconnectsToTheSameBoxAndToNoOther) {
  const auto exchange = [this] {
    waitForContent();
    unplug();
    bus_->plug({.path = "1-1", .address = 77, .serial_number = "PB-0002"});
  };
  const auto recorded = while_(exchange, {"record", "-o", file_, "--patience", "0.5", "--json"});
  EXPECT_EQ(recorded.status, 3);
  EXPECT_EQ(recorded.objects()[0]["reconnections"], 0);
}

TEST_F(Plugging, ListShowsBoxesComingAndGoing) {
  static constexpr auto kNoticed = 3s;  // the command looks every 500 ms
  const auto hands = [this] {
    std::this_thread::sleep_for(300ms);
    bus_->plug({.path = "1-2", .address = 9, .serial_number = "PB-0002"});
    std::this_thread::sleep_for(kNoticed);
    bus_->claimElsewhere("1-2", "usbfs");
    std::this_thread::sleep_for(kNoticed);
    unplug();
    std::this_thread::sleep_for(kNoticed);
    interrupted_ = true;
  };
  const auto listed = while_(hands, {"list", "--watch", "--json"});
  EXPECT_EQ(listed.status, 130) << listed.err;
  std::vector<nlohmann::ordered_json> first, second;
  for (const auto& object : listed.objects()) (object["uri"] == "usb:PB-0001" ? first : second).push_back(object);
  // Without udev its node may be seen to go, as a change, before it is seen to have left the bus.
  ASSERT_GE(first.size(), 2U);
  EXPECT_EQ(first.front()["event"], "arrived");
  EXPECT_EQ(first.front()["serial_number"], "PB-0001");
  EXPECT_EQ(first.back()["event"], "left");
  ASSERT_EQ(second.size(), 2U);
  EXPECT_EQ(second[0]["event"], "arrived");
  EXPECT_EQ(second[0]["uri"], "usb:PB-0002");
  EXPECT_EQ(second[0]["state"], "free");
  EXPECT_EQ(second[1]["event"], "changed");
  EXPECT_EQ(second[1]["state"], "busy");
  EXPECT_THAT(second[1]["remedy"].get<std::string>(), HasSubstr("that program"));
  EXPECT_FALSE(bus_->claimed("1-2")) << "looking disturbs nobody";
  EXPECT_EQ(probebox({"-u", "usb", "list", "--watch", "--count", "1", "--json"}).objects().size(), 1U);
}

}  // namespace
}  // namespace probebox::command
