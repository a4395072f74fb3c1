#include <fstream>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <regex>
#include <string>

namespace probebox::view {
namespace {

// Of Debian 12, the oldest system that builds the page and runs its tests.
constexpr int kOldestNode = 18;

TEST(Packages, RunOnTheNodeOfTheOldestDebian) {
  std::ifstream file{PROBEBOX_SOURCE_DIR "/tools/view/web/package-lock.json"};
  ASSERT_TRUE(file.is_open());
  const auto packages = nlohmann::json::parse(file).at("packages");
  EXPECT_TRUE(packages.contains("node_modules/playwright-core"));
  const std::regex at_least{R"(>=\s*(\d+).*)"};
  for (const auto& [name, package] : packages.items()) {
    if (!package.contains("engines") || !package["engines"].contains("node")) continue;
    const auto node = package["engines"]["node"].get<std::string>();
    std::smatch found;
    ASSERT_TRUE(std::regex_match(node, found, at_least)) << name << " needs node " << node;
    EXPECT_LE(std::stoi(found[1]), kOldestNode) << name << " needs node " << node;
  }
}

}  // namespace
}  // namespace probebox::view
