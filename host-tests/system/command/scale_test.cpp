#include "tools/probebox/tables/scale.hpp"

#include <array>
#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <rapidcheck.h>

namespace probebox::command {
namespace {

TEST(AScale, PrintsCountsWithoutTheNoiseOfBinaryFractions) {
  EXPECT_EQ(Scale{1e-6}.text(120'000'477), "120.000477");
  EXPECT_EQ(Scale{0.001}.text(-3), "-0.003");
  EXPECT_EQ(Scale{0.0025}.text(3), "0.0075") << "as many decimals as the scale has, not as its order of magnitude";
  EXPECT_EQ(Scale{20.0}.text(-7), "-140");
  EXPECT_EQ(Scale{1.0}.text(std::numeric_limits<std::int64_t>::min()), "-9223372036854775808");
}

// The reference puts the point into the digits of the count.
TEST(AScale, IsExactForEveryPowerOfTen) {
  constexpr std::array<double, 7> kScales{1.0, 0.1, 0.01, 1e-3, 1e-4, 1e-5, 1e-6};
  EXPECT_TRUE(rc::check([&] {
    const auto decimals = *rc::gen::inRange<std::size_t>(1, kScales.size());
    const auto count = *rc::gen::inRange<std::int64_t>(-1'000'000'000'000'000, 1'000'000'000'000'000);
    std::string digits = std::to_string(std::abs(count));
    if (digits.size() <= decimals) digits.insert(0, decimals + 1 - digits.size(), '0');
    digits.insert(digits.size() - decimals, ".");
    RC_ASSERT(Scale{kScales[decimals]}.text(count) == (count < 0 ? "-" : "") + digits);
  }));
}

TEST(AScale, FallsBackToTheNearestDouble) {
  const double third = 1.0 / 3.0;
  EXPECT_FALSE(Scale{third}.decimals());
  for (const double scale : {third, 1e-300, 1e300}) {
    EXPECT_EQ(std::stod(Scale{scale}.text(7)), 7 * scale);
    EXPECT_EQ(Scale{scale}.value(7), 7 * scale);
  }
  const auto most = std::numeric_limits<std::int64_t>::max();
  EXPECT_EQ(Scale{1e-6}.value(most), static_cast<double>(most) * 1e-6);
}

}  // namespace
}  // namespace probebox::command
