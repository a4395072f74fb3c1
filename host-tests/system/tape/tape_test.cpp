// The text callbacks at one end of an emulated cable, a control that prints and reads at the other.
#include <algorithm>
#include <array>
#include <fcntl.h>
#include <filesystem>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <mutex>
#include <optional>
#include <termios.h>
#include <thread>
#include <unistd.h>

#include "drivers/io/descriptor.hpp"
#include "drivers/serial/emulator.hpp"
#include "firmware/app/cnc/text_server.hpp"

namespace probebox::app {
namespace {

using testing::HasSubstr;

class TextOnCable : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("probebox-text-" + std::to_string(getpid()));
    std::filesystem::create_directories(folder_);
    auto cable = serial::EmulatedCable::open(folder_ / "box", folder_ / "cnc");
    ASSERT_TRUE(cable.ok()) << cable.error().what;
    cable_.emplace(std::move(cable).value());
    cable_thread_ = std::jthread{[this](const std::stop_token& stop) {
      while (!stop.stop_requested()) {
        const std::lock_guard lock{cable_mutex_};
        cable_->pump(std::chrono::milliseconds{2});
      }
    }};
    control_ = io::Descriptor{open((folder_ / "cnc").c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK)};
    ASSERT_GE(control_.get(), 0);
    termios raw{};
    tcgetattr(control_.get(), &raw);
    cfmakeraw(&raw);
    tcsetattr(control_.get(), TCSANOW, &raw);
  }

  void TearDown() override {
    if (server_) server_->stop();
    server_thread_ = {};
    cable_thread_ = {};
    cable_.reset();
    std::filesystem::remove_all(folder_);
  }

  // face: without the device, such as "tape:" and ",dialect=macro".
  void serve(const std::string& face, const std::string& settings = "") {
    auto options = parseTextOptions(face + (folder_ / "box").string() + settings);
    ASSERT_TRUE(options.has_value());
    ASSERT_TRUE(options->ok()) << options->error().what;
    server_ = std::make_unique<TextServer>(**options, callbacks());
    server_thread_ = std::jthread{[this] { server_->run(); }};
  }

  void print(std::string_view text) {
    while (!text.empty()) {
      const auto wrote = write(control_.get(), text.data(), text.size());
      if (wrote > 0) text.remove_prefix(static_cast<std::size_t>(wrote));
    }
  }
  // What has come until it contains the words; with a generous end.
  std::string heardUntil(const std::string& words) {
    for (int i = 0; i < 3000 && heard_.find(words) == std::string::npos; ++i) drain();
    return heard_;
  }
  void drain() {
    std::array<char, 1024> buffer{};
    const auto got = read(control_.get(), buffer.data(), buffer.size());
    if (got > 0)
      heard_.append(buffer.data(), static_cast<std::size_t>(got));
    else
      std::this_thread::sleep_for(std::chrono::milliseconds{5});
  }
  static bool eventually(const std::function<bool()>& condition) {
    for (int i = 0; i < 3000; ++i) {
      if (condition()) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds{5});
    }
    return false;
  }
  std::vector<Event> taken() {
    const std::lock_guard lock{mutex_};
    return taken_;
  }
  std::string reports() {
    const std::lock_guard lock{mutex_};
    return reports_;
  }
  void show(const published::Snapshot& snapshot) {
    const std::lock_guard lock{mutex_};
    snapshot_ = snapshot;
  }
  void onCable(const std::function<void(serial::EmulatedCable&)>& act) {
    const std::lock_guard lock{cable_mutex_};
    act(*cable_);
  }

  std::unique_ptr<TextServer> server_;
  std::string heard_;
  std::atomic<bool> refuses_{};
  std::atomic<int> positions_{};
  std::atomic<unsigned> served_{};  // sequence of the correction that was sent last

 private:
  TextServer::Callbacks callbacks() {
    return {.snapshot =
                [this] {
                  const std::lock_guard lock{mutex_};
                  return snapshot_;
                },
            .serves = [this](const published::Snapshot& snapshot) { served_ = snapshot.sequence; },
            .take = [this](const tape::Said& said) -> std::optional<Error> {
              if (refuses_) return Error{"no run waits for it"};
              const std::lock_guard lock{mutex_};
              taken_.insert(taken_.end(), said.begin(), said.end());
              return std::nullopt;
            },
            .run = [] { return 9U; },
            .report =
                [this](const std::string& text) {
                  const std::lock_guard lock{mutex_};
                  reports_ += text + "\n";
                },
            .reached = [this](const tape::Positions&) { ++positions_; }};
  }

  std::filesystem::path folder_;
  std::optional<serial::EmulatedCable> cable_;
  std::mutex cable_mutex_, mutex_;
  published::Snapshot snapshot_;
  std::vector<Event> taken_;
  std::string reports_;
  io::Descriptor control_;
  std::jthread cable_thread_, server_thread_;
};

