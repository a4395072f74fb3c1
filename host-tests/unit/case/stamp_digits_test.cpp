// Time stamps that were written with too few digits, or by a clock with long ticks.
#include "firmware/metrology/dataset/stamp_digits.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <gmock/gmock.h>
#include <random>
#include <string>
#include <vector>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/dataset/stamp_ticks.hpp"
#include "firmware/metrology/solve.hpp"
#include "reported_case.hpp"

namespace probebox::casefolder {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;

// Stamps of a steady rate are all moved alike by rounding: no residual shows it.
class StampDigits : public testing::TestWithParam<std::string> {
 protected:
  static void round(metrology::Dataset& dataset, double digit_s) {
    for (auto& table : dataset.tables) {
      if (table.name != "machine" && table.name != "probe" && table.name != "article") continue;
      for (auto& column : table.columns) {
        if (column.name != "t_s") continue;
        for (auto& value : column.values) value = std::round(value / digit_s) * digit_s;
      }
    }
  }
};

TEST_P(StampDigits, AreInTheStandardDeviationOfADelay) {
  const auto exact = metrology::solve(reportedCase(GetParam())).value();
  for (const double digit_s : {1e-3, 1e-4, 1e-5}) {
    auto dataset = reportedCase(GetParam());
    round(dataset, digit_s);
    const auto solved = metrology::solve(dataset);
    EXPECT_TRUE(solved || digit_s == 1e-3) << "those of whole milliseconds may hide the motion: " << digit_s;
    if (!solved) continue;
    EXPECT_THAT(solved->warnings, Contains(AllOf(HasSubstr("t_s"), HasSubstr("'machine'"), HasSubstr("microseconds"))));
    for (const auto& before : exact.estimates) {
      const auto* after = solved->find(before.key);
      if (after == nullptr || !before.key.starts_with("tau_")) continue;
      for (std::size_t k = 0; k < before.values.size(); ++k) {
        const double sd = std::hypot(before.sd[k], after->sd[k]);
        EXPECT_LE(std::abs(after->values[k] - before.values[k]), 3 * sd) << before.key << " at digits of " << digit_s;
        EXPECT_GE(after->sd[k], 0.99 * digit_s / std::sqrt(12.0));
      }
    }
  }
}

// Of a counter that has no decimal period.
TEST_P(StampDigits, OfAClockWithLongTicksAreInItToo) {
  const auto exact = metrology::solve(reportedCase(GetParam())).value();
  for (const double tick_s : {1.0 / 1024, 1.0 / 1100, 3.7e-4}) {
    auto dataset = reportedCase(GetParam());
    round(dataset, tick_s);
    const auto solved = metrology::solve(dataset);
    EXPECT_TRUE(solved || tick_s != 3.7e-4) << solved.error().reason;
    if (!solved || !solved->find("tau_s")) continue;
    const auto ticks = HasSubstr("come in ticks of " + metrology::text(tick_s) + " s");
    EXPECT_THAT(solved->warnings, Contains(AllOf(HasSubstr("table 'machine'"), ticks)));
    const auto &before = *exact.find("tau_s"), &after = *solved->find("tau_s");
    EXPECT_LE(std::abs(after.values[0] - before.values[0]), 3 * std::hypot(before.sd[0], after.sd[0]));
    EXPECT_GE(after.sd[0], 0.99 * tick_s / std::sqrt(12.0));
  }
}

INSTANTIATE_TEST_SUITE_P(Case, StampDigits, testing::ValuesIn([] {
                           auto names = caseNames();
                           std::erase_if(names, [](const std::string& name) { return !name.starts_with("delay-"); });
                           return names;
                         }()),
                         [](const auto& test) {
                           std::string name = test.param;
                           std::ranges::replace(name, '-', '_');
                           return name;
                         });

// Samples of a steady rate, of which one in ten is lost, in touches that begin at any time.
metrology::Table stream(double period_s, double tick_s, double place_s, double jitter_s, unsigned seed = 1) {
  std::mt19937_64 random{seed};
  std::uniform_real_distribution<double> any{0, 1};
  metrology::Table table = metrology::Table::withColumns("probe", std::array<std::string_view, 2>{"touch", "t_s"});
  for (int touch = 0; touch < 6; ++touch) {
    const double start_s = 3 * touch + any(random);
    for (int k = 0; k < 200; ++k) {
      if (any(random) < 0.1) continue;
      double time_s = start_s + period_s * k + jitter_s * any(random);
      if (tick_s > 0) time_s = tick_s * std::floor(time_s / tick_s);
      table.append({static_cast<double>(touch), place_s * std::round(time_s / place_s)});
    }
  }
  return table;
}

TEST(StampTicks, AreFoundWhateverTheirLength) {
  for (const double tick_s : {1.0 / 1024, 1.0 / 3000, 2.5e-4, 1e-4 / 3, 1.25e-4}) {
    for (const double place_s : {1e-6, 1e-7, 1e-9, 1e-12}) {
      if (tick_s < 60 * place_s) continue;
      for (const double jitter_s : {1e-4, 5e-4}) {
        const auto ticks = metrology::ticksOf(stream(2.5e-3, tick_s, place_s, jitter_s));
        EXPECT_NEAR(ticks.tick_s, tick_s, 1e-3 * tick_s) << place_s << ' ' << jitter_s;
        EXPECT_TRUE(ticks.shown);
      }
    }
  }
}

TEST(StampTicks, AreNotSeenInASteadyRateOrInTrueTimes) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    for (const double period_s : {1e-3, 2e-3, 1.0 / 1024, 1.0 / 3000}) {
      for (const double place_s : {1e-6, 1e-8, 1e-9, 1e-12}) {
        const auto shown = [&](double tick_s, double jitter_s) {
          return metrology::ticksOf(stream(period_s, tick_s, place_s, jitter_s, seed)).shown;
        };
        EXPECT_FALSE(shown(0, 0)) << "steady, with samples lost";
        for (const double jitter_s : {1e-7, 1e-6, 1e-5, 3e-4}) EXPECT_FALSE(shown(0, jitter_s)) << "uneven";
        EXPECT_FALSE(shown(period_s, 0)) << "one tick a sample";
        EXPECT_FALSE(shown(period_s / 4, 0)) << "steady, from any cycle of a controller on";
      }
    }
  }
}

TEST(StampTicks, OfOneStreamAreNoneBesideAnotherWithTrueTimes) {
  auto machine = stream(2.1e-3, 1.0 / 3000, 1e-9, 0);
  machine.name = "machine";
  const auto told = [&](const metrology::Table& probe) {
    return metrology::coarseStamps({.method = "delay-plates", .config = {}, .tables = {machine, probe}}).size();
  };
  EXPECT_EQ(told(stream(1e-3, 0, 1e-9, 0)), 0U);
  EXPECT_EQ(told(stream(1e-3, 1.0 / 3000, 1e-9, 0)), 2U) << "a steady rate of three of the same ticks";
}

}  // namespace
}  // namespace probebox::casefolder
