#include <array>
#include <gtest/gtest.h>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "require.hpp"
#include "tape_entry.hpp"

// The fuzzer's entry without a fuzzer: lines that a control prints, then the same ones damaged, the same every time.
namespace probebox {
namespace {

constexpr std::array<std::string_view, 16> kLines{"BEGIN3 A0. B0. C90. T1 F15.",
                                                  "END3 A0. B0. C90. T1 F15.",
                                                  "ABANDON3",
                                                  "HOME X120.5 Z0.",
                                                  "POSE B30. T4 L120.",
                                                  "CUT1",
                                                  "CUT0",
                                                  "X12.3 Y4.5 Z6.7",
                                                  "STATUS",
                                                  "CORRECTIONS",
                                                  "ALL",
                                                  "X1e999",
                                                  "BEGIN99999999999",
                                                  "HOME X-1e308 Y.. Z",
                                                  "POSE B- T-1 L",
                                                  "F1F1F1"};

void feed(const std::string& text) {
  ASSERT_EQ(feedTape(reinterpret_cast<const std::uint8_t*>(text.data()), text.size()), 0);
}

TEST(TapeFuzz, LinesAreUnderstoodOrRefusedWithASentence) {
  std::mt19937_64 random{20261124};
  for (int round = 0; round < fuzz::rounds(20'000); ++round) {
    std::string text{static_cast<char>(random() % 4), static_cast<char>(random() % 64)};
    for (auto lines = 1 + random() % 6; lines > 0; --lines)
      text += std::string{kLines.at(random() % kLines.size())} + (random() % 2 == 0 ? "\r\n" : "\r");
    for (auto times = random() % 6; times > 0; --times) {
      const auto at = 2 + random() % (text.size() - 2);
      switch (random() % 4) {
        case 0:
          text[at] = static_cast<char>(random());
          break;
        case 1:
          text.insert(at, 1 + random() % 300, "0123456789.-+eXYZ"[random() % 17]);
          break;
        case 2:
          text.insert(at, 1, "\x11\x13%*\x7F\n"[random() % 6]);
          break;
        default:
          text.erase(at, 1);
      }
      if (text.size() < 3) text += "X1\n";
    }
    feed(text);
  }
}

}  // namespace
}  // namespace probebox