published::Snapshot some() {
  published::Snapshot s;
  s.valid = true;
  s.correction_mm = {-0.0125, 0.25, 0};
  s.sequence = 42;
  return s;
}

TEST_F(TextOnCable, ARecordIsPolled) {
  show(some());
  serve("records:");
  print("STATUS\r\n");
  EXPECT_THAT(heardUntil("\n"), HasSubstr("X-0.0125 Y+0.2500 Z+0.0000 S1 N42 A0*"));
  server_->stop();
  EXPECT_EQ(server_->counters().sent, 1U) << "nothing but what was asked for";
}

TEST_F(TextOnCable, RecordsAreStreamedWithoutAsking) {
  show(some());
  serve("records:", ",every=20,baud=115200");
  ASSERT_TRUE(eventually([this] { return server_->counters().sent >= 5; }));
  heardUntil("N42");
  auto changed = some();
  changed.sequence = 43;
  show(changed);
  EXPECT_THAT(heardUntil("N43"), HasSubstr("N43"));
}

TEST_F(TextOnCable, AStreamBeginsWithOneRecordAndWaitsForTheNext) {
  show(some());
  serve("records:", ",every=60000,baud=115200");
  ASSERT_TRUE(eventually([this] { return server_->counters().sent >= 1; }));
  std::this_thread::sleep_for(std::chrono::milliseconds{200});
  EXPECT_EQ(server_->counters().sent, 1U);
}

TEST_F(TextOnCable, ATapeIsReadOnRequestAndByAReaderThatStarts) {
  show(some());
  serve("tape:", ",dialect=macro,first=600");
  print("CORRECTIONS\r\n");
  EXPECT_THAT(heardUntil("#604="), HasSubstr("%\r\n#600=1\r\n#601=42\r\n#602=-0.0125\r\n"));
  heard_.clear();
  print("\x11");
  EXPECT_THAT(heardUntil("#604="), HasSubstr("#602=-0.0125"));
}

// After the end of a box that decides where the joints stand.
TEST_F(TextOnCable, OnlyATextWithTheCorrectionCountsAsRead) {
  show(some());
  serve("tape:");
  for (const char* request : {"DELAY\r\n", "CENTRELINE\r\n"}) print(request);
  ASSERT_TRUE(eventually([this] { return server_->counters().sent == 2; }));
  EXPECT_EQ(served_, 0U);
  for (const char* request : {"CORRECTIONS\r\n", "ALL\r\n", "STATUS\r\n"}) {
    served_ = 0;
    print(request);
    EXPECT_TRUE(eventually([this] { return served_ == 42; })) << request;
  }
}

