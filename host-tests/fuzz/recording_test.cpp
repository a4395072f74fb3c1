#include <algorithm>
#include <gtest/gtest.h>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "recording_entry.hpp"
#include "require.hpp"
#include "tools/link/recording_maker.hpp"

// The fuzzer's entry without a fuzzer: recordings as the box makes them, then the same ones cut, damaged and put
// together from parts, the same every time.
namespace probebox {
namespace {

std::string recording(messages::Profile profile, std::mt19937_64& random) {
  std::ostringstream out;
  link::RecordingMaker maker{out, profile, 1 + random() % 60};
  messages::Descriptor descriptor;
  descriptor.channels = {
      {"x", "mm", 1e-6, 4, true, ""}, {"probe a", "", 1, 4, true, ""}, {"referenced", "", 1, 1, false, ""}};
  EXPECT_TRUE(maker.begin(descriptor));
  SampleIndex next{};
  for (auto parts = 1 + random() % 6; parts > 0; --parts) {
    const auto count = 1 + random() % 200;
    std::vector<std::vector<std::int64_t>> columns(3, std::vector<std::int64_t>(count));
    for (auto& column : columns) std::ranges::generate(column, [&] { return static_cast<std::int32_t>(random()); });
    std::ranges::generate(columns[2], [&] { return static_cast<std::int64_t>(random() % 256); });
    const std::vector<std::span<const std::int64_t>> views{columns.begin(), columns.end()};
    EXPECT_TRUE(maker.add(next, views));
    next = next + static_cast<std::int64_t>(count + (random() % 3 == 0 ? random() % 50 : 0));
  }
  EXPECT_TRUE(maker.end());
  return out.str();
}

void feed(const std::string& text) {
  ASSERT_EQ(feedRecording(reinterpret_cast<const std::uint8_t*>(text.data()), text.size()), 0);
}

TEST(RecordingFuzz, WholeAndDamagedRecordingsAreReadAsFarAsTheyGo) {
  std::mt19937_64 random{20261124};
  feed("");
  for (int round = 0; round < fuzz::rounds(500); ++round) {
    const auto whole = recording(round % 2 == 0 ? messages::Profile::fast : messages::Profile::raw, random);
    feed(whole);
    auto text = whole;
    for (auto times = 1 + random() % 8; times > 0 && !text.empty(); --times) {
      const auto at = random() % text.size();
      switch (random() % 5) {
        case 0:
          text[at] = static_cast<char>(random());
          break;
        case 1:
          text.erase(at, 1 + random() % 40);
          break;
        case 2:
          text.insert(at, text.substr(random() % text.size(), random() % 400));
          break;
        case 3:
          text.insert(at, 1 + random() % 40, static_cast<char>(random()));
          break;
        default:
          text.resize(at);
      }
    }
    feed(text);
  }
}

}  // namespace
}  // namespace probebox
