#include <gtest/gtest.h>
#include <random>
#include <vector>

#include "case_entry.hpp"
#include "host-tests/support/sanitized.hpp"
#include "require.hpp"

// The fuzzer's entry without a fuzzer: a case of every method as it was measured, then with one change to eight, the
// same every time. PROBEBOX_ROUNDS: how many, for a longer look.
namespace probebox {
namespace {

using Bytes = std::vector<std::uint8_t>;

TEST(CaseFuzz, EveryCaseOfTheTestsIsAnswered) {
  EXPECT_EQ(feedCase(nullptr, 0), 0);
  for (std::uint8_t k = 0; k < 64; ++k) EXPECT_EQ(feedCase(&k, 1), 0);
}

TEST(CaseFuzz, ChangedCasesAreAnsweredOrRefusedByName) {
  constexpr int kUsual = support::kSanitized ? 300 : 3000;
  std::mt19937_64 random{20261124};
  for (int round = 0; round < fuzz::rounds(kUsual); ++round) {
    Bytes bytes(1 + 6 * (1 + random() % (round % 2 == 0 ? 1 : 8)));
    for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random());
    SCOPED_TRACE(testing::PrintToString(bytes));
    ASSERT_EQ(feedCase(bytes.data(), bytes.size()), 0) << round;
  }
}

}  // namespace
}  // namespace probebox