TEST_F(TextOnCable, LinesOfDprntBecomeMarkersOfThePresentRun) {
  show(some());
  serve("tape:");
  print("\x12%\r\nBEGIN   0*A    0.000*B    0.000*C   90.000*T   1*F  15.000\r\nEND   0\r\nX  1.5000\r\n%\r\n\x14");
  ASSERT_TRUE(eventually([this] { return taken().size() == 2 && positions_ == 1; }));
  EXPECT_EQ(std::get<Marker>(taken()[0]).procedure, 9U);
  EXPECT_EQ(std::get<Marker>(taken()[1]).phase, MarkerPhase::end);
  EXPECT_TRUE(eventually([this] { return server_->counters().answered == 3; }));
  EXPECT_EQ(server_->counters().sent, 0U) << "a control that prints does not listen";
}

TEST_F(TextOnCable, BadInputIsRefusedByNameAndWhatFollowsIsTaken) {
  serve("records:");
  print("BEGIN3 C\r\nHELLO\r\nCUT1\r\n");
  const auto heard = heardUntil("OK");
  EXPECT_THAT(heard, HasSubstr("ERR bad-number: "));
  EXPECT_THAT(heard, HasSubstr("ERR unknown-line: "));
  EXPECT_THAT(reports(), testing::AllOf(HasSubstr("'HELLO'"), HasSubstr("unknown-line")));
  EXPECT_EQ(server_->counters().refused, 2U);
}

// An adapter whose receiver stays on while it sends, or a control that repeats what it reads.
TEST_F(TextOnCable, ALineThatGivesEverythingBackIsAnsweredNoFurther) {
  show(some());
  const auto linesFor = [this](std::chrono::milliseconds time) {
    std::string all;
    for (const auto end = std::chrono::steady_clock::now() + time; std::chrono::steady_clock::now() < end;) {
      heard_.clear();
      drain();
      print(heard_);
      all += heard_;
    }
    return all;
  };
  serve("records:", ",every=100,baud=115200");
  print("HELLO\r\nCUT1\r\n");
  const auto all = linesFor(std::chrono::seconds{1});
  EXPECT_THAT(all, HasSubstr("ERR unknown-line"));
  EXPECT_THAT(all, HasSubstr("OK"));
  EXPECT_LE(std::ranges::count(all, '\n'), 25) << "a record every 100 ms, and an answer to each line";
  EXPECT_EQ(server_->counters().refused, 1U);
}

TEST_F(TextOnCable, ANoisyLineGetsAFewAnswersASecond) {
  serve("records:", ",baud=115200");
  std::string noise;
  for (int i = 0; i < 200; ++i) noise += "E?R x\r\n";
  print(noise);
  ASSERT_TRUE(eventually([this] { return server_->counters().refused == 200; }));
  print("CUT1\r\n");
  const auto heard = heardUntil("OK");
  EXPECT_THAT(heard, HasSubstr("ERR "));
  EXPECT_LE(std::ranges::count(heard, '\n'), 50) << "all of it within less than 4 s";
}

TEST_F(TextOnCable, WhatTheBoxDoesNotTakeIsRefused) {
  serve("records:");
  refuses_ = true;
  print("BEGIN3\r\n");
  EXPECT_THAT(heardUntil("\n"), HasSubstr("ERR not-now"));
}

TEST_F(TextOnCable, NothingIsSentWhileTheControlHoldsItBack) {
  show(some());
  serve("tape:");
  print(
      "\x13"
      "CORRECTIONS\r\n");
  ASSERT_TRUE(eventually([this] { return server_->counters().answered == 1; }));
  // Whoever sent in spite of XOFF has done it by now: one answer takes far less than the reply to the next request.
  print("STATUS\r\n");
  ASSERT_TRUE(eventually([this] { return server_->counters().answered == 2; }));
  for (int i = 0; i < 40; ++i) drain();
  EXPECT_EQ(heard_, "");
  EXPECT_EQ(server_->counters().sent, 0U);
  print("\x11");
  EXPECT_THAT(heardUntil("*"), HasSubstr("G90 G10 L2 P0 X-0.0125 Y0.2500 Z0.0000"));
}

