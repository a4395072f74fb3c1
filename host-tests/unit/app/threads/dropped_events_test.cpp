#include "firmware/app/threads/dropped_events.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <vector>

namespace probebox::app {
namespace {

// A queue with room for so many events.
class SmallQueue {
 public:
  void makeRoom(std::size_t events) { room_ += events; }
  // As the capture thread does it.
  void push(const Event& event) {
    const auto take = [this](const Event& one) {
      if (taken.size() == room_) return false;
      taken.push_back(one);
      return true;
    };
    if (!(dropped_.report(take, monoTime(1000)) && take(event)) && !dropped_.keep(event)) ++lost;
  }

  std::vector<Event> taken;
  int lost{};

 private:
  DroppedEvents dropped_;
  std::size_t room_{};
};

Edge inhibit(std::uint8_t line, Level level, std::uint32_t sequence) {
  return {.role = LineRole::inhibit, .line = line, .level = level, .line_sequence = sequence, .at = monoTime(sequence)};
}

TEST(DroppedEvents, TellHowManySamplesWereLostBeforeTheNextOne) {
  SmallQueue queue;
  queue.push(Count{.sequence = 1});
  queue.push(Count{.sequence = 2});
  queue.makeRoom(2);
  queue.push(Count{.sequence = 3});
  ASSERT_EQ(queue.taken.size(), 2U);
  EXPECT_EQ(std::get<SourceLost>(queue.taken[0]).source, Source::queue);
  EXPECT_EQ(std::get<SourceLost>(queue.taken[0]).lost, 2U);
  EXPECT_EQ(std::get<Count>(queue.taken[1]).sequence, 3U);
  EXPECT_EQ(queue.lost, 2);
}

TEST(DroppedEvents, KeepTheLossesOfSourcesBySourceReasonAndAxes) {
  SmallQueue queue;
  const auto lose = [&queue](Source source, LossReason reason, std::uint8_t axes) {
    queue.push(SourceLost{source, reason, 2, monoTime(7), axes});
  };
  lose(Source::encoders, LossReason::overrun, axisBit(Axis::x));
  lose(Source::encoders, LossReason::overrun, axisBit(Axis::z));
  lose(Source::encoders, LossReason::disconnected, axisBit(Axis::y));
  lose(Source::probe, LossReason::disconnected, 0);
  lose(Source::drift, LossReason::taken, axisBit(Axis::x));
  lose(Source::drift, LossReason::taken, 0);
  queue.push(CountedAxes{.axes = 7, .faults = axisBit(Axis::y)});  // a receiver's counter tells its faults once
  queue.makeRoom(3);
  queue.push(Count{.sequence = 1});
  queue.makeRoom(3);
  queue.push(Count{.sequence = 2});
  ASSERT_EQ(queue.taken.size(), 6U);
  EXPECT_EQ(std::get<SourceLost>(queue.taken[0]).source, Source::queue);
  const auto is = [](Source source, LossReason reason, std::uint8_t axes, std::uint32_t lost) {
    return testing::Truly([=](const Event& event) {
      const auto* const told = std::get_if<SourceLost>(&event);
      return told != nullptr && told->source == source && told->reason == reason && told->axes == axes &&
             told->lost == lost;
    });
  };
  using testing::Contains;
  EXPECT_THAT(queue.taken, Contains(is(Source::encoders, LossReason::overrun, 7, 4)));
  EXPECT_THAT(queue.taken, Contains(is(Source::encoders, LossReason::disconnected, axisBit(Axis::y), 2)));
  EXPECT_THAT(queue.taken, Contains(is(Source::probe, LossReason::disconnected, 0, 2)));
  EXPECT_THAT(queue.taken, Contains(is(Source::drift, LossReason::taken, 0, 4)));
}

TEST(DroppedEvents, KeepTheLevelOfEachInhibitLine) {
  SmallQueue queue;
  queue.push(inhibit(0, Level::active, 1));
  queue.push(inhibit(3, Level::active, 1));
  queue.push(inhibit(3, Level::inactive, 2));
  queue.makeRoom(4);
  queue.push(Count{.sequence = 9});
  ASSERT_EQ(queue.taken.size(), 4U);
  EXPECT_EQ(std::get<SourceLost>(queue.taken[0]).lost, 1U) << "the edge before the last of its line";
  EXPECT_EQ(std::get<Edge>(queue.taken[1]).line, 0);
  EXPECT_EQ(std::get<Edge>(queue.taken[1]).level, Level::active);
  EXPECT_EQ(std::get<Edge>(queue.taken[2]).line, 3);
  EXPECT_EQ(std::get<Edge>(queue.taken[2]).level, Level::inactive);
  EXPECT_EQ(std::get<Edge>(queue.taken[2]).line_sequence, 2U);
  EXPECT_EQ(std::get<Count>(queue.taken[3]).sequence, 9U);
  queue.makeRoom(1);
  queue.push(Count{.sequence = 10});
  EXPECT_EQ(queue.taken.size(), 5U) << "each is told once";
  EXPECT_EQ(queue.lost, 1);
}

}  // namespace
}  // namespace probebox::app
