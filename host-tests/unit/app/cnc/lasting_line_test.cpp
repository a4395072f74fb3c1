#include "firmware/app/cnc/lasting_line.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace probebox::app {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::HasSubstr;

class SilentPipe : public io::BytePipe {
 public:
  io::Transfer read(std::span<std::byte>) override { return {0, io::PipeState::open}; }
  io::Transfer write(std::span<const std::byte> from) override { return {from.size(), io::PipeState::open}; }
  int descriptor() const override { return -1; }
  std::string_view name() const override { return "silent"; }
};

class Line : public testing::Test {
 protected:
  // Pauses until the line is open.
  std::vector<std::chrono::milliseconds> untilOpen() {
    std::vector<std::chrono::milliseconds> pauses;
    while (!line_.opened() && pauses.size() < 100) pauses.push_back(line_.pause());
    return pauses;
  }

  bool is_there_{true};
  std::vector<std::string> reports_;
  LastingLine line_{"/dev/ttyS1",
                    [this]() -> Outcome<std::unique_ptr<io::BytePipe>> {
                      if (!is_there_) return Error{"there is no such line"};
                      return std::unique_ptr<io::BytePipe>{std::make_unique<SilentPipe>()};
                    },
                    [this](const std::string& text) { reports_.push_back(text); }};
};

TEST_F(Line, ThatIsThereIsOpenedAtOnceAndWithoutAWord) {
  EXPECT_THAT(untilOpen(), ElementsAre());
  EXPECT_NE(line_.pipe(), nullptr);
  EXPECT_THAT(reports_, ElementsAre());
}

TEST_F(Line, ThatIsAbsentIsSaidOnceAndTriedAtGrowingPauses) {
  is_there_ = false;
  for (const auto pause : {50ms, 100ms, 200ms, 400ms, 800ms, 1600ms, 2000ms, 2000ms}) {
    ASSERT_FALSE(line_.opened());
    EXPECT_EQ(line_.pause(), pause);
  }
  is_there_ = true;
  EXPECT_TRUE(line_.opened());
  EXPECT_THAT(reports_, ElementsAre(HasSubstr("trying again"), HasSubstr("is back")));
  EXPECT_EQ(line_.reopened(), 1U);
}

// A device that can be opened and hangs up at once, such as a USB port without a cable, must not keep a core busy.
TEST_F(Line, ThatIsClosedAsSoonAsItOpensIsTriedAtGrowingPausesToo) {
  ASSERT_TRUE(line_.opened());
  for (const auto pause : {50ms, 100ms, 200ms, 400ms, 800ms, 1600ms, 2000ms, 2000ms}) {
    line_.lost();
    EXPECT_THAT(untilOpen(), ElementsAre(pause));
  }
  line_.heard();
  line_.lost();
  EXPECT_THAT(untilOpen(), ElementsAre(50ms)) << "it had really come back";
}

TEST_F(Line, IsServedUntilTheEnd) {
  int served = 0;
  line_.run([&] {
    if (++served == 3) line_.stop();
  });
  EXPECT_EQ(served, 3);
  EXPECT_EQ(line_.rounds(), 3U);
  EXPECT_EQ(line_.pipe(), nullptr);
}

}  // namespace
}  // namespace probebox::app
