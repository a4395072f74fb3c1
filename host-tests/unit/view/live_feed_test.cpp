#include "tools/probebox/view/live_feed.hpp"

#include <gtest/gtest.h>

// The newest samples, for a look at what was around a trigger.
namespace probebox::view {
namespace {

constexpr std::int64_t kPeriod_ns = 1'000'000;

// Shows these counts, one sample every millisecond.
Json shown(const messages::ChannelDescription& channel, const std::vector<std::int64_t>& counts) {
  messages::Descriptor descriptor;
  descriptor.channels = {channel};
  LiveFeed feed;
  feed.describe(descriptor);
  codec::BlockHeader header;
  header.count = static_cast<std::uint16_t>(counts.size());
  header.map.period_q32_ns = kPeriod_ns << 32U;
  feed.add({descriptor, header, counts});
  return feed.window(0, kPeriod_ns * static_cast<std::int64_t>(counts.size()), 100);
}

std::string highs(Json window) {
  return window["high"].dump();
}

TEST(LiveFeed, KeepsPlacesThatAreFarApart) {
  // 3 m at 1e6 counts in a millimetre.
  const auto window = shown({"position_x", "mm", 1e-6, 8, true, ""}, {0, 3'000'000'000, -3'000'000'000});
  EXPECT_EQ(highs(window), "[[0.0,3000.0,-3000.0]]");
}

TEST(LiveFeed, KeepsEveryCountOfAChannel) {
  EXPECT_EQ(highs(shown({"flags", "", 1, 1, false, ""}, {0, 255})), "[[0.0,255.0]]");
  EXPECT_EQ(highs(shown({"deflection_a", "nm", 1, 4, true, ""}, {INT32_MIN, INT32_MAX})),
            "[[-2147483648.0,2147483647.0]]");
  EXPECT_EQ(highs(shown({"counter", "", 1, 4, false, ""}, {0, UINT32_MAX})), "[[0.0,4294967295.0]]");
}

TEST(LiveFeed, ShowsTheExtremesOfAColumn) {
  const std::vector<std::int64_t> counts{5, -7, 9, 1};
  messages::Descriptor descriptor;
  descriptor.channels = {{"deflection_a", "nm", 1, 4, true, ""}};
  LiveFeed feed;
  feed.describe(descriptor);
  codec::BlockHeader header;
  header.count = 4;
  header.map.period_q32_ns = kPeriod_ns << 32U;
  feed.add({descriptor, header, counts});
  auto window = feed.window(0, 4 * kPeriod_ns, 2);
  EXPECT_EQ(window["low"].dump(), "[[-7.0,1.0]]");
  EXPECT_EQ(window["high"].dump(), "[[5.0,9.0]]");
  EXPECT_EQ(feed.newest().dump(), "[1.0]");
}

}  // namespace
}  // namespace probebox::view
