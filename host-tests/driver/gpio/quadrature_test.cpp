#include "drivers/gpio/quadrature.hpp"

#include <array>
#include <cmath>
#include <gmock/gmock.h>
#include <memory>
#include <random>
#include <variant>
#include <vector>

#include "drivers/gpio/quadrature_emulator.hpp"
#include "host-tests/support/events_of.hpp"

// The counts of an encoder on two lines, from the edges that the kernel stamps.
namespace probebox::gpio {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

constexpr std::size_t kX = 0, kC = 5;

// An encoder, its lines, and what the source makes of them.
class Quadrature : public ::testing::Test {
 protected:
  void open(std::size_t axis = kX, double maximum_edge_rate_hz = 20'000, std::size_t queue = 1024) {
    auto lines = std::make_unique<EmulatedQuadrature>(queue);
    encoder = lines.get();
    source = std::make_unique<QuadratureSource>(
        std::move(lines),
        QuadratureConfig{.axis = axis, .interval = 1ms, .maximum_edge_rate_hz = maximum_edge_rate_hz});
    encoder->turnTo(0, now);
  }
  // Turns at constant speed, and reads every millisecond, as the capture thread does.
  void turn(std::int64_t to, Nanoseconds duration) {
    const std::int64_t from = at_count, steps = duration / 1ms;
    for (std::int64_t i = 1; i <= steps; ++i) {
      now += 1ms;
      encoder->turnTo(from + (to - from) * i / steps, now);
      read();
    }
    at_count = to;
  }
  void rest(Nanoseconds duration) { turn(at_count, duration); }
  void read() {
    std::array<Event, 7> batch;  // small, so that what has no room comes with the next call
    while (const std::size_t count = source->read(batch, now))
      events.insert(events.end(), batch.begin(), batch.begin() + static_cast<std::ptrdiff_t>(count));
  }
  template <class T>
  std::vector<T> all() const {
    return support::eventsOf<T>(events);
  }

