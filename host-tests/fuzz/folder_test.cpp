#include <array>
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <iterator>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "folder_entry.hpp"
#include "require.hpp"

// The fuzzer's entry without a fuzzer: the folders of the tests' cases, then with their text damaged, the same every
// time.
namespace probebox {
namespace {

std::vector<std::string> folders() {
  std::vector<std::string> all;
  for (const auto& folder : std::filesystem::directory_iterator{PROBEBOX_CASES}) {
    std::string text;
    for (const auto& entry : std::filesystem::directory_iterator{folder}) {
      std::ifstream file{entry.path()};
      text += "=== " + entry.path().filename().string() + "\n" + std::string{std::istreambuf_iterator<char>{file}, {}};
    }
    constexpr std::size_t kShort = 6000;
    if (text.size() < kShort) all.push_back(std::move(text));
  }
  return all;
}

void feed(const std::string& text) {
  ASSERT_EQ(feedFolder(reinterpret_cast<const std::uint8_t*>(text.data()), text.size()), 0);
}

TEST(FolderFuzz, WholeAndDamagedFoldersComeBackOrAreRefusedWithAName) {
  constexpr std::array<std::string_view, 12> kOdd{",",    "\n",    "\r\n", "1e999", "nan",         "\"",
                                                  "\x00", "0x1p4", "-",    "[[1]]", "=== x.csv\n", "\xEF\xBB\xBF"};
  const auto all = folders();
  ASSERT_GT(all.size(), 10U);
  for (const auto& text : all) feed(text);
  std::mt19937_64 random{20261125};
  for (int round = 0; round < fuzz::rounds(1500); ++round) {
    auto text = all.at(random() % all.size());
    for (auto times = 1 + random() % 4; times > 0; --times) {
      const auto at = random() % text.size();
      switch (random() % 4) {
        case 0:
          text[at] = static_cast<char>(random());
          break;
        case 1:
          text.insert(at, kOdd.at(random() % kOdd.size()));
          break;
        case 2:
          text.erase(at, 1 + random() % 30);
          break;
        default:
          text.resize(at + 1);
      }
      if (text.empty()) text = "=== config.json\n{}";
    }
    feed(text);
  }
}

}  // namespace
}  // namespace probebox