// A program that asked while the line was held back, and was reset, leaves no tape for the next one.
TEST_F(TextOnCable, AnAnswerHasTheValuesOfTheMomentAtWhichItGoesOut) {
  show(some());
  serve("tape:", ",dialect=macro");
  print(
      "\x13"
      "CORRECTIONS\r\n");
  ASSERT_TRUE(eventually([this] { return server_->counters().answered == 1; }));
  auto changed = some();
  changed.sequence = 43;
  show(changed);
  EXPECT_NE(served_, 42U) << "it has not been sent";
  print("CORRECTIONS\r\n");
  ASSERT_TRUE(eventually([this] { return server_->counters().answered == 2; }));
  print("\x11");
  EXPECT_THAT(heardUntil("#502"), HasSubstr("#501=43"));
  heardUntil("#504");
  for (int i = 0; i < 60; ++i) drain();
  EXPECT_EQ(std::ranges::count(heard_, '%'), 2) << heard_;
  EXPECT_EQ(served_, 43U);
  EXPECT_EQ(server_->counters().unsent, 1U);
}

TEST_F(TextOnCable, AReaderThatWasStoppedBehindItsTapeStartsAgain) {
  show(some());
  serve("tape:", ",dialect=macro");
  for (int read = 1; read <= 3; ++read) {
    heard_.clear();
    print("\x11");
    ASSERT_TRUE(eventually([this] {
      drain();
      return std::ranges::count(heard_, '%') == 2;
    })) << heard_;
    for (int i = 0; i < 40; ++i) drain();  // on a cable without a rate it has come early
    print("\x13");
    for (int i = 0; i < 40; ++i) drain();
  }
}

TEST_F(TextOnCable, AControlStopsATapeThatIsUnderWay) {
  show(some());
  serve("tape:", ",reader=all,dialect=macro,baud=1200");
  print("\x11");
  heardUntil("#501");
  print("\x13");
  for (int i = 0; i < 20; ++i) drain();
  const auto held = heard_.size();
  for (int i = 0; i < 100; ++i) drain();  // half a second: sixty characters
  print("\x13");                          // as a control does for each character that still comes
  for (int i = 0; i < 20; ++i) drain();
  EXPECT_EQ(heard_.size(), held);
  EXPECT_EQ(std::ranges::count(heard_, '%'), 1) << heard_;
  print("\x11");
  EXPECT_TRUE(eventually([this] {
    drain();
    return std::ranges::count(heard_, '%') == 2;
  })) << heard_;
  for (int i = 0; i < 60; ++i) drain();
  EXPECT_EQ(std::ranges::count(heard_, '%'), 2) << "it was no request for another one";
}

TEST_F(TextOnCable, AStreamThatTheControlHeldBackGoesOnWithPresentValues) {
  show(some());
  serve("records:", ",every=20,baud=115200,flow=yes");
  heardUntil("N42");
  print("\x13");
  ASSERT_TRUE(eventually([this] { return server_->counters().unsent >= 5; }));
  auto changed = some();
  changed.sequence = 43;
  show(changed);
  heard_.clear();
  print("\x11");
  const auto heard = heardUntil("N43");
  std::size_t old = 0;
  for (auto at = heard.find("N42"); at != std::string::npos; at = heard.find("N42", at + 1)) ++old;
  EXPECT_LT(old, 50U) << "those under way; a queue would hold hundreds";
}

TEST_F(TextOnCable, ALineThatWasUnpluggedIsServedAgain) {
  show(some());
  serve("records:", ",every=20,baud=115200");
  heardUntil("N42");
  onCable([](auto& cable) { cable.unplug(serial::EmulatedCable::End::a); });
  ASSERT_TRUE(eventually([this] { return reports().find("the line was closed") != std::string::npos; }));
  onCable([](auto& cable) { ASSERT_TRUE(cable.plug(serial::EmulatedCable::End::a).ok()); });
  ASSERT_TRUE(eventually([this] { return server_->counters().reopened == 1; }));
  const auto before = server_->counters().sent;
  EXPECT_TRUE(eventually([&] { return server_->counters().sent > before; }));
}

}  // namespace
}  // namespace probebox::app