  MonoTime now{monoTime(5'000'000'000)};
  std::int64_t at_count{};
  EmulatedQuadrature* encoder{};
  std::unique_ptr<QuadratureSource> source;
  std::vector<Event> events;
};

TEST_F(Quadrature, CountsUpAndDownAtEqualIntervals) {
  open();
  rest(10ms);
  turn(300, 100ms);
  turn(-200, 200ms);
  rest(10ms);
  const auto counts = all<Count>();
  ASSERT_GT(counts.size(), 300U);
  EXPECT_EQ(counts.back().counts, -200);
  std::int64_t highest = 0;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    highest = std::max(highest, counts[i].counts);
    EXPECT_EQ(counts[i].sequence, i);
    EXPECT_EQ(counts[i].at - counts[0].at, static_cast<std::int64_t>(i) * 1ms);
  }
  EXPECT_EQ(highest, 300);
  EXPECT_EQ(source->unusable(), 0U);
  EXPECT_TRUE(all<SourceLost>().empty());
}

// The count of a stamp is what the encoder showed then, to one count, wherever edges fell and however reads were cut.
TEST_F(Quadrature, GivesTheCountOfItsStamp) {
  open();
  rest(3ms);
  const MonoTime begin = now;
  turn(2500, 1000ms);
  for (const auto& count : all<Count>()) {
    if (count.at <= begin) continue;
    const double true_count = 2.5e-6 * static_cast<double>((count.at - begin).count());
    EXPECT_NEAR(static_cast<double>(count.counts), true_count, 1.001) << (count.at - begin).count();
  }
}

TEST_F(Quadrature, NamesARotaryAxisByItsOwnEvent) {
  open(kC);
  turn(40, 40ms);
  rest(5ms);
  ASSERT_FALSE(all<AngleCount>().empty());
  EXPECT_EQ(all<AngleCount>().back().axis, RotaryAxis::c);
  EXPECT_EQ(all<AngleCount>().back().counts, 40);
  EXPECT_TRUE(all<Count>().empty());
}

TEST_F(Quadrature, CountsTheOtherWayWithItsLinesExchanged) {
  open();
  encoder->exchangeLines();
  turn(100, 50ms);
  rest(5ms);
  EXPECT_EQ(all<Count>().back().counts, -100);
  EXPECT_EQ(source->unusable(), 0U);
}

TEST_F(Quadrature, TellsAnIllegalTransitionAndThatItsCountsDoNotGoOn) {
  open();
  turn(20, 20ms);
  encoder->hideEdges(1);
  turn(40, 20ms);
  rest(5ms);
  EXPECT_EQ(source->decoder().illegal(), 1U);
  EXPECT_EQ(source->unusable(), 1U);
  const auto losses = all<SourceLost>();
  ASSERT_EQ(losses.size(), 1U);
  EXPECT_EQ(losses[0].source, Source::encoders);
  EXPECT_EQ(losses[0].reason, LossReason::overrun);
  EXPECT_EQ(losses[0].axes, axisBit(Axis::x));
}

TEST_F(Quadrature, TellsHowManyEdgesTheKernelHadNoRoomFor) {
  open(kX, 20'000, 16);
  rest(5ms);
  now += 20ms;
  encoder->turnTo(at_count = 100, now);  // nobody reads meanwhile
  read();
  rest(5ms);
  ASSERT_EQ(encoder->lostEdges(), 84U);
  const auto losses = all<SourceLost>();
  ASSERT_FALSE(losses.empty());
  std::uint32_t lost = 0;
  for (const auto& loss : losses) lost += loss.lost;
  EXPECT_EQ(lost, 84U);
}

TEST_F(Quadrature, RefusesARateBeyondItsLimitAndSaysSo) {
  open(kX, 1000);
  turn(190, 200ms);  // 950 edges/s
  EXPECT_EQ(source->problem(), "");
  turn(500, 200ms);  // 1550
  EXPECT_THAT(std::string{source->problem()}, HasSubstr("1000"));
  const auto refused = all<SourceLost>();
  ASSERT_EQ(refused.size(), 1U);
  EXPECT_EQ(refused[0].reason, LossReason::overrun);
  const auto given = all<Count>().size();
  turn(800, 200ms);
  EXPECT_EQ(all<Count>().size(), given) << "nothing is given that may be wrong";
  rest(200ms);
  EXPECT_EQ(source->problem(), "");
  EXPECT_GT(all<Count>().size(), given);
  EXPECT_EQ(all<SourceLost>().size(), 1U);
}

TEST_F(Quadrature, IsGoneWithItsLinesAndComesBackWithThem) {
  open();
  turn(30, 30ms);
  rest(5ms);
  encoder->disconnect();
  rest(20ms);
  ASSERT_EQ(all<SourceLost>().size(), 1U);
  EXPECT_EQ(all<SourceLost>()[0].reason, LossReason::disconnected);
  EXPECT_EQ(all<SourceLost>()[0].axes, axisBit(Axis::x));
  const auto given = all<Count>();
  turn(37, 10ms);  // unseen
  EXPECT_EQ(all<Count>().size(), given.size());
  encoder->reconnect();
  turn(47, 10ms);
  rest(5ms);
  EXPECT_EQ(all<Count>().back().counts - given.back().counts, 10);
  EXPECT_EQ(all<Count>()[given.size()].sequence, given.back().sequence + 1);
  EXPECT_EQ(source->decoder().illegal(), 0U);
}

// Whatever is turned and whenever it is read: the last count is where the encoder stands, and nothing is called
// illegal.
TEST_F(Quadrature, FollowsAnyMotionWithoutALoss) {
  open();
  std::mt19937 random{7};
  for (int i = 0; i < 200; ++i) {
    const auto to = at_count + std::uniform_int_distribution{-40, 40}(random);
    turn(to, std::chrono::milliseconds{std::uniform_int_distribution{3, 40}(random)});
  }
  rest(5ms);
  EXPECT_EQ(all<Count>().back().counts, at_count);
  EXPECT_EQ(source->unusable(), 0U);
  EXPECT_TRUE(all<SourceLost>().empty());
}

}  // namespace
}  // namespace probebox::gpio
