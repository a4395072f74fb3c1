// Configurations with keys that no method takes.
#include <ctime>
#include <gmock/gmock.h>
#include <string>
#include <vector>

#include "firmware/metrology/solve.hpp"
#include "reported_case.hpp"
#include "scratch_folder.hpp"

namespace probebox::casefolder {
namespace {

using testing::HasSubstr;

std::vector<std::string> warningsWith(int unused) {
  auto dataset = reportedCase("spindle-offset-2x2");
  for (int k = 0; k < unused; ++k) dataset.config["k" + std::to_string(k)] = 1.0;
  return metrology::solve(dataset).value().warnings;
}

TEST(UnusedKeys, AreNamedUpToTwenty) {
  EXPECT_EQ(warningsWith(1).size(), 1U);
  EXPECT_EQ(warningsWith(20).size(), 20U);
  const auto many = warningsWith(50'000);
  EXPECT_EQ(many.size(), 21U);
  EXPECT_THAT(many.front(), HasSubstr("'k0'"));
  EXPECT_THAT(many.back(), testing::AllOf(HasSubstr("49980 more"), HasSubstr("not used")));
}

class ManyKeys : public ScratchFolder {
 protected:
  // The processor's time for a configuration of so many keys.
  double secondsFor(int keys) const {
    const auto folder = goodCase("case");
    std::string config = R"({"method": "sphere-fit")";
    for (int k = 0; k < keys; ++k) config += ", \"k" + std::to_string(k) + "\": 1";
    write("case/config.json", config + "}");
    const auto begin = std::clock();
    EXPECT_TRUE(readCase(folder));
    return static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
  }
};

// Comparing all keys with all would take a hundred times as long for ten times as many.
TEST_F(ManyKeys, AreReadInATimeThatGrowsAsTheyDo) {
  const double few_s = secondsFor(20'000);
  EXPECT_LT(secondsFor(200'000), 40 * few_s);
}

}  // namespace
}  // namespace probebox::casefolder
